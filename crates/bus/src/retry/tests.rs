//! What is repeated, and when.

use super::*;
use crate::{Protocol, T7};
use clino_codec::t7::{Axis, DecodeError, Request};

const READ: Request = Request::GetAngle(Axis::Two);
const WRITE: Request = Request::SetDamping { damping_ms: 125 };
const SILENCE: Fault<DecodeError> = Fault::NoAnswer { waited: Duration::from_micros(2_174) };

fn after(retry: Retry, tried: u8, request: &Request, fault: Fault<DecodeError>) -> Option<Instant> {
    retry.after(tried, T7::writes(request), &fault, Instant::from_micros(2_000))
}

#[test]
fn a_reading_is_repeated_after_every_fault_as_often_as_wanted() {
    let damaged = Fault::Bad(DecodeError::Checksum { received: 0, computed: 1 });
    let garbled = Fault::Garbled { characters: 3 };
    for fault in [SILENCE, damaged, garbled, Fault::Contention, Fault::NotSent, Fault::LineBusy] {
        let again = [1, 2, 3].map(|tried| after(Retry::times(2), tried, &READ, fault).is_some());
        assert_eq!(again, [true, true, false], "{fault:?}");
        assert_eq!(after(Retry::NEVER, 1, &READ, fault), None);
    }
}

#[test]
fn a_write_is_repeated_only_if_it_was_never_sent() {
    assert_eq!(after(Retry::times(2), 1, &WRITE, SILENCE), None);
    assert_eq!(after(Retry::times(2), 1, &WRITE, Fault::NotSent), None);
    assert!(after(Retry::times(2), 1, &WRITE, Fault::LineBusy).is_some());
}

#[test]
fn a_collection_that_is_over_is_not_repeated() {
    assert_eq!(after(Retry::times(2), 1, &READ, Fault::Over { answers: 1, garbled: 1 }), None);
}

#[test]
fn the_next_try_comes_after_the_pause() {
    let retry = Retry { times: 1, pause: Duration::from_micros(50_000) };
    assert_eq!(after(retry, 1, &READ, SILENCE), Some(Instant::from_micros(52_000)));
    assert_eq!(after(Retry::times(1), 1, &READ, SILENCE), Some(Instant::from_micros(2_000)));
}

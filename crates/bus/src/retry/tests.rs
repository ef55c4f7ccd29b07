//! What is repeated, and when.

use super::*;
use crate::T7;
use clino_codec::checks::Check;
use clino_codec::t7::{Axis, DecodeError, Request};

const READ: Request = Request::GetAngle(Axis::Two);
const WRITE: Request = Request::SetDamping { damping_ms: 125 };
const SILENCE: Fault<DecodeError> = Fault::NoAnswer { waited: Duration::from_micros(2_174) };

fn after(retry: Retry, tried: u8, request: &Request, fault: Fault<DecodeError>) -> Option<Instant> {
    retry.after::<T7>(tried, request, &fault, Instant::from_micros(2_000))
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

/// Whoever knows only the check that failed blames and repeats as one who has the whole error.
#[test]
fn a_fault_is_the_same_without_the_details_of_its_error() {
    let bad = |error, check| (Fault::Bad(error), Fault::Bad(check));
    let at = Instant::from_micros(7);
    for (fault, plain) in [
        bad(DecodeError::Checksum { received: 0, computed: 1 }, Check::Checksum),
        bad(DecodeError::Length { received: 3, expected: 6 }, Check::Length),
        (SILENCE, Fault::NoAnswer { waited: Duration::from_micros(2_174) }),
        (Fault::Garbled { characters: 3 }, Fault::Garbled { characters: 3 }),
        (Fault::Contention, Fault::Contention),
        (Fault::NotSent, Fault::NotSent),
        (Fault::LineBusy, Fault::LineBusy),
        (Fault::Over { answers: 1, garbled: 2 }, Fault::Over { answers: 1, garbled: 2 }),
    ] {
        assert_eq!(fault.with_check(), plain);
        assert_eq!(plain.blame(), fault.blame(), "{fault:?}");
        for tried in 0..4 {
            let again = Retry::times(2).after_harmless(tried, &plain, at);
            assert_eq!(again, Retry::times(2).after::<T7>(tried, &READ, &fault, at), "{fault:?} {tried}");
        }
    }
}

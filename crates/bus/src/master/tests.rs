//! The master against answers that are good, late, foreign, torn and endless. Frames are written out by hand.

use super::*;
use crate::T7;
use clino_codec::character::{Character, LineErrors};
use clino_codec::t7::{Address, Axis, DecodeError, Millidegrees, Request, Response};
use std::vec::Vec;

mod collecting;
mod faults;
mod late;

/// Angle of axis 2 of node 5, −45.313° (T7 guide 2.1.4).
const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
/// The same of node 6.
const FOREIGN: [u8; 8] = [0x06, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x26];
/// One character at 115200 bit/s, rounded up, in µs.
const CHARACTER: u64 = 87;
/// The first character has to be in 2 ms + 2 characters after DE low.
const DEADLINE: u64 = 2_000 + 2 * CHARACTER;

const ANGLE: Request = Request::GetAngle(Axis::Two);

fn node(address: u8) -> Address {
    Address::new(address).unwrap()
}

struct Bench {
    master: Master<T7>,
    now: u64,
    outcomes: Vec<ExchangeOutcome<T7>>,
}

impl Bench {
    /// A master that has just asked node 5 for axis 2; DE fell at 1000 µs.
    fn asked() -> Bench {
        let mut bench = Bench {
            master: Master::new(Timing::t7(crate::Serial::T7_DEFAULT)),
            now: 700,
            outcomes: Vec::new(),
        };
        bench.ask();
        bench
    }

    fn ask(&mut self) {
        let frame = self.master.begin(node(5), &ANGLE, Instant::from_micros(self.now)).unwrap();
        assert_eq!(frame.as_bytes(), [0x05, 0x01, 0x83]);
        self.released();
    }

    /// The frame is out after 300 µs.
    fn released(&mut self) {
        self.now += 300;
        assert!(self.master.on(Event::Released { at: Instant::from_micros(self.now) }).is_none());
    }

    fn wait_until(&mut self, at: u64) {
        while let Some(due) = self.master.poll_at().filter(|due| due.as_micros() <= at) {
            self.now = self.now.max(due.as_micros());
            self.outcomes.extend(self.master.poll(Instant::from_micros(self.now)));
        }
        self.now = self.now.max(at);
    }

    /// Characters back to back, the first one complete at `at`.
    fn hear(&mut self, at: u64, bytes: &[u8]) {
        for (index, &byte) in bytes.iter().enumerate() {
            self.hear_one(at + index as u64 * CHARACTER, Character::clean(byte));
        }
    }

    fn hear_one(&mut self, at: u64, character: Character) {
        self.wait_until(at);
        self.outcomes.extend(self.master.on(Event::Heard { character, at: Instant::from_micros(at) }));
    }

    fn only_outcome(&self) -> &ExchangeOutcome<T7> {
        assert_eq!(self.outcomes.len(), 1);
        &self.outcomes[0]
    }

    fn fault(&self) -> &Fault<DecodeError> {
        self.only_outcome().result.as_ref().unwrap_err()
    }

    fn is_the_answer(&self) -> bool {
        let answer = self.only_outcome().result.as_ref().unwrap();
        answer.address.get() == 5
            && answer.response == Response::GetAngle { axis: Axis::Two, angle: Millidegrees(-45_313) }
    }
}

#[test]
fn a_good_answer_is_stamped_with_its_last_character() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &ANSWER);
    assert!(bench.is_the_answer());
    assert_eq!(bench.only_outcome().at, Instant::from_micros(3_083 + 7 * CHARACTER));
    assert!(bench.master.is_idle());
    let counters = bench.master.counters();
    assert_eq!(
        (counters.requests, counters.good, counters.response_max),
        (1, 1, Duration::from_micros(2_083))
    );
}

#[test]
fn an_answer_that_comes_at_once_is_not_lost() {
    let mut bench = Bench::asked();
    bench.hear(1_000 + 170 + CHARACTER, &ANSWER);
    assert!(bench.is_the_answer());
}

#[cfg(feature = "many-nodes")]
#[test]
fn a_dead_node_costs_its_first_character_deadline() {
    let mut bench = Bench::asked();
    bench.wait_until(1_000 + DEADLINE - 1);
    assert!(bench.outcomes.is_empty());
    bench.wait_until(1_000 + DEADLINE);
    assert_eq!(*bench.fault(), Fault::NoAnswer { waited: Duration::from_micros(DEADLINE as u32) });
    // Request, wait and quiet together: 3 characters, 2 ms, 3 characters. The limit is 2.6 ms.
    const { assert!(3 * CHARACTER + DEADLINE + CHARACTER <= 2_600) };
    let next = 1_000 + DEADLINE + CHARACTER;
    assert_eq!(bench.master.ask_at(node(6), &ANGLE), Some(Instant::from_micros(next)));
    assert!(bench.master.may_ask(node(6), &ANGLE, Instant::from_micros(next)));
    assert!(!bench.master.may_ask(node(6), &ANGLE, Instant::from_micros(next - 1)));
}

#[test]
fn stray_characters_at_turnaround_costs_nothing() {
    let mut bench = Bench::asked();
    bench.hear(1_090, &[0x00, 0xFF]);
    bench.hear(3_083, &ANSWER);
    assert!(bench.is_the_answer());
    assert_eq!(bench.master.counters().discarded, 2);
}

#[test]
fn a_late_answer_is_counted_and_never_used() {
    let mut bench = Bench::asked();
    bench.hear(1_000 + DEADLINE + 20, &ANSWER);
    assert_eq!(*bench.fault(), Fault::NoAnswer { waited: Duration::from_micros(DEADLINE as u32) });
    assert_eq!(bench.master.counters().late, 1);
    assert_eq!(bench.master.counters().good, 0);
}

#[cfg(feature = "many-nodes")]
#[test]
fn the_quiet_time_ends_only_after_the_late_answer() {
    let mut bench = Bench::asked();
    let late = 1_000 + DEADLINE + 20;
    bench.hear(late, &ANSWER[..4]);
    assert!(!bench.master.is_idle());
    // Four characters of silence and the character that would have followed.
    let silent = Instant::from_micros(late + 3 * CHARACTER + 348 + CHARACTER);
    assert_eq!(bench.master.ask_at(node(6), &ANGLE), Some(silent));
}

#[test]
fn a_foreign_answer_is_refused_with_its_sender() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &FOREIGN);
    bench.wait_until(20_000);
    let Fault::Bad(DecodeError::Foreign { address, .. }) = bench.fault() else {
        panic!("{:?}", bench.fault());
    };
    assert_eq!(address.get(), 6);
}

#[test]
fn an_answer_behind_a_foreign_one_still_counts() {
    let mut bench = Bench::asked();
    bench.hear(1_500, &FOREIGN);
    bench.hear(3_083, &ANSWER);
    assert!(bench.is_the_answer());
}

#[test]
fn an_answer_settled_at_the_deadline_is_stamped_with_its_last_character() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &ANSWER);
    let at = 3_083 + 7 * CHARACTER;
    // The header of a longer answer of node 6 in front makes the decoder wait for more than there is.
    let mut held = Bench::asked();
    held.hear(3_083 - 3 * CHARACTER, &[0x06, 0x20, 0x87]);
    held.hear(3_083, &ANSWER);
    held.wait_until(20_000);
    for bench in [bench, held] {
        assert!(bench.is_the_answer());
        assert_eq!(bench.only_outcome().at, Instant::from_micros(at));
    }
}

#[test]
fn a_damaged_answer_says_what_was_seen() {
    let mut bench = Bench::asked();
    let mut damaged = ANSWER;
    damaged[5] ^= 0x10;
    bench.hear(3_083, &damaged);
    bench.wait_until(20_000);
    assert_eq!(*bench.fault(), Fault::Bad(DecodeError::Checksum { received: 0x27, computed: 0x17 }));
    assert_eq!(bench.master.counters().bad_answer, 1);
}

#[test]
fn a_framing_error_spoils_a_frame_whose_sum_is_right() {
    let mut bench = Bench::asked();
    for (index, byte) in ANSWER.into_iter().enumerate() {
        let errors = if index == 4 { LineErrors::FRAMING } else { LineErrors::NONE };
        bench.hear_one(3_083 + index as u64 * CHARACTER, Character { byte, errors });
    }
    bench.wait_until(20_000);
    assert!(matches!(bench.fault(), Fault::Bad(DecodeError::LineErrors { .. })), "{:?}", bench.fault());
    assert_eq!(bench.master.counters().framing, 1);
}

#[test]
fn a_truncated_answer_ends_after_the_gap() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &ANSWER[..6]);
    let last = 3_083 + 5 * CHARACTER;
    // Four characters of silence and the character that would have followed.
    bench.wait_until(last + 348 + CHARACTER - 1);
    assert!(bench.outcomes.is_empty());
    bench.wait_until(last + 348 + CHARACTER);
    assert_eq!(*bench.fault(), Fault::Garbled { characters: 6 });
}

#[test]
fn a_babbling_node_does_not_hold_the_master() {
    let mut bench = Bench::asked();
    // 50 ms of U without a pause, which is never a frame.
    bench.hear(1_100, &[0x55; 575]);
    assert!(matches!(bench.fault(), Fault::Garbled { .. }), "{:?}", bench.fault());
    assert!(bench.only_outcome().at <= Instant::from_micros(1_000 + DEADLINE + 80 * CHARACTER));
    assert!(bench.master.may_ask(node(6), &ANGLE, Instant::from_micros(bench.now)));
}

#[test]
fn the_exchange_after_a_failed_one_is_clean() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &ANSWER[..5]);
    bench.wait_until(60_000);
    bench.outcomes.clear();
    bench.ask();
    let released = bench.now;
    bench.hear(released + 2_083, &ANSWER);
    assert!(bench.is_the_answer());
}

#[test]
fn a_good_exchange_is_idle_at_once_and_a_failed_one_when_no_late_answer_can_come() {
    let mut bench = Bench::asked();
    bench.hear(3_083, &ANSWER);
    assert!(bench.master.is_idle() && !bench.master.is_asking());
    let mut bench = Bench::asked();
    assert!(bench.master.is_asking());
    bench.wait_until(1_000 + DEADLINE + 24_999);
    assert!(!bench.master.is_idle() && !bench.master.is_asking());
    bench.wait_until(1_000 + DEADLINE + 25_000);
    assert!(bench.master.is_idle());
}

#[test]
fn response_times_count_only_answers_without_stray_characters_before_them() {
    let mut bench = Bench::asked();
    bench.hear(3_000, &ANSWER);
    bench.ask();
    let released = bench.now;
    bench.hear(released + 500, &ANSWER);
    bench.ask();
    let released = bench.now;
    bench.hear(released + 90, &[0xFF]);
    bench.hear(released + 1_000, &ANSWER);
    let counters = bench.master.counters();
    assert_eq!(
        (counters.response_last, counters.response_min, counters.response_max),
        (Duration::from_micros(500), Duration::from_micros(500), Duration::from_micros(2_000))
    );
}

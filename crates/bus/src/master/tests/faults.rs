//! Requests that do not get out, talkers in between, and whose fault it all is.

use super::*;
use clino_codec::t7::{Differs, Field};

fn asking() -> Master<T7> {
    let mut master: Master<T7> = Master::new(Timing::t7(crate::Serial::T7_DEFAULT));
    master.begin(node(5), &ANGLE, Instant::from_micros(0)).unwrap();
    master
}

#[test]
fn a_frame_that_hangs_is_given_up() {
    let mut master = asking();
    let outcome = master.on(Event::Forced { at: Instant::from_micros(400) }).unwrap();
    assert_eq!(outcome.result.unwrap_err(), Fault::NotSent);
    assert_eq!(master.counters().forced, 1);
}

#[test]
fn a_line_that_says_nothing_at_all_is_given_up_too() {
    let mut master = asking();
    let at = master.poll_at().unwrap();
    assert_eq!(master.poll(at).unwrap().result.unwrap_err(), Fault::NotSent);
}

#[test]
fn a_frame_that_was_never_begun_can_be_repeated_at_once() {
    let mut master = asking();
    let outcome = master.on(Event::GivenUp { at: Instant::from_micros(5_900) }).unwrap();
    assert_eq!(outcome.result.unwrap_err(), Fault::LineBusy);
    assert_eq!(master.counters().line_busy, 1);
    // After the quiet character.
    assert_eq!(master.ask_at(node(5), &ANGLE), Some(Instant::from_micros(5_900 + CHARACTER)));
}

#[test]
fn contention_is_the_reason_when_nothing_good_comes() {
    let mut bench = Bench { master: asking(), now: 0, outcomes: Vec::new() };
    for at in [100, 187, 260] {
        assert!(bench.master.on(Event::Contention { at: Instant::from_micros(at) }).is_none());
    }
    bench.released();
    bench.wait_until(10_000);
    assert_eq!(*bench.fault(), Fault::Contention);
    assert_eq!(bench.master.counters().contention, 1);
}

#[test]
fn a_good_answer_counts_whatever_happened_to_the_request() {
    let mut bench = Bench { master: asking(), now: 0, outcomes: Vec::new() };
    assert!(bench.master.on(Event::Contention { at: Instant::from_micros(100) }).is_none());
    bench.released();
    bench.hear(2_000, &ANSWER);
    assert!(bench.is_the_answer());
}

#[test]
fn own_characters_are_counted_and_nothing_else() {
    let mut master = asking();
    for at in [82, 169, 256] {
        assert!(master.on(Event::Echo { at: Instant::from_micros(at) }).is_none());
    }
    assert_eq!((master.counters().echo, master.counters().discarded), (3, 0));
}

#[test]
fn every_fault_has_a_blame() {
    let foreign = DecodeError::Foreign {
        address: node(6),
        opcode: clino_codec::t7::Opcode::GetAngle2,
        differs: Differs::Address,
    };
    for (fault, blame) in [
        (Fault::NoAnswer { waited: Duration::from_micros(1) }, Blame::Node),
        (Fault::Garbled { characters: 1 }, Blame::Line),
        (Fault::Bad(DecodeError::Checksum { received: 0, computed: 1 }), Blame::Line),
        (Fault::Bad(DecodeError::LineErrors { errors: LineErrors::FRAMING }), Blame::Line),
        (Fault::Bad(foreign), Blame::Node),
        (Fault::Bad(DecodeError::Length { received: 3, expected: 6 }), Blame::Node),
        (Fault::Bad(DecodeError::Value { field: Field::Angle, value: 400_000 }), Blame::Node),
        (Fault::Contention, Blame::Line),
        (Fault::LineBusy, Blame::Line),
        (Fault::NotSent, Blame::Ourselves),
        (Fault::Over { answers: 0, garbled: 0 }, Blame::Node),
        (Fault::Over { answers: 1, garbled: 1 }, Blame::Line),
    ] {
        assert_eq!(fault.blame(), blame, "{fault:?}");
    }
    assert_eq!(crate::line::SubmitError::Length(41).blame(), Blame::Request);
    assert_eq!(crate::line::SubmitError::Busy.blame(), Blame::Ourselves);
}

#[test]
fn every_bad_frame_is_counted_by_its_kind() {
    let mut bench = Bench::asked();
    bench.hear(1_500, &FOREIGN);
    let mut damaged = ANSWER;
    damaged[3] ^= 1;
    bench.hear(2_400, &damaged);
    bench.hear(3_200, &[0x05, 0x07, 0x83]);
    bench.wait_until(20_000);
    let counters = bench.master.counters();
    assert_eq!(
        (counters.foreign, counters.checksum, counters.length, counters.bad_answer, counters.no_answer),
        (1, 1, 1, 1, 0)
    );
}

#[test]
fn requests_are_counted_by_their_kind() {
    let mut master: Master<T7> = Master::new(Timing::t7(crate::Serial::T7_DEFAULT));
    let set = Request::SetDamping { damping_ms: 125 };
    master.begin(node(5), &set, Instant::from_micros(0)).unwrap();
    master.begin_retry(node(5), &ANGLE, Instant::from_micros(100)).unwrap();
    master.begin(node(6), &ANGLE, Instant::from_micros(200)).unwrap();
    let counters = master.counters();
    assert_eq!((counters.requests, counters.retries, counters.writes), (3, 1, 1));
}

#[test]
fn a_retry_that_succeeds_does_not_hide_the_failure() {
    let mut bench = Bench::asked();
    bench.wait_until(60_000);
    bench.outcomes.clear();
    bench.master.begin_retry(node(5), &ANGLE, Instant::from_micros(bench.now)).unwrap();
    bench.released();
    bench.hear(bench.now + 2_083, &ANSWER);
    assert!(bench.is_the_answer());
    let counters = bench.master.counters();
    assert_eq!((counters.good, counters.first_try, counters.no_answer), (1, 0, 1));
}

//! One request, any number of answers.

use super::*;

const WINDOW: u64 = 20_000;

/// A bench that has asked all nodes for axis 2; the frame was out at 1000 µs.
fn asked_all() -> Bench {
    let mut bench =
        Bench { master: Master::new(Timing::t7(crate::Serial::T7_DEFAULT)), now: 700, outcomes: Vec::new() };
    let frame = bench
        .master
        .begin_collecting(
            Address::ALL,
            &ANGLE,
            Duration::from_micros(WINDOW as u32),
            Instant::from_micros(700),
        )
        .unwrap();
    assert_eq!(frame.as_bytes(), [126, 0x01, 0x83]);
    bench.released();
    bench
}

/// Senders of the answers; the faults.
fn collected(bench: &Bench) -> (Vec<u8>, Vec<Fault<DecodeError>>) {
    let mut senders = Vec::new();
    let mut faults = Vec::new();
    for outcome in &bench.outcomes {
        match &outcome.result {
            Ok(answer) => senders.push(answer.address.get()),
            Err(fault) => faults.push(*fault),
        }
    }
    (senders, faults)
}

#[test]
fn every_answer_is_an_outcome() {
    let mut bench = asked_all();
    bench.hear(2_000, &ANSWER);
    bench.hear(5_000, &FOREIGN);
    bench.wait_until(1_000 + WINDOW - 1);
    assert_eq!(collected(&bench), (std::vec![5, 6], std::vec![]));
    bench.wait_until(60_000);
    assert_eq!(collected(&bench), (std::vec![5, 6], std::vec![Fault::Over { answers: 2, garbled: 0 }]));
    assert_eq!(bench.outcomes[1].at, Instant::from_micros(5_000 + 7 * CHARACTER));
}

#[test]
fn silence_is_over_at_the_end_of_the_window() {
    let mut bench = asked_all();
    bench.wait_until(60_000);
    assert_eq!(collected(&bench).1, [Fault::Over { answers: 0, garbled: 0 }]);
    assert_eq!(bench.outcomes[0].at, Instant::from_micros(1_000 + WINDOW));
}

#[test]
fn damage_and_discarded_characters_are_reported_and_counted() {
    let mut bench = asked_all();
    let mut damaged = ANSWER;
    damaged[6] ^= 0x80;
    bench.hear(2_000, &damaged);
    bench.hear(4_000, &FOREIGN);
    bench.hear(6_000, &[0xFF, 0xE0, 0x00]);
    bench.wait_until(60_000);
    let (senders, faults) = collected(&bench);
    assert_eq!(senders, [6]);
    assert!(matches!(
        faults[..],
        [
            Fault::Bad(DecodeError::Checksum { .. }),
            Fault::Garbled { characters: 3 },
            Fault::Over { answers: 1, garbled: 2 }
        ]
    ));
}

#[test]
fn an_answer_that_begins_in_the_window_is_heard_to_its_end() {
    let mut bench = asked_all();
    bench.hear(1_000 + WINDOW - 10, &ANSWER);
    bench.wait_until(60_000);
    assert_eq!(collected(&bench), (std::vec![5], std::vec![Fault::Over { answers: 1, garbled: 0 }]));
}

#[test]
fn an_answer_held_back_behind_a_torn_header_comes_at_the_end() {
    let mut bench = asked_all();
    // The checksum of this one is missing: the decoder takes the first character of the next frame for it.
    bench.hear(1_000 + WINDOW - 1_500, &ANSWER[..7]);
    bench.hear(1_000 + WINDOW - 890, &FOREIGN);
    bench.wait_until(60_000);
    let (senders, faults) = collected(&bench);
    assert_eq!(senders, [6]);
    assert!(matches!(faults.last(), Some(Fault::Over { answers: 1, .. })), "{faults:?}");
}

#[test]
fn a_request_that_does_not_get_out_is_the_only_outcome() {
    let mut master: Master<T7> = Master::new(Timing::t7(crate::Serial::T7_DEFAULT));
    master
        .begin_collecting(Address::ALL, &ANGLE, Duration::from_micros(WINDOW as u32), Instant::from_micros(0))
        .unwrap();
    let outcome = master.on(Event::GivenUp { at: Instant::from_micros(6_000) }).unwrap();
    assert_eq!(outcome.result.unwrap_err(), Fault::LineBusy);
    assert!(!master.is_asking());
}

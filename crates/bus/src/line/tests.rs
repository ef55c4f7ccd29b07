//! The line as hardware and a hostile clock may drive it.

use super::*;
use proptest::prelude::*;
use std::vec::Vec as StdVec;

const SERIAL: Serial = Serial { baud: 115_200 };
const GUARD: Micros = Micros(87);
/// Gives a frame all the time in the world.
const NEVER: Micros = Micros(u64::MAX);

/// A line whose transmitter was switched on long before time 0.
fn line() -> Line {
    let mut line = Line::new(SERIAL, GUARD, Micros(0));
    line.clear_at = Micros(0);
    line
}

#[test]
fn the_idle_character_of_a_new_transmitter_is_over_before_the_driver_comes_on() {
    let mut line = Line::new(SERIAL, Micros(0), Micros(1_000));
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.poll(Micros(1_086)), None);
    assert_eq!(line.poll(Micros(1_087)), Some(Step::Begin));
}

/// Sends a whole frame at `now` and returns the characters the line asked to be written.
fn send(line: &mut Line, frame: &[u8], now: Micros) -> StdVec<u8> {
    line.submit(frame, NEVER).unwrap();
    assert_eq!(line.poll(now), Some(Step::Begin));
    let mut written = StdVec::new();
    while let Some(byte) = line.next_character() {
        written.push(byte);
    }
    assert!(line.transmission_complete(now));
    written
}

#[test]
fn a_frame_goes_out_whole_and_in_order() {
    let mut line = line();
    assert_eq!(send(&mut line, &[5, 1, 0x83], Micros(0)), [5, 1, 0x83]);
    assert!(!line.driving());
}

#[test]
fn the_driver_stays_on_until_transmission_complete_of_the_last_character() {
    let mut line = line();
    line.submit(&[1, 2], NEVER).unwrap();
    assert_eq!(line.poll(Micros(0)), Some(Step::Begin));
    assert_eq!(line.next_character(), Some(1));
    // The transmitter ran dry between two characters: complete, but not finished.
    assert!(!line.transmission_complete(Micros(90)));
    assert!(line.driving());
    assert_eq!(line.next_character(), Some(2));
    assert!(!line.transmission_complete(Micros(170)));
    // The last character was accepted, not sent.
    assert_eq!(line.next_character(), None);
    assert!(line.driving());
    assert!(line.transmission_complete(Micros(260)));
    assert!(!line.driving());
}

#[test]
fn the_guard_is_kept_after_everything_heard() {
    let mut line = line();
    line.heard(Micros(1_000));
    line.submit(&[1], NEVER).unwrap();
    // Centre of the stop bit, half a bit of it (5 µs, rounded up), the guard.
    let expected = Micros(1_000 + 5 + 87);
    assert_eq!(line.poll_at(), Some(expected));
    assert_eq!(line.poll(Micros(expected.0 - 1)), None);
    assert_eq!(line.poll(expected), Some(Step::Begin));
}

#[test]
fn a_character_heard_while_waiting_prolongs_the_guard() {
    let mut line = line();
    line.submit(&[1], NEVER).unwrap();
    line.heard(Micros(500));
    assert_eq!(line.poll(Micros(550)), None);
    assert_eq!(line.poll_at(), Some(Micros(500 + 5 + 87)));
}

#[test]
fn a_frame_for_a_line_that_never_falls_silent_is_dropped() {
    let mut line = line();
    line.submit(&[1], Micros(1_000)).unwrap();
    for at in (0..1_000).step_by(50) {
        line.heard(Micros(at));
        assert_eq!(line.poll(Micros(at)), None);
    }
    assert_eq!(line.poll_at(), Some(Micros(1_000)));
    assert_eq!(line.poll(Micros(1_000)), Some(Step::GiveUp));
    assert_eq!(line.poll_at(), None);
    assert_eq!(line.next_character(), None);
    assert!(!line.driving());
}

#[test]
fn a_driver_held_too_long_is_forced_off() {
    let mut line = line();
    line.submit(&[1, 2, 3], NEVER).unwrap();
    assert_eq!(line.poll(Micros(0)), Some(Step::Begin));
    assert_eq!(line.next_character(), Some(1));
    // 3 characters are 261 µs; a quarter of that, but at least one character (87 µs), is allowed on top.
    assert_eq!(line.poll_at(), Some(Micros(261 + 87)));
    assert_eq!(line.poll(Micros(347)), None);
    assert_eq!(line.poll(Micros(348)), Some(Step::Force));
    assert!(!line.driving());
    assert_eq!(line.next_character(), None);
    assert!(!line.transmission_complete(Micros(349)));
    assert_eq!(line.submit(&[1], NEVER), Ok(()));
}

#[test]
fn a_second_frame_is_refused_until_the_first_is_out() {
    let mut line = line();
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.submit(&[2], NEVER), Err(SubmitError::Busy));
    assert_eq!(line.poll(Micros(0)), Some(Step::Begin));
    assert_eq!(line.submit(&[2], NEVER), Err(SubmitError::Busy));
}

#[test]
fn empty_and_oversized_frames_are_refused() {
    assert_eq!(line().submit(&[], NEVER), Err(SubmitError::Length(0)));
    assert_eq!(line().submit(&[0; 41], NEVER), Err(SubmitError::Length(41)));
    assert_eq!(line().submit(&[0; 40], NEVER), Ok(()));
}

#[derive(Clone, Debug)]
enum Action {
    Submit(usize),
    Wait(u64),
    TransmitEmpty,
    TransmitComplete,
    Heard,
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        (0usize..45).prop_map(Action::Submit),
        (0u64..500).prop_map(Action::Wait),
        Just(Action::TransmitEmpty),
        Just(Action::TransmitComplete),
        Just(Action::Heard),
    ]
}

proptest! {
    /// However the events interleave: nothing is sent while the driver is off, the driver is never on without
    /// a deadline, never longer than the longest frame may take, and the guard is kept.
    #[test]
    fn no_interleaving_leaves_the_driver_on(actions in prop::collection::vec(action(), 1..200)) {
        let mut line = line();
        let mut now = Micros(0);
        let mut raised = None;
        let mut heard_last: Option<Micros> = None;
        for action in actions {
            match action {
                Action::Submit(length) => _ = line.submit(&[0x55; 45][..length], now + Micros(600)),
                Action::Wait(span) => now = now + Micros(span),
                Action::TransmitEmpty => {
                    let was_driving = line.driving();
                    prop_assert!(line.next_character().is_none() || was_driving);
                }
                Action::TransmitComplete => {
                    if line.transmission_complete(now) {
                        raised = None;
                        prop_assert!(!line.driving());
                    }
                }
                Action::Heard => {
                    line.heard(now);
                    heard_last = Some(now);
                }
            }
            match line.poll(now) {
                Some(Step::Begin) => {
                    if let Some(at) = heard_last {
                        prop_assert!(now.since(at) >= GUARD);
                    }
                    raised = Some(now);
                }
                Some(Step::Force) => raised = None,
                Some(Step::GiveUp) => prop_assert!(raised.is_none()),
                None => {}
            }
            prop_assert_eq!(line.driving(), raised.is_some());
            if let Some(raised) = raised {
                // 40 characters of 86.8 µs and a quarter.
                prop_assert!(now.since(raised) < Micros(4_341));
                prop_assert!(line.poll_at().is_some());
            }
        }
    }
}

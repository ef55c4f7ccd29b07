//! The line as hardware and a hostile clock may drive it. Times at 115200 bit/s: a character lasts 86.8 µs.

use super::*;
use clino_codec::character::LineErrors;
use std::vec::Vec as StdVec;

mod echo;
mod interleavings;

const SERIAL: Serial = Serial { baud: 115_200 };
const GUARD: Duration = Duration::from_micros(87);
/// Gives a frame all the time in the world.
const NEVER: Instant = Instant::NEVER;

const PLAIN: LineSettings = LineSettings {
    serial: SERIAL,
    guard: GUARD,
    pre_delay: Duration::from_micros(0),
    post_delay: Duration::from_micros(0),
    echo: EchoMode::Off,
};

/// A line whose transmitter was switched on long before time 0.
fn line_with(settings: LineSettings) -> Line {
    let mut line = Line::new(settings, Instant::from_micros(0));
    line.clear_at = Instant::from_micros(0);
    line
}

fn line() -> Line {
    line_with(PLAIN)
}

/// A character of another node.
fn hear(line: &mut Line, at: u64) -> Event {
    line.heard(Character::clean(0x55), Instant::from_micros(at))
}

#[test]
fn the_idle_character_of_a_new_transmitter_is_over_before_the_driver_comes_on() {
    let mut line =
        Line::new(LineSettings { guard: Duration::from_micros(0), ..PLAIN }, Instant::from_micros(1_000));
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(1_086)), None);
    assert_eq!(line.poll(Instant::from_micros(1_087)), Some(LineStep::Begin));
}

/// Hands a frame to the UART at `now`: the characters the line asked to be written.
fn write_all(line: &mut Line, frame: &[u8], now: Instant) -> StdVec<u8> {
    line.submit(frame, NEVER).unwrap();
    assert_eq!(line.poll(now), Some(LineStep::Begin));
    let mut written = StdVec::new();
    while let Some(byte) = line.next_character() {
        written.push(byte);
    }
    written
}

#[test]
fn a_frame_goes_out_whole_and_in_order() {
    let mut line = line();
    assert_eq!(write_all(&mut line, &[5, 1, 0x83], Instant::from_micros(0)), [5, 1, 0x83]);
    assert!(line.transmission_complete(Instant::from_micros(261)));
    assert!(!line.driving());
}

#[test]
fn the_driver_stays_on_until_transmission_complete_of_the_last_character() {
    let mut line = line();
    line.submit(&[1, 2], NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.next_character(), Some(1));
    // The transmitter ran dry between two characters: complete, but not finished.
    assert!(!line.transmission_complete(Instant::from_micros(90)));
    assert!(line.driving());
    assert_eq!(line.next_character(), Some(2));
    assert!(!line.transmission_complete(Instant::from_micros(170)));
    // The last character was accepted, not sent.
    assert_eq!(line.next_character(), None);
    assert!(line.driving());
    assert!(line.transmission_complete(Instant::from_micros(260)));
    assert!(!line.driving());
}

#[test]
fn the_driver_is_on_before_and_after_the_frame_for_the_delays() {
    let mut line = line_with(LineSettings {
        pre_delay: Duration::from_micros(30),
        post_delay: Duration::from_micros(50),
        ..PLAIN
    });
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(1_000)), None);
    assert!(line.driving());
    assert_eq!(line.next_character(), None);
    assert_eq!(line.poll_at(), Some(Instant::from_micros(1_030)));
    assert_eq!(line.poll(Instant::from_micros(1_029)), None);
    assert_eq!(line.poll(Instant::from_micros(1_030)), Some(LineStep::Begin));
    assert_eq!(line.next_character(), Some(1));
    assert_eq!(line.next_character(), None);
    // The frame is out, the driver is not off yet.
    assert!(line.transmission_complete(Instant::from_micros(1_117)));
    assert!(line.driving());
    assert_eq!(line.submit(&[2], NEVER), Err(SubmitError::Busy));
    assert_eq!(line.poll_at(), Some(Instant::from_micros(1_167)));
    assert_eq!(line.poll(Instant::from_micros(1_166)), None);
    assert!(line.driving());
    assert_eq!(line.poll(Instant::from_micros(1_167)), None);
    assert!(!line.driving());
}

#[test]
fn an_answer_that_comes_during_the_post_delay_is_heard_and_ends_it() {
    let mut line = line_with(LineSettings { post_delay: Duration::from_micros(500), ..PLAIN });
    write_all(&mut line, &[1], Instant::from_micros(0));
    assert!(line.transmission_complete(Instant::from_micros(87)));
    // 170 µs after our last bit, and a character.
    let at = Instant::from_micros(87 + 170 + 82);
    let character = Character::clean(5);
    assert_eq!(line.heard(character, at), Event::Heard { character, at });
    assert!(!line.driving());
}

#[test]
fn the_guard_is_kept_after_everything_heard() {
    let mut line = line();
    hear(&mut line, 1_000);
    line.submit(&[1], NEVER).unwrap();
    // Centre of the stop bit, half a bit of it (5 µs, rounded up), the guard.
    let expected = Instant::from_micros(1_000 + 5 + 87);
    assert_eq!(line.poll_at(), Some(expected));
    assert_eq!(line.poll(Instant::from_micros(expected.as_micros() - 1)), None);
    assert_eq!(line.poll(expected), Some(LineStep::Begin));
}

#[test]
fn a_character_heard_while_waiting_prolongs_the_guard() {
    let mut line = line();
    line.submit(&[1], NEVER).unwrap();
    hear(&mut line, 500);
    assert_eq!(line.poll(Instant::from_micros(550)), None);
    assert_eq!(line.poll_at(), Some(Instant::from_micros(500 + 5 + 87)));
}

#[test]
fn a_frame_for_a_line_that_never_falls_silent_is_dropped() {
    let mut line = line();
    line.submit(&[1], Instant::from_micros(1_000)).unwrap();
    for at in (0..1_000).step_by(50) {
        hear(&mut line, at);
        assert_eq!(line.poll(Instant::from_micros(at)), None);
    }
    assert_eq!(line.poll_at(), Some(Instant::from_micros(1_000)));
    assert_eq!(line.poll(Instant::from_micros(1_000)), Some(LineStep::GiveUp));
    assert_eq!(line.poll_at(), None);
    assert_eq!(line.next_character(), None);
    assert!(!line.driving());
}

#[test]
fn a_driver_held_too_long_is_forced_off() {
    let mut line = line();
    line.submit(&[1, 2, 3], NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.next_character(), Some(1));
    // 3 characters are 261 µs; a quarter of that, but at least one character (87 µs), is allowed on top.
    assert_eq!(line.poll_at(), Some(Instant::from_micros(261 + 87)));
    assert_eq!(line.poll(Instant::from_micros(347)), None);
    assert_eq!(line.poll(Instant::from_micros(348)), Some(LineStep::Force));
    assert!(!line.driving());
    assert_eq!(line.next_character(), None);
    assert!(!line.transmission_complete(Instant::from_micros(349)));
    assert_eq!(line.submit(&[1], NEVER), Ok(()));
    // The two characters that the UART still holds have to run out of it first.
    assert_eq!(line.poll_at(), Some(Instant::from_micros(348 + 174)));
}

#[test]
fn a_second_frame_is_refused_until_the_first_is_out() {
    let mut line = line();
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.submit(&[2], NEVER), Err(SubmitError::Busy));
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.submit(&[2], NEVER), Err(SubmitError::Busy));
}

#[test]
fn empty_and_oversized_frames_are_refused() {
    assert_eq!(line().submit(&[], NEVER), Err(SubmitError::Length(0)));
    assert_eq!(line().submit(&[0; 41], NEVER), Err(SubmitError::Length(41)));
    assert_eq!(line().submit(&[0; 40], NEVER), Ok(()));
}

#[test]
fn the_bit_rate_changes_between_two_frames_only() {
    let mut line = line();
    let slow = LineSettings { serial: Serial { baud: 9_600 }, guard: Duration::from_micros(1_042), ..PLAIN };
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.set(slow, Instant::from_micros(0)), Err(SubmitError::Busy));
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.set(slow, Instant::from_micros(10)), Err(SubmitError::Busy));
    while line.next_character().is_some() {}
    assert!(line.transmission_complete(Instant::from_micros(87)));
    assert_eq!(line.set(slow, Instant::from_micros(100)), Ok(()));
    line.submit(&[1], NEVER).unwrap();
    assert_eq!(line.poll_at(), Some(Instant::from_micros(100 + 1_042)));
    assert_eq!(line.poll(Instant::from_micros(1_142)), Some(LineStep::Begin));
    // One character of 1042 µs, and one of margin.
    assert_eq!(line.poll_at(), Some(Instant::from_micros(1_142 + 2 * 1_042)));
}

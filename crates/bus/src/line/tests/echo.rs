//! Our own characters coming back, and others that do not.

use super::*;

const FRAME: [u8; 3] = [0x05, 0x01, 0x83];
/// Transmission complete of a frame of three characters begun at 0.
const COMPLETE: u64 = 261;
/// Centre of the last stop bit.
const LAST: u64 = 256;

fn with(echo: EchoMode) -> Line {
    line_with(LineSettings { echo, ..PLAIN })
}

fn heard(line: &mut Line, byte: u8, at: u64) -> Event {
    line.heard(Character::clean(byte), Instant::from_micros(at))
}

/// Sends the frame at `start`; `echo` comes back, one character time apart. Returns what the line made of it.
fn send(line: &mut Line, start: u64, echo: &[u8]) -> StdVec<Event> {
    line.submit(&FRAME, NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(start)), Some(LineStep::Begin));
    let mut events = StdVec::new();
    for (index, _) in FRAME.iter().enumerate() {
        assert_eq!(line.next_character(), Some(FRAME[index]));
        if let Some(&byte) = echo.get(index) {
            events.push(heard(line, byte, start + LAST - 87 * (2 - index as u64)));
        }
    }
    assert_eq!(line.next_character(), None);
    assert!(line.transmission_complete(Instant::from_micros(start + COMPLETE)));
    events
}

fn is_echo(event: &Event) -> bool {
    matches!(event, Event::Echo { .. })
}

fn is_contention(event: &Event) -> bool {
    matches!(event, Event::Contention { .. })
}

fn is_heard(event: &Event) -> bool {
    matches!(event, Event::Heard { .. })
}

#[test]
fn an_expected_echo_is_removed() {
    let mut line = with(EchoMode::Expected);
    assert!(send(&mut line, 0, &FRAME).iter().all(is_echo));
    assert_eq!(line.poll(Instant::from_micros(10_000)), None);
}

#[test]
fn a_changed_or_damaged_echo_is_contention() {
    let mut line = with(EchoMode::Expected);
    let events = send(&mut line, 0, &[0x05, 0x11, 0x83]);
    assert!(is_echo(&events[0]) && is_contention(&events[1]) && is_echo(&events[2]), "{events:?}");
    assert_eq!(line.poll(Instant::from_micros(10_000)), None);

    let mut line = with(EchoMode::Expected);
    line.submit(&FRAME, NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.next_character(), Some(0x05));
    let damaged = Character { byte: 0x05, errors: LineErrors::FRAMING };
    assert!(is_contention(&line.heard(damaged, Instant::from_micros(82))));
}

#[test]
fn an_echo_that_is_lost_is_contention_as_soon_as_it_is_overdue() {
    for missing in 0..=2 {
        let mut line = with(EchoMode::Expected);
        assert!(send(&mut line, 0, &FRAME[..missing]).iter().all(is_echo));
        // Five bits, 43.4 µs, rounded up.
        let overdue = Instant::from_micros(COMPLETE + 44 + 1);
        assert_eq!(line.poll_at(), Some(overdue));
        assert_eq!(line.poll(overdue), Some(LineStep::EchoLost));
        assert_eq!(line.poll(overdue), None);
    }
}

#[test]
fn the_last_character_may_come_back_after_transmission_complete() {
    let mut line = with(EchoMode::Expected);
    assert!(send(&mut line, 0, &FRAME[..2]).iter().all(is_echo));
    assert!(is_echo(&heard(&mut line, 0x83, COMPLETE + 20)));
    assert_eq!(line.poll(Instant::from_micros(10_000)), None);
}

#[test]
fn an_answer_that_looks_like_our_frame_is_not_an_echo() {
    for mode in [EchoMode::Off, EchoMode::Expected, EchoMode::Detect] {
        for echo in [&FRAME[..], &FRAME[..2], &[]] {
            let mut line = with(mode);
            send(&mut line, 0, echo);
            // An answer cannot begin before our last stop bit: its first character is complete 9.5 bits later.
            for (index, byte) in FRAME.into_iter().enumerate() {
                let event = heard(&mut line, byte, COMPLETE + 82 + 87 * index as u64);
                assert!(is_heard(&event), "{mode:?} {echo:?} {event:?}");
            }
        }
    }
}

#[test]
fn more_characters_than_were_sent_are_not_echoes() {
    let mut line = with(EchoMode::Expected);
    line.submit(&FRAME, NEVER).unwrap();
    assert_eq!(line.poll(Instant::from_micros(0)), Some(LineStep::Begin));
    assert_eq!(line.next_character(), Some(0x05));
    assert!(is_echo(&heard(&mut line, 0x05, 82)));
    assert!(is_heard(&heard(&mut line, 0x01, 84)));
    let mut line = with(EchoMode::Expected);
    send(&mut line, 0, &FRAME);
    assert!(is_heard(&heard(&mut line, 0x83, COMPLETE + 1)));
}

#[test]
fn without_an_echo_everything_is_heard() {
    let mut line = with(EchoMode::Off);
    assert!(send(&mut line, 0, &FRAME).iter().all(is_heard));
    assert_eq!(line.poll_at(), None);
}

#[test]
fn an_echo_is_found_and_lost_again() {
    let mut line = with(EchoMode::Detect);
    assert_eq!(line.has_echo(), None);
    // Found: the first echo is removed already.
    assert!(send(&mut line, 0, &FRAME).iter().all(is_echo));
    assert_eq!(line.has_echo(), Some(true));
    // From then on it is verified.
    assert!(is_contention(&send(&mut line, 1_000, &[0x05, 0x00, 0x83])[1]));
    assert_eq!(line.poll(Instant::from_micros(1_500)), None);
    send(&mut line, 2_000, &FRAME[..1]);
    assert_eq!(line.poll(Instant::from_micros(2_500)), Some(LineStep::EchoLost));
    assert_eq!(line.has_echo(), Some(true));
    // Gone: no node's fault.
    send(&mut line, 3_000, &[]);
    assert_eq!(line.poll(Instant::from_micros(3_500)), None);
    assert_eq!(line.has_echo(), Some(false));
    send(&mut line, 4_000, &[]);
    assert_eq!(line.poll_at(), None);
    // And back.
    assert!(send(&mut line, 5_000, &FRAME).iter().all(is_echo));
    assert_eq!(line.has_echo(), Some(true));
}

#[test]
fn stray_characters_while_we_drive_neither_proves_an_echo_nor_is_contention() {
    let mut line = with(EchoMode::Detect);
    assert!(send(&mut line, 0, &[0xFF, 0x00]).iter().all(is_heard));
    assert_eq!(line.poll(Instant::from_micros(500)), None);
    assert_eq!(line.has_echo(), None);
    // A part of an echo proves nothing, either.
    send(&mut line, 1_000, &FRAME[..2]);
    assert_eq!(line.poll(Instant::from_micros(1_500)), None);
    assert_eq!(line.has_echo(), None);
}

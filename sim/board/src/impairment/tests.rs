//! The line between a wire played by hand and a USART played by hand; instants are worked out here from bits alone.

use clino_segment::chance::Chance;
use clino_segment::wire::{Format, Received, Sent, Wire};

use super::*;

/// 8E1 at 20 kbit/s: 550 µs per character; its stop bit's centre is 525 µs after its beginning.
const EVEN: Format = Format { bit_ps: 50_000_000, data_bits: 9, stop_halves: 2 };
/// 8N1 at the same rate: 500 µs, and 475 µs.
const NONE: Format = Format { bit_ps: 50_000_000, data_bits: 8, stop_halves: 2 };
const US: Ns = 1_000;

/// Hands over these characters at their times; and now.
struct Script(Vec<Received>, Ns);

impl Wire for Script {
    fn set_receiver(&mut self, _now: Ns, _format: Option<Format>) {}

    fn send(&mut self, _sent: Sent) {}

    fn drive_enable(&mut self, _now: Ns, _high: bool) {}

    fn next_event(&self) -> Option<Ns> {
        self.0.first().map(|next| next.at)
    }

    fn advance(&mut self, now: Ns) {
        self.1 = now;
    }

    fn take_received(&mut self) -> Option<Received> {
        self.0.first().is_some_and(|next| next.at <= self.1).then(|| self.0.remove(0))
    }
}

fn heard(at: Ns, word: u16) -> Received {
    Received { at, word, framing_error: false, noise: false }
}

/// Characters back to back, the first at 1 ms.
fn back_to_back(words: &[u16], format: Format) -> Script {
    let length = (u64::from(format.data_bits) + 2) * format.bit_ps / 1_000;
    Script((0..).zip(words).map(|(n, &word)| heard(1_000 * US + n * length, word)).collect(), 0)
}

fn line(script: Script, format: Format, impairments: &[(Effect, Choice)]) -> ImpairedLine {
    let mut line = ImpairedLine::new(Box::new(script), Chance::new(7));
    let shared = line.impairments();
    for &(effect, choice) in impairments {
        shared.lock().add(Impairment { effect, choice });
    }
    line.set_receiver(0, Some(format));
    line
}

/// What arrives until nothing more happens, event by event.
fn play(line: &mut ImpairedLine) -> Vec<Received> {
    let mut arrived = Vec::new();
    while let Some(next) = line.next_event() {
        line.advance(next);
        while let Some(received) = line.take_received() {
            assert!(received.at <= next, "{received:?} before its time, at {next}");
            arrived.push(received);
        }
    }
    arrived
}

/// Times after 1 ms in µs, and words.
fn plain(arrived: &[Received]) -> Vec<(Ns, u16)> {
    arrived.iter().map(|received| (received.at / US - 1_000, received.word)).collect()
}

fn one(first: u64) -> Choice {
    Choice::Characters { first, count: 1 }
}

#[test]
fn without_impairments_everything_comes_as_it_is() {
    let mut words = back_to_back(&[0x41, 0x142, 0x43], EVEN);
    words.0[1].framing_error = true;
    words.0[2].noise = true;
    let expected = words.0.clone();
    let mut line = line(words, EVEN, &[]);
    assert_eq!(play(&mut line), expected);
    assert_eq!(line.impairments().lock().characters(), 3);
}

#[test]
fn each_effect_does_what_its_name_says() {
    // 0x41, 0x42 have two ones, 0x43 three: with even parity 0x041, 0x042, 0x143. (Effect on the second, what arrives.)
    for (effect, expected) in [
        (Effect::Lost, vec![(0, 0x41), (1_100, 0x143)]),
        (Effect::Doubled, vec![(0, 0x41), (550, 0x42), (1_100, 0x42), (1_650, 0x143)]),
        (Effect::Inserted(0x07), vec![(0, 0x41), (550, 0x107), (1_100, 0x42), (1_650, 0x143)]),
        (Effect::Replaced(0x07), vec![(0, 0x41), (550, 0x107), (1_100, 0x143)]),
        (Effect::Flipped(0x101), vec![(0, 0x41), (550, 0x143), (1_100, 0x143)]),
        (Effect::ParityError, vec![(0, 0x41), (550, 0x142), (1_100, 0x143)]),
        (Effect::Paused(700 * US), vec![(0, 0x41), (1_250, 0x42), (1_800, 0x143)]),
        // The second is still in the receiver when the third is complete.
        (Effect::Overrun, vec![(0, 0x41), (1_100, 0x42), (1_100, 0x143)]),
    ] {
        let mut line = line(back_to_back(&[0x41, 0x42, 0x143], EVEN), EVEN, &[(effect, one(1))]);
        assert_eq!(plain(&play(&mut line)), expected, "{effect}");
        let shared = line.impairments();
        let log = shared.lock().log().to_vec();
        assert_eq!(log, [Impaired { at: 1_550 * US, character: Character::Sent(1), word: 0x42, effect }]);
    }
}

#[test]
fn flags_come_with_their_character_alone() {
    let effects = [(Effect::FramingError, one(0)), (Effect::Noise, one(2))];
    let mut line = line(back_to_back(&[0x41, 0x42, 0x43], NONE), NONE, &effects);
    let flags: Vec<_> = play(&mut line).iter().map(|r| (r.framing_error, r.noise)).collect();
    assert_eq!(flags, [(true, false), (false, false), (false, true)]);
}

#[test]
fn a_parity_error_takes_a_parity_bit() {
    let mut line = line(back_to_back(&[0x41], NONE), NONE, &[(Effect::ParityError, one(0))]);
    assert_eq!(plain(&play(&mut line)), [(0, 0x41)]);
}

#[test]
fn a_run_of_characters_may_be_lost_as_when_two_lines_are_spliced() {
    let lost = (Effect::Lost, Choice::Characters { first: 1, count: 2 });
    let mut line = line(back_to_back(&[1, 2, 3, 4], NONE), NONE, &[lost]);
    assert_eq!(plain(&play(&mut line)), [(0, 1), (1_500, 4)]);
}

#[test]
fn an_overrun_of_the_last_character_is_none() {
    let mut line = line(back_to_back(&[1], NONE), NONE, &[(Effect::Overrun, one(0))]);
    // It is read two characters later.
    assert_eq!(plain(&play(&mut line)), [(1_000, 1)]);
}

#[test]
fn a_pause_delays_what_is_behind_it_until_a_silence_makes_up_for_it() {
    let mut script = back_to_back(&[1, 2], NONE);
    script.0.push(heard(9_000 * US, 3));
    let mut line = line(script, NONE, &[(Effect::Paused(2_000 * US), one(0))]);
    assert_eq!(plain(&play(&mut line)), [(2_000, 1), (2_500, 2), (8_000, 3)]);
}

#[test]
fn random_effects_come_as_often_as_asked_and_the_same_each_time() {
    let rate = Probability::new(0.25).unwrap();
    let within = Some((1_000 * US, 1_000 * US + 2_000 * 500 * US));
    let run = || {
        let random = (Effect::BitError, Choice::Random { rate, within });
        let mut line = line(back_to_back(&[0x55; 3_000], NONE), NONE, &[random]);
        let arrived = play(&mut line);
        let shared = line.impairments();
        let log = shared.lock().log().to_vec();
        (arrived, log)
    };
    let (arrived, log) = run();
    assert_eq!((&arrived, &log), (&run().0, &run().1));
    // 500 of 2000 and four standard deviations; none after that.
    assert!((422..=578).contains(&log.len()), "{}", log.len());
    assert!(log.iter().all(|done| done.at < 1_000 * US + 2_000 * 500 * US));
    // Each of the ten bits is hit: one start bit (lost), one stop bit (framing error), eight data bits.
    let count = |wanted: Effect| log.iter().filter(|done| done.effect == wanted).count();
    let kinds = (0..8)
        .map(|bit| count(Effect::Flipped(1 << bit)))
        .chain([count(Effect::Lost), count(Effect::FramingError)]);
    let kinds: Vec<usize> = kinds.collect();
    assert!(kinds.iter().all(|&count| count > 20) && kinds.iter().sum::<usize>() == log.len(), "{kinds:?}");
    assert_eq!(arrived.len() + count(Effect::Lost), 3_000);
    assert_eq!(arrived.iter().filter(|r| r.framing_error).count(), count(Effect::FramingError));
}

#[test]
fn an_echo_comes_back_after_its_delay() {
    let mut line = line(Script(Vec::new(), 0), EVEN, &[]);
    line.impairments().lock().set_echo(Some(Echo { delay: 20_000 * US, by: Echoer::Line }));
    for (start, word) in [(1_000 * US, 0x107), (1_550 * US, 0x03)] {
        line.advance(start);
        line.send(Sent { start, word, format: EVEN });
    }
    // 10.5 bits of 50 µs after their beginnings, and the delay.
    assert_eq!(plain(&play(&mut line)), [(20_525, 0x107), (21_075, 0x03)]);
    assert_eq!(line.impairments().lock().characters(), 0);
}

#[test]
fn an_echo_waits_for_what_comes_in_and_what_comes_in_for_it() {
    let script = Script(vec![heard(1_900 * US, 0x31), heard(2_400 * US, 0x32)], 0);
    let mut line = line(script, NONE, &[]);
    line.impairments().lock().set_echo(Some(Echo { delay: 0, by: Echoer::Line }));
    line.send(Sent { start: 1_500 * US, word: 0x41, format: NONE });
    // The echo would arrive at 1975 µs, within the second.
    assert_eq!(plain(&play(&mut line)), [(900, 0x31), (1_400, 0x41), (1_900, 0x32)]);
}

#[test]
fn a_terminal_echoes_line_ends_and_control_characters_its_own_way() {
    let mut line = line(Script(Vec::new(), 0), NONE, &[]);
    line.impairments().lock().set_echo(Some(Echo { delay: 0, by: Echoer::Terminal }));
    for (n, byte) in (0..).zip(*b"a\r\n\x1b\x7f\t") {
        let start = n * 500 * US;
        line.advance(start);
        line.send(Sent { start, word: u16::from(byte), format: NONE });
    }
    let bytes: Vec<u8> = play(&mut line).iter().map(|received| received.word as u8).collect();
    assert_eq!(bytes, b"a\r\n\r\n^[^?\t");
}

#[test]
fn nothing_is_heard_by_a_receiver_that_is_off() {
    let mut line = line(back_to_back(&[1], NONE), NONE, &[(Effect::Paused(5_000 * US), one(0))]);
    line.advance(1_000 * US);
    line.set_receiver(1_100 * US, None);
    assert_eq!(line.take_received(), None);
    assert_eq!(plain(&play(&mut line)), []);
}

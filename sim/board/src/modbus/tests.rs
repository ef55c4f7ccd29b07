//! The line against a USART played by hand; instants are worked out here from bits alone.

use clino_segment::log::{Fate, LineEvent, Talker};
use clino_segment::wire::{Format, Received, Sent, Wire};
use clino_sim::node::Ns;

use super::*;

/// 8E1 at 20 kbit/s: 50 µs per bit, 550 µs per character, and more than 19200, so that a frame ends after 1.75 ms.
const FRAMING: Framing = Framing { baud: 20_000, parity: Parity::Even, stop_bits: 1 };
const FORMAT: Format = Format { bit_ps: 50_000_000, data_bits: 9, stop_halves: 2 };
const CHARACTER: Ns = 550_000;
const MS: Ns = 1_000_000;

fn line() -> (ModbusLine, SharedMaster) {
    let mut line = ModbusLine::new("master", FRAMING);
    line.set_receiver(0, Some(FORMAT));
    let master = line.master();
    (line, master)
}

/// Lets time pass event by event, and returns what the gateway hears.
fn play(line: &mut ModbusLine, until: Ns) -> Vec<Received> {
    let mut heard = Vec::new();
    while let Some(next) = line.next_event().filter(|next| *next <= until) {
        line.advance(next);
        heard.extend(std::iter::from_fn(|| line.take_received()));
    }
    line.advance(until);
    heard
}

/// The gateway sends these words back to back at `start`; returns the end of the last stop bit.
fn gateway(line: &mut ModbusLine, start: Ns, words: &[u16]) -> Ns {
    let mut at = start;
    for &word in words {
        play(line, at);
        line.send(Sent { start: at, word, format: FORMAT });
        at += CHARACTER;
    }
    play(line, at);
    at
}

#[test]
fn a_request_goes_out_back_to_back_at_its_time_with_parity() {
    let (mut line, master) = line();
    master.lock().send(MS, &[0x07, 0x03]);
    let heard = play(&mut line, 10 * MS);
    // Stop bit centres 10.5 bits after the start.
    let centres = [MS + 525_000, MS + CHARACTER + 525_000];
    assert_eq!(heard.iter().map(|received| received.at).collect::<Vec<_>>(), centres);
    assert_eq!(heard.iter().map(|received| received.word).collect::<Vec<_>>(), [0x107, 0x003]);
    assert!(heard.iter().all(|received| !received.framing_error && !received.noise));
    let log = line.log();
    let drives: Vec<_> = log.lock().unwrap().events.iter().filter_map(drive).collect();
    assert_eq!(drives, [(MS, true), (MS + 2 * CHARACTER, false)]);
}

fn drive(event: &LineEvent) -> Option<(Ns, bool)> {
    if let LineEvent::Drive { at, on, .. } = *event { Some((at, on)) } else { None }
}

#[test]
fn a_gap_within_a_request_is_kept() {
    let (mut line, master) = line();
    master.lock().send(MS, &[1]);
    master.lock().send(3 * MS, &[2]);
    let heard = play(&mut line, 10 * MS);
    assert_eq!(heard.iter().map(|received| received.at).collect::<Vec<_>>(), [1_525_000, 3_525_000]);
}

#[test]
fn an_answer_has_its_times_and_those_of_de() {
    let (mut line, master) = line();
    play(&mut line, 5 * MS);
    line.drive_enable(5 * MS, true);
    let ended = gateway(&mut line, 5 * MS + 10_000, &[0x107, 0x003]);
    line.drive_enable(ended + 2_000, false);
    play(&mut line, ended + 1_749_000);
    assert_eq!(master.lock().take_answers(), [], "the silence is not over");
    play(&mut line, ended + 1_751_000);
    let answer = Answer {
        began: 5 * MS + 10_000,
        ended,
        bytes: vec![7, 3],
        spoilt: 0,
        de_high: Some(5 * MS),
        de_low: Some(ended + 2_000),
    };
    assert_eq!(master.lock().take_answers(), [answer]);
    assert_eq!(master.lock().take_bytes(), [7, 3]);
}

#[test]
fn what_is_sent_with_de_low_is_lost() {
    let (mut line, master) = line();
    let ended = gateway(&mut line, MS, &[0x107]);
    play(&mut line, ended + 10 * MS);
    assert_eq!(master.lock().take_answers(), []);
    let log = line.log();
    let undriven = |event: &LineEvent| matches!(event, LineEvent::Char { fate: Fate::Undriven, .. });
    assert!(log.lock().unwrap().events.iter().any(undriven));
}

#[test]
fn a_wrong_parity_bit_is_noticed_and_the_byte_handed_over() {
    let (mut line, master) = line();
    line.drive_enable(MS, true);
    let ended = gateway(&mut line, MS, &[0x007, 0x107]);
    line.drive_enable(ended, false);
    play(&mut line, ended + 5 * MS);
    let answers = master.lock().take_answers();
    assert_eq!((answers[0].bytes.as_slice(), answers[0].spoilt), (&[7, 7][..], 1));
    assert_eq!(master.lock().traffic(), Traffic { sent: 0, heard: 2, spoilt: 1 });
}

#[test]
fn two_talkers_spoil_each_other_and_are_logged() {
    let (mut line, master) = line();
    master.lock().send(MS, &[0x55, 0x55]);
    play(&mut line, MS + 100_000);
    line.drive_enable(MS + 100_000, true);
    let ended = gateway(&mut line, MS + 100_000, &[0x1aa]);
    line.drive_enable(ended, false);
    play(&mut line, 10 * MS);
    let log = line.log();
    let log = log.lock().unwrap();
    let contention = log.events.iter().find_map(|event| match event {
        LineEvent::Contention { from, until, who, fought } => Some((*from, *until, who.clone(), *fought)),
        _ => None,
    });
    let both = vec![Talker::Gateway, Talker::Node(0)];
    assert_eq!(contention, Some((MS + 100_000, ended, both, true)));
    assert_eq!(log.name(Talker::Node(0)), "master");
}

#[test]
fn a_master_at_another_bit_rate_is_not_understood() {
    let (mut line, master) = line();
    master.lock().set_framing(Framing { baud: 9_600, ..FRAMING });
    master.lock().send(MS, &[0x01, 0x04, 0x00]);
    let heard = play(&mut line, 20 * MS);
    assert!(!heard.is_empty());
    let right =
        |received: &Received| !received.framing_error && [0x101, 0x104, 0x000].contains(&received.word);
    assert!(!heard.iter().all(right), "{heard:?}");
    // And back again.
    master.lock().set_framing(FRAMING);
    master.lock().send(30 * MS, &[0x01]);
    assert_eq!(play(&mut line, 40 * MS).iter().map(|received| received.word).collect::<Vec<_>>(), [0x101]);
}

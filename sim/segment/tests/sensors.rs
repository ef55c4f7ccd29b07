//! Real simulated sensors on a pair: duplicate addresses, talking over each other, power cut at any byte.

use std::sync::{Arc, Mutex};

use clino_segment::chance::Chance;
use clino_segment::log::LineEvent;
use clino_segment::wire::{Format, Sent, Wire as _};
use clino_segment::{Faults, Noise, Segment, SegmentSettings, Station};
use clino_sim::motion::{DEGREE, Motion};
use clino_sim::node::{Node, Ns};
use clino_sim::{isu, latency::Latency, t7};

const MS: Ns = 1_000_000;
const SECOND: Ns = 1_000 * MS;
const T7_BIT_PS: u64 = 8_680_555;
const ISU_BIT_PS: u64 = 104_166_666;

/// Two T7s with the same address, both as fast as each other.
const ANGLE_A: i64 = 10 * DEGREE;
const ANGLE_B: i64 = -77_777 * DEGREE / 1_000;
const ANSWER_A: [u8; 8] = [0x05, 0x06, 0x83, 0x00, 0x00, 0x27, 0x10, 0x3B];

fn t7(serial: u32, angle: i64) -> Arc<Mutex<t7::T7>> {
    let identity = t7::Identity { serial, ..t7::Identity::default() };
    let settings = t7::StoredSettings { address: 5, ..t7::StoredSettings::default() };
    let motion = std::array::from_fn(|_| Motion::Constant(angle));
    let options = t7::Options { motion, ..t7::Options::default() };
    Arc::new(Mutex::new(t7::T7::new(identity, settings, options).unwrap()))
}

fn isu(address: u8, angle: i64) -> isu::Isu {
    let content = isu::Content { address, ..isu::Content::default() };
    let eeprom = isu::Eeprom::factory(content, isu::ChecksumScope::default(), 1);
    isu::Isu::new(eeprom, isu::Options { motion: Motion::Constant(angle), ..isu::Options::default() })
}

fn station(node: impl Node + 'static, unplugged: Vec<(Ns, Ns)>) -> Station {
    let faults = Faults { unplugged, ..Faults::default() };
    Station { name: String::new(), node: Box::new(node), faults }
}

/// A pair with a listening master at `bit_ps`.
fn pair(stations: Vec<Station>, bit_ps: u64) -> Segment {
    let settings = SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() };
    let mut segment = Segment::new(settings, stations);
    segment.set_receiver(0, Some(format(bit_ps)));
    segment
}

fn format(bit_ps: u64) -> Format {
    Format { bit_ps, data_bits: 8, stop_halves: 2 }
}

/// Sends from `start` on, and returns what is heard within the second after it, framing errors included.
fn ask(segment: &mut Segment, start: Ns, bytes: &[u8], bit_ps: u64) -> Vec<u8> {
    play(segment, start);
    segment.drive_enable(start, true);
    let mut end = start;
    for &word in bytes {
        play(segment, end);
        segment.send(Sent { start: end, word: u16::from(word), format: format(bit_ps) });
        end += (10 * bit_ps).div_ceil(1_000);
    }
    play(segment, end);
    segment.drive_enable(end, false);
    play(segment, start + SECOND);
    std::iter::from_fn(|| segment.take_received()).map(|received| received.word as u8).collect()
}

fn play(segment: &mut Segment, until: Ns) {
    while let Some(next) = segment.next_event().filter(|&next| next <= until) {
        segment.advance(next);
    }
    segment.advance(until);
}

fn fights(segment: &Segment) -> usize {
    let log = segment.log();
    let log = log.lock().unwrap();
    log.events.iter().filter(|event| matches!(event, LineEvent::Contention { fought: true, .. })).count()
}

#[test]
fn two_t7s_at_one_address_spoil_the_angle_but_not_what_they_agree_on() {
    let mut alone = pair(vec![station(t7(1, ANGLE_A), vec![])], T7_BIT_PS);
    assert_eq!(ask(&mut alone, 0, &[0x05, 0x01, 0x83], T7_BIT_PS), ANSWER_A);
    let both = [(1, ANGLE_A), (2, ANGLE_B)].map(|(serial, angle)| station(t7(serial, angle), vec![]));
    let mut both = pair(both.into(), T7_BIT_PS);
    let heard = ask(&mut both, 0, &[0x05, 0x01, 0x83], T7_BIT_PS);
    assert_eq!(heard[..3], ANSWER_A[..3], "both say the same");
    assert_ne!(heard.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)), 0, "{heard:02X?}");
    assert_eq!(fights(&both), 1);
}

#[test]
fn set_address_by_serial_number_parts_two_t7s_at_one_address() {
    let (a, b) = (t7(1, ANGLE_A), t7(2, ANGLE_B));
    let mut both = pair(vec![station(Arc::clone(&a), vec![]), station(Arc::clone(&b), vec![])], T7_BIT_PS);
    let mut command = vec![0x05, 0x08, 0x91, 4, 0, 0, 0, 2, 6];
    command.push(command.iter().fold(0, |sum: u8, byte| sum.wrapping_sub(*byte)));
    assert_eq!(ask(&mut both, 0, &command, T7_BIT_PS), [0x05, 0x03, 0x91, 0x00, 0x67], "only one answers");
    let addresses = [a, b].map(|t7| t7.lock().unwrap().settings().address);
    assert_eq!(addresses, [5, 6]);
    assert_eq!(ask(&mut both, 2 * SECOND, &[0x05, 0x01, 0x83], T7_BIT_PS), ANSWER_A);
    assert_eq!(ask(&mut both, 4 * SECOND, &[0x06, 0x01, 0x83], T7_BIT_PS).len(), 8);
    assert_eq!(fights(&both), 0);
}

#[test]
fn all_isus_talk_over_each_other_at_address_0_and_each_alone_at_its_own() {
    let stations = vec![station(isu(1, 90 * DEGREE), vec![]), station(isu(2, 200 * DEGREE), vec![])];
    let mut both = pair(stations, ISU_BIT_PS);
    let heard = ask(&mut both, 0, &[0x03, 0x04, 0x58, 0x02, 0x5E], ISU_BIT_PS);
    assert_eq!(heard[..3], [0x04, 0x05, 0x58]);
    assert_eq!(fights(&both), 1);
    let answer = ask(&mut both, 2 * SECOND, &[0x03, 0x14, 0x58, 0x02, 0x6E], ISU_BIT_PS);
    assert_eq!(answer, [0x04, 0x15, 0x58, 0x40, 0x00, 0xAD]);
    assert_eq!(fights(&both), 1);
}

#[test]
fn a_late_t7_talks_into_the_next_exchange() {
    let (late, punctual) = (t7(1, ANGLE_A), {
        let identity = t7::Identity::default();
        let settings = t7::StoredSettings { address: 6, ..t7::StoredSettings::default() };
        let options = t7::Options { get_latency: Latency::fixed(MS), ..t7::Options::default() };
        t7::T7::new(identity, settings, options).unwrap()
    });
    late.lock().unwrap().faults.next = Some(clino_sim::fault::AnswerFault::Late(8 * MS));
    let mut segment = pair(vec![station(late, vec![]), station(punctual, vec![])], T7_BIT_PS);
    // The first answer comes 10 ms after its command, the second 1 ms after one that ends 9.2 ms after it.
    let end = (30 * T7_BIT_PS).div_ceil(1_000);
    segment.drive_enable(0, true);
    for (n, word) in [0x05, 0x01, 0x83].into_iter().enumerate() {
        let start = n as u64 * end / 3;
        play(&mut segment, start);
        segment.send(Sent { start, word, format: format(T7_BIT_PS) });
    }
    play(&mut segment, end);
    segment.drive_enable(end, false);
    let heard = ask(&mut segment, end + 9_200_000, &[0x06, 0x01, 0x83], T7_BIT_PS);
    assert_eq!(fights(&segment), 1);
    assert_ne!(heard, [ANSWER_A, [0x06, 0x06, 0x83, 0, 0, 0, 0, 0x71]].concat());
}

/// The power of the only sensor goes at every character of a command and of its answer in turn.
#[test]
fn a_power_cut_at_any_character_ends_the_answer_there_and_the_next_exchange_is_whole() {
    let character = (10 * T7_BIT_PS).div_ceil(1_000);
    let mut heard = Vec::new();
    for place in 0..40 {
        let cut = place * character + character / 2;
        let node = station(t7(1, ANGLE_A), vec![(cut, cut + 100 * MS)]);
        let mut segment = pair(vec![node], T7_BIT_PS);
        let answer = ask(&mut segment, 0, &[0x05, 0x01, 0x83], T7_BIT_PS);
        // Released in mid character, the line idles high; the rest of that character reads as ones.
        let whole = answer.iter().zip(ANSWER_A).take_while(|(heard, said)| **heard == *said).count();
        assert!(answer.len() <= whole + 1, "cut at {cut}: {answer:02X?}");
        heard.push(whole);
        assert_eq!(ask(&mut segment, 2 * SECOND, &[0x05, 0x01, 0x83], T7_BIT_PS), ANSWER_A);
    }
    let lengths: std::collections::BTreeSet<usize> = heard.into_iter().collect();
    assert_eq!(lengths.into_iter().collect::<Vec<_>>(), (0..=8).collect::<Vec<_>>());
}

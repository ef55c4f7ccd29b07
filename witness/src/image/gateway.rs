//! What the gateway says, at the console and at the Modbus port, and whether it is true.

use clino_sim::motion::Motion;
use clino_sim::node::Ns;
use serde_json::Value;

use super::hosts::Said;
use super::run::MS;

/// How old an angle may be when it arrives, over the age that comes with it: T7s (an answer and its latency), ISU (it
/// computes an angle every 533 ms, and an answer), PWM (a cycle).
const HELD: [Ns; 6] = [5 * MS, 5 * MS, 5 * MS, 560 * MS, 40 * MS, 40 * MS];
/// How far off it may be, micro-degrees: half of 0.001°; half of 360°/65536; half of a step of the PWM output.
const OFF: [i64; 6] = [600, 600, 600, 3_500, 45_000, 45_000];
/// From when a line of the console is made to its first character on the wire, at most: the line before.
const LINE: Ns = 25 * MS;
/// A moving sensor is looked at every 20 µs: 47°/s turn it by 0.001° meanwhile.
const LOOK: usize = 20_000;
/// A full turn, micro-degrees.
const TURN: i64 = 360_000_000;

/// A line of the console: when its first character was complete, and its text.
pub fn lines(said: &Said) -> Vec<(Ns, String)> {
    let mut lines = Vec::new();
    let mut line = (0, String::new());
    for (at, byte) in &said.heard {
        match byte {
            b'\n' => lines.push(std::mem::take(&mut line)),
            b'\r' => {}
            _ => {
                if line.1.is_empty() {
                    line.0 = *at;
                }
                line.1.push(char::from(*byte));
            }
        }
    }
    lines.push(line);
    lines
}

/// The JSON objects in the stream.
pub fn objects(said: &Said) -> Vec<(Ns, Value)> {
    let parsed = |(at, text): (Ns, String)| Some((at, serde_json::from_str(&text).ok()?));
    lines(said).into_iter().filter_map(parsed).collect()
}

/// Readings that were right, and those that were not.
#[derive(Debug, Default)]
pub struct Judged {
    /// Right ones of each slot.
    pub right: [u64; 6],
    /// When the first right one of each slot came.
    pub first: [Option<Ns>; 6],
    /// Wrong ones.
    pub wrong: Vec<String>,
}

impl Judged {
    fn judge(&mut self, slot: usize, angle: i64, latest: Ns, earliest: Ns, motion: &Motion) {
        let is_true = (earliest..=latest).step_by(LOOK).chain([latest]).any(|at| {
            let off = (motion.at(at) - angle).rem_euclid(TURN);
            off.min(TURN - off) <= OFF[slot]
        });
        if is_true {
            self.right[slot] += 1;
            self.first[slot].get_or_insert(latest);
        } else {
            self.wrong.push(format!("slot {slot}: {angle} µ° between {earliest} and {latest} ns"));
        }
    }
}

/// Judges every angle of the stream from `from` on.
pub fn judge_stream(said: &Said, motion: &[Motion; 6], from: Ns) -> Judged {
    let mut judged = Judged::default();
    for (at, object) in objects(said).into_iter().filter(|(at, _)| *at >= from) {
        let (Some(slot), Some(angle), Some(age)) =
            (object["slot"].as_u64(), object["angle_deg"].as_f64(), object["age_ms"].as_u64())
        else {
            continue;
        };
        let slot = slot as usize;
        let angle = (angle * 1_000_000.0).round() as i64;
        let latest = at.saturating_sub(age * MS);
        judged.judge(slot, angle, latest, latest.saturating_sub(HELD[slot] + LINE), &motion[slot]);
    }
    judged
}

/// MODBUS over Serial Line V1.02, section 6.2.2.
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    })
}

/// A request to address 1: reads `count` registers from `from` on.
pub fn request(from: u16, count: u16) -> Vec<u8> {
    let mut frame = vec![1, 4];
    frame.extend(from.to_be_bytes());
    frame.extend(count.to_be_bytes());
    frame.extend(crc(&frame).to_le_bytes());
    frame
}

/// Frames that the gateway sent, divided by silences.
pub fn frames(said: &Said) -> Vec<(Ns, Ns, Vec<u8>)> {
    /// Longer than a character at 19200 bit/s, shorter than the 3.5 that end a frame.
    const SILENCE: Ns = 1_200_000;
    let mut frames: Vec<(Ns, Ns, Vec<u8>)> = Vec::new();
    for (at, byte) in &said.heard {
        match frames.last_mut() {
            Some((_, end, bytes)) if *at < *end + SILENCE => {
                bytes.push(*byte);
                *end = *at;
            }
            _ => frames.push((*at, *at, vec![*byte])),
        }
    }
    frames
}

/// The registers of an answer, if it is one and its checksum is right.
pub fn registers(frame: &[u8]) -> Option<Vec<u16>> {
    let [1, 4, count, data @ ..] = frame else { return None };
    let data = data.get(..usize::from(*count)).filter(|_| crc(frame) == 0)?;
    Some(data.chunks(2).map(|word| u16::from_be_bytes([word[0], word[1]])).collect())
}

/// Judges an answer to a request for the 64 registers of angles and the 32 of ages, which began at `begun`.
pub fn judge_registers(judged: &mut Judged, begun: Ns, words: &[u16], motion: &[Motion; 6]) {
    for slot in 0..6 {
        let angle = i64::from((u32::from(words[2 * slot]) << 16 | u32::from(words[2 * slot + 1])) as i32);
        let age = u64::from(words[64 + slot]);
        if angle == i64::from(i32::MIN) {
            judged.wrong.push(format!("slot {slot}: none at {begun} ns"));
            continue;
        }
        // All registers are of the instant before the answer.
        let latest = begun.saturating_sub(age * MS);
        judged.judge(slot, angle * 1_000, latest, latest.saturating_sub(HELD[slot] + 3 * MS), &motion[slot]);
    }
}

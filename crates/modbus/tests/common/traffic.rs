//! Characters and silences at 19200 bit/s, 8E1, and what has to be answered.
//!
//! A second receiver, written from MODBUS over Serial Line V1.02 section 2.5.1: it cuts what was heard into frames by its
//! silences and computes checksums in another way.

use clino_codec::character::LineErrors;
use clino_modbus::Host;

use super::{ADDRESS, Bench, crc, opened};

/// A character at 19200 bit/s, 8E1: 573 µs.
pub const CHARACTER: u64 = 573;
/// Longest silence that surely belongs into a frame, and shortest that surely does not: 1.5 characters, 2 characters.
pub const WITHIN: u64 = 859;
pub const BROKEN: u64 = 1_146;
/// Shortest silence that surely ends a frame.
pub const BETWEEN: u64 = 2_006;

/// A character and the silence before it, µs.
#[derive(Clone, Copy, Debug)]
pub struct Heard {
    pub silence: u64,
    pub byte: u8,
    pub errors: LineErrors,
}

/// Whether what was heard between two silences is a frame that has to be answered, by address and checksum.
pub fn is_for_us(frame: &[Heard]) -> bool {
    let bytes: Vec<u8> = frame.iter().map(|heard| heard.byte).collect();
    let spoilt = |heard: &Heard| {
        [LineErrors::FRAMING, LineErrors::PARITY, LineErrors::OVERRUN]
            .iter()
            .any(|&e| heard.errors.contains(e))
    };
    (4..=256).contains(&bytes.len())
        && !frame.iter().any(spoilt)
        && !frame[1..].iter().any(|heard| heard.silence > WITHIN)
        && crc(&bytes[..bytes.len() - 2]).to_le_bytes() == bytes[bytes.len() - 2..]
        && bytes[0] == ADDRESS
}

/// Plays traffic to a server; what was answered, by the number of the frame that it followed.
pub fn play(traffic: &[Heard], bench: &mut Bench<impl Host>) -> Vec<(usize, Vec<u8>)> {
    let mut answers = Vec::new();
    let mut frame = 0;
    for (index, heard) in traffic.iter().enumerate() {
        if index > 0 && heard.silence > BETWEEN {
            // The end of the silence, with time for any answer, which a master leaves, too.
            let at = bench.now;
            if let Some(answer) = bench.pause(heard.silence) {
                answers.push((frame, answer));
            }
            bench.now = bench.now.max(at + heard.silence);
            frame += 1;
        } else {
            bench.now += heard.silence;
        }
        bench.character(heard.byte, heard.errors);
    }
    if let Some(answer) = bench.pause(100_000) {
        answers.push((frame, answer));
    }
    answers
}

pub fn frames(traffic: &[Heard]) -> Vec<Vec<Heard>> {
    let mut frames: Vec<Vec<Heard>> = Vec::new();
    for &heard in traffic {
        match frames.last_mut() {
            Some(last) if heard.silence <= BETWEEN => last.push(heard),
            _ => frames.push(vec![heard]),
        }
    }
    frames
}

/// The answer to a request is a right one, as far as its frame goes.
pub fn check(answer: &[u8], request: &[Heard]) {
    let bytes = opened(answer);
    assert!(answer.len() <= 256);
    assert_eq!(bytes[0], request[0].byte);
    assert_eq!(bytes[1] & 0x7F, request[1].byte & 0x7F);
    if bytes[1] != request[1].byte || bytes.len() == 3 {
        assert!(matches!(bytes[2], 1..=4 | 6), "exception {}", bytes[2]);
    }
}

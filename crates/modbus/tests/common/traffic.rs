//! Characters and silences at 19200 bit/s, 8E1, and what has to be answered.
//!
//! A second receiver, written from MODBUS over Serial Line V1.02 section 2.5.1: it cuts what was heard into frames by its
//! silences and computes checksums in another way.

use clino_codec::character::LineErrors;
use clino_modbus::Host;
use clino_modbus::settings::Pauses;

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

/// Whether what was heard between two silences is a request that has to be answered: by its characters and pauses, its
/// address and checksum, and as long as MODBUS Application Protocol V1.1b3, section 6, says that it is.
pub fn is_for_us(frame: &[Heard], pauses: Pauses) -> bool {
    let bytes: Vec<u8> = frame.iter().map(|heard| heard.byte).collect();
    // Zeros behind a right checksum may be anything.
    let zeros_from = |length: &usize| bytes[*length..].iter().all(|&byte| byte == 0);
    let is_right = |length: &usize| {
        let (bytes, found) = bytes[..*length].split_at(length - 2);
        crc(bytes).to_le_bytes() == found
    };
    let Some(end) = (4..=bytes.len().min(256)).filter(zeros_from).find(is_right) else { return false };
    let has = |part: &[Heard], error| part.iter().any(|heard: &Heard| heard.errors.contains(error));
    let longest = if pauses == Pauses::Strict { WITHIN } else { BETWEEN };
    if has(&frame[..end], LineErrors::FRAMING)
        || has(&frame[..end], LineErrors::PARITY)
        || has(frame, LineErrors::OVERRUN)
        || frame[1..].iter().any(|heard| heard.silence > longest)
        || bytes[0] != ADDRESS
        || bytes[1] >= 0x80
    {
        return false;
    }
    let behind = |length: usize| (length <= bytes.len() && zeros_from(&length)).then(|| bytes.len() - length);
    let (request, writes, answer) = match bytes[1] {
        3 | 4 => (8, false, Some(5 + usize::from(bytes[2])).filter(|length| length % 2 == 1 && *length > 5)),
        6 => (8, true, None),
        8 if bytes[2..4] == [0, 0] => {
            let length = (8..=bytes.len()).step_by(2).find(zeros_from).unwrap_or(usize::MAX);
            (length, false, None)
        }
        8 => (8, matches!(bytes[2..4], [0, 1 | 10]), None),
        16 => (bytes.get(6).map_or(usize::MAX, |&count| 9 + usize::from(count)), true, Some(8)),
        43 => (7, false, (bytes.len() >= 10).then_some(bytes.len())),
        _ => return true,
    };
    match (behind(request), answer.and_then(behind)) {
        (Some(zeros), _) => zeros == 0 || !writes,
        // The answer to a request: ours that has come back, or another server's.
        (None, Some(_)) => false,
        // Shorter or longer than it says: exception 3.
        (None, None) => true,
    }
}

/// Whether a frame may be taken for the echo of an answer: it asks for what was asked for before, and its answer may
/// have been the same as the request.
pub fn may_be_echo(frame: &[Heard], before: &[Vec<Heard>]) -> bool {
    let bytes = |frame: &[Heard]| -> Vec<u8> { frame.iter().map(|heard| heard.byte).collect() };
    let trimmed = |mut bytes: Vec<u8>| {
        bytes.truncate(bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1));
        bytes
    };
    let asked = trimmed(bytes(frame));
    matches!(asked.get(1), Some(6 | 8)) && before.iter().any(|frame| trimmed(bytes(frame)) == asked)
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

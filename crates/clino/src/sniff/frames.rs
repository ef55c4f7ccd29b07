//! Bytes of a pair, from both sides, to frames.
//!
//! Nothing in a byte says who sent it. A frame says its length, and by its check whether it is one; what decodes as a command only
//! is one, likewise an answer. A T7's Set commands and their answers can look alike: then the one that follows a command to the
//! same address with the same code is its answer.
//!
//! What is no frame is told as a whole, up to the next frame or pause.

use crate::bad::Bad;
use crate::sensors::Kind;
use crate::{isu, t7};

/// A byte, and when it was on the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped {
    pub at_us: u64,
    pub byte: u8,
    /// It had no stop bit.
    pub is_flawed: bool,
}

/// What was said.
#[derive(Debug)]
pub enum What {
    /// By the master; the frame as JSON.
    Command { json: String },
    /// By a sensor; the frame as JSON, and from the command's last byte to its first, if that was heard.
    Answer { json: String, after_us: Option<u64> },
    /// By either.
    Bad { bad: Bad },
    /// A command got no answer before the next one.
    Unanswered,
}

/// What was said, when, and the bytes of it.
#[derive(Debug)]
pub struct Item {
    pub at_us: u64,
    pub bytes: Vec<u8>,
    pub what: What,
}

/// The command that waits for its answer.
struct Open {
    at_us: u64,
    /// When its last byte ended.
    end_us: u64,
    bytes: Vec<u8>,
}

/// Takes bytes, gives what was said.
pub struct Frames {
    kind: Kind,
    gap_us: u64,
    character_us: u64,
    heard: Vec<Stamped>,
    /// Bytes that begin no frame.
    junk: Vec<Stamped>,
    open: Option<Open>,
}

/// Highest address of a T7 that is a device's, and the two beyond.
const T7_ADDRESSES: [std::ops::RangeInclusive<u8>; 2] = [1..=100, 126..=127];
/// Longest frame of a T7 behind its length byte: 32 bytes and a checksum, rounded up.
const T7_LONGEST: u8 = 40;
/// Lowest command code of a T7.
const T7_COMMANDS: u8 = 0x80;
/// Get All Angles, whose answer has the wrong length in the guide's example: this one, where 10H is meant.
const GET_ALL_ANGLES: u8 = 0x80;
const QUIRK_LENGTH: u8 = 0x0A;
const QUIRK_SIZE: usize = 18;
/// What a length byte does not count: address and itself (T7), itself and the checksum (ISU).
const AROUND: usize = 2;
/// Shortest frame of both.
const SHORTEST: usize = 3;

impl Frames {
    /// Bytes further apart than `gap_us`, from start to start, are not of one frame.
    pub fn new(kind: Kind, gap_us: u64, character_us: u64) -> Self {
        Self { kind, gap_us, character_us, heard: Vec::new(), junk: Vec::new(), open: None }
    }

    /// The next byte.
    pub fn take(&mut self, character: Stamped, items: &mut Vec<Item>) {
        self.pause(character.at_us, items);
        self.heard.push(character);
        self.settle(false, items);
    }

    /// Time has passed: what is not whole by now never will be.
    pub fn pause(&mut self, now_us: u64, items: &mut Vec<Item>) {
        let last = self.heard.last().or(self.junk.last()).map(|last| last.at_us);
        if last.is_some_and(|last| now_us.saturating_sub(last) > self.gap_us) {
            self.settle(true, items);
            self.tell_junk(items);
        }
    }

    /// Nothing more comes.
    pub fn end(&mut self, items: &mut Vec<Item>) {
        self.settle(true, items);
        self.tell_junk(items);
    }

    /// Takes frames from the front. If nothing more comes, what is left is junk.
    fn settle(&mut self, is_over: bool, items: &mut Vec<Item>) {
        while !self.heard.is_empty() {
            match self.size() {
                Size::Of(size) if size <= self.heard.len() => {
                    let frame: Vec<Stamped> = self.heard.drain(..size).collect();
                    self.frame(frame, items);
                }
                Size::Of(_) | Size::Unknown if !is_over => return,
                Size::Of(_) | Size::Unknown | Size::None => self.junk.push(self.heard.remove(0)),
            }
        }
    }

    /// How long the frame is that begins here.
    fn size(&self) -> Size {
        let byte = |place: usize| self.heard.get(place).map(|character| character.byte);
        let Some(first) = byte(0) else { return Size::Unknown };
        match self.kind {
            Kind::T7 => {
                if !T7_ADDRESSES.iter().any(|range| range.contains(&first)) {
                    return Size::None;
                }
                let (Some(length), Some(code)) = (byte(1), byte(2)) else {
                    // A length that is none is no reason to wait.
                    let is_length = byte(1).is_none_or(|length| (1..=T7_LONGEST).contains(&length));
                    return if is_length { Size::Unknown } else { Size::None };
                };
                if !(1..=T7_LONGEST).contains(&length) || code < T7_COMMANDS {
                    return Size::None;
                }
                if (length, code) == (QUIRK_LENGTH, GET_ALL_ANGLES) {
                    return Size::Of(QUIRK_SIZE);
                }
                Size::Of(usize::from(length) + AROUND)
            }
            Kind::Isu => match usize::from(first) + AROUND {
                size if size < SHORTEST => Size::None,
                size => Size::Of(size),
            },
        }
    }

    fn frame(&mut self, frame: Vec<Stamped>, items: &mut Vec<Item>) {
        let bytes: Vec<u8> = frame.iter().map(|character| character.byte).collect();
        let (Some(first), Some(last)) = (frame.first(), frame.last()) else { return };
        let (at_us, end_us) = (first.at_us, last.at_us + self.character_us);
        let (command, answer) = match self.kind {
            Kind::T7 => (t7::command_json(&bytes), t7::answer_json(&bytes)),
            Kind::Isu => (isu::command_json(&bytes), isu::answer_json(&bytes)),
        };
        let is_flawed = frame.iter().any(|character| character.is_flawed);
        if is_flawed || (command.is_err() && answer.is_err()) {
            // One byte on there may be a frame: only what has a wrong check is taken for a whole one.
            let bad = match answer {
                Err(bad) => bad,
                Ok(_) => Bad::new("line_errors", "characters have no stop bit"),
            };
            if bad.kind() == "checksum" || is_flawed {
                self.tell_junk(items);
                items.push(Item { at_us, bytes, what: What::Bad { bad } });
            } else {
                self.junk.extend(frame.first());
                let rest = frame.get(1..).unwrap_or_default().to_vec();
                self.heard.splice(0..0, rest);
            }
            return;
        }
        self.tell_junk(items);
        match (command, answer) {
            (Ok(json), Err(_)) => self.command(at_us, end_us, bytes, json, items),
            (Err(_), Ok(json)) => self.answer(at_us, bytes, json, items),
            (Ok(command), Ok(answer)) if self.is_awaited(&bytes) => {
                let _ = command;
                self.answer(at_us, bytes, answer, items);
            }
            (Ok(json), Ok(_)) => self.command(at_us, end_us, bytes, json, items),
            (Err(_), Err(_)) => {}
        }
    }

    fn command(&mut self, at_us: u64, end_us: u64, bytes: Vec<u8>, json: String, items: &mut Vec<Item>) {
        self.unanswered(items);
        self.open = Some(Open { at_us, end_us, bytes: bytes.clone() });
        items.push(Item { at_us, bytes, what: What::Command { json } });
    }

    fn answer(&mut self, at_us: u64, bytes: Vec<u8>, json: String, items: &mut Vec<Item>) {
        let is_for_all = self.open.as_ref().is_some_and(|open| self.is_for_all(&open.bytes));
        let after_us = self.open.as_ref().map(|open| at_us.saturating_sub(open.end_us));
        if !is_for_all {
            self.open = None;
        }
        items.push(Item { at_us, bytes, what: What::Answer { json, after_us } });
    }

    /// Whether a T7's frame has address and code of the command that waits.
    fn is_awaited(&self, bytes: &[u8]) -> bool {
        let of = |bytes: &[u8]| (bytes.first().copied(), bytes.get(2).copied());
        self.open.as_ref().is_some_and(|open| of(&open.bytes) == of(bytes))
    }

    /// Whether several may answer, or none.
    fn is_for_all(&self, bytes: &[u8]) -> bool {
        match self.kind {
            Kind::T7 => bytes.first() == Some(&126),
            Kind::Isu => bytes.get(1).is_some_and(|head| head >> 4 == 0),
        }
    }

    fn unanswered(&mut self, items: &mut Vec<Item>) {
        let Some(Open { at_us, bytes, .. }) = self.open.take() else { return };
        if !self.is_for_all(&bytes) {
            items.push(Item { at_us, bytes, what: What::Unanswered });
        }
    }

    fn tell_junk(&mut self, items: &mut Vec<Item>) {
        let Some(first) = self.junk.first() else { return };
        let (at_us, flawed) = (first.at_us, self.junk.iter().filter(|character| character.is_flawed).count());
        let bytes: Vec<u8> = self.junk.drain(..).map(|character| character.byte).collect();
        let bad = if flawed > 0 {
            Bad::new("line_errors", "characters have no stop bit").with("flawed", flawed)
        } else {
            Bad::new("no_frame", "bytes that are no frame, or not a whole one")
        };
        items.push(Item { at_us, bytes, what: What::Bad { bad } });
    }
}

/// Of the frame that begins.
enum Size {
    Of(usize),
    /// More has to come.
    Unknown,
    /// No frame begins so.
    None,
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASK: &[u8] = &[0x05, 0x01, 0x83];
    const SAYS: &[u8] = &[0x05, 0x06, 0x83, 0x00, 0x00, 0x30, 0x39, 0x09];

    /// What is told of these pieces, each a hundred milliseconds after the one before.
    fn told(kind: Kind, pieces: &[&[u8]]) -> Vec<String> {
        let mut frames = Frames::new(kind, 1_000, 87);
        let mut items = Vec::new();
        for (piece, start) in pieces.iter().zip((0..).step_by(100_000)) {
            for (byte, at_us) in piece.iter().zip((start..).step_by(87)) {
                frames.take(Stamped { at_us, byte: *byte, is_flawed: false }, &mut items);
            }
        }
        frames.end(&mut items);
        let word = |item: &Item| match &item.what {
            What::Command { .. } => format!("command {}", item.bytes.len()),
            What::Answer { .. } => format!("answer {}", item.bytes.len()),
            What::Bad { bad } => format!("{} {}", bad.kind(), item.bytes.len()),
            What::Unanswered => "unanswered".to_owned(),
        };
        items.iter().map(word).collect()
    }

    #[test]
    fn commands_and_answers_are_told_apart() {
        assert_eq!(
            told(Kind::T7, &[ASK, SAYS, ASK, SAYS]),
            ["command 3", "answer 8", "command 3", "answer 8"]
        );
        // Without a pause between.
        assert_eq!(told(Kind::T7, &[&[ASK, SAYS, ASK].concat()]), ["command 3", "answer 8", "command 3"]);
        // Set Angle Output Range to 1, and the status 1: the same bytes.
        let set = [0x05, 0x03, 0x8D, 0x01, 0x6A];
        let _ = set;
        let isu = [&[0x03, 0x34, 0x58, 0x02, 0x8E][..], &[0x04, 0x35, 0x58, 0x40, 0x00, 0xCD]];
        assert_eq!(told(Kind::Isu, &isu), ["command 5", "answer 6"]);
    }

    #[test]
    fn what_is_missing_or_wrong_is_told() {
        assert_eq!(told(Kind::T7, &[ASK, ASK, SAYS]), ["command 3", "unanswered", "command 3", "answer 8"]);
        assert_eq!(
            told(Kind::T7, &[ASK, &SAYS[..5], ASK, SAYS]),
            ["command 3", "no_frame 5", "unanswered", "command 3", "answer 8"]
        );
        let mut wrong = SAYS.to_vec();
        wrong[6] ^= 1;
        assert_eq!(
            told(Kind::T7, &[ASK, &wrong, ASK, SAYS]),
            ["command 3", "checksum 8", "unanswered", "command 3", "answer 8"]
        );
        assert_eq!(told(Kind::T7, &[&[0xFF, 0x00], ASK, SAYS]), ["no_frame 2", "command 3", "answer 8"]);
        // Junk without a pause before a frame.
        assert_eq!(
            told(Kind::T7, &[&[&[0xFF, 0x00][..], ASK].concat(), SAYS]),
            ["no_frame 2", "command 3", "answer 8"]
        );
    }
}

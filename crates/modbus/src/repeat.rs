//! Answers that were sent lately, to know them when they come back.
//!
//! A port hears itself late where a radio link or a store-and-forward server repeats what it hears. The answer to
//! function 06 is its request, and most of function 08's are theirs: one that comes back cannot be told from a master
//! that asks for the same thing again. Within [`ECHO_WINDOW`] of the answer, the rule is:
//!
//! | a frame that repeats an answer | |
//! |---|---|
//! | the first one | is the echo: dropped, not carried out, not answered |
//! | the next one | is the master's, which tries again: carried out and answered |
//! | one that repeats that answer | is dropped, twice as often as before |
//! | any, on a line that is known to be quiet | is the master's, [`IN_A_ROW`] times in a row; then the first line holds |
//!
//! A line is known to be quiet when one of the other answers went out, and in its window nothing came that a master does
//! not send: no answer, no damaged frame, no character while we send. The next such thing ends it.
//!
//! So an echo provokes nothing; where each answer comes back k times, a request is answered at most k times; where a quiet
//! line begins to repeat what it hears, a request is answered at most [`IN_A_ROW`] times more. A master whose answer was
//! lost is answered at its second try at the latest. The price: on a line that is not known to be quiet, a master that
//! sends the same function 06 twice within the window, as function 16 could, has to repeat the second one.
//!
//! Limits: [`PLACES`] answers within a window. On a line that is not known to be quiet, a request whose answer would have
//! no place is refused as busy: an answer without a place is not known when it comes back.

use clino_bus::{Duration, Instant};
use clino_gateway::Stamp;

use crate::request::{self, Form, is_padded};

/// From the end of an answer to the beginning of its echo: twice the half second of store-and-forward servers.
pub const ECHO_WINDOW: Duration = Duration::from_millis(1_000);

/// Answers that look like requests: one in 31 ms, before the line is known to be quiet.
const PLACES: usize = 32;

/// Repeats in a row that are the master's on a quiet line.
const IN_A_ROW: u8 = 8;

/// The beginning of an answer that is kept, beside its checksum: no two answers of 8 bytes have both in common, because the
/// checksum of the same four bytes and any two behind them is another for each two.
const HEAD: usize = 4;

/// Answers that were sent lately.
#[derive(Debug)]
pub struct Repeats {
    /// Those that look like requests.
    requests: [Sent; PLACES],
    /// The last one of the others.
    other: Sent,
    /// Values for the next answer.
    next_copies: u8,
    next_row: u8,
    line: Line,
}

/// Whether the line has an echo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Line {
    /// Unknown.
    Doubtful,
    /// If nothing happens until then, it is quiet.
    Probed(Instant),
    Quiet,
}

/// An answer. 16 bytes.
#[derive(Clone, Copy, Debug)]
struct Sent {
    head: [u8; HEAD],
    /// Its last two bytes: its checksum.
    tail: [u8; 2],
    /// Its length less one, so that the longest fits; [`NOTHING`](Sent::NOTHING) is one byte long, which no frame is.
    length_less_one: u8,
    /// A repeat that is whole until then is an echo,
    until: Stamp,
    /// if fewer than these have come.
    copies: u8,
    come: u8,
    /// Answers in a row, before it, to repeats that were taken for the master's.
    row: u8,
}

impl Repeats {
    pub const fn new() -> Repeats {
        Repeats {
            requests: [Sent::NOTHING; PLACES],
            other: Sent::NOTHING,
            next_copies: 1,
            next_row: 0,
            line: Line::Doubtful,
        }
    }

    /// Whether a request to read may be an answer with a zero behind it.
    pub fn knows(&self, request: &[u8]) -> bool {
        self.other.is(request)
    }

    /// Whether a frame that is whole now is one of our answers that has come back.
    pub fn is_echo(&mut self, frame: &[u8], now: Instant) -> bool {
        if matches!(self.line, Line::Probed(until) if now > until) {
            self.line = Line::Quiet;
        }
        (self.next_copies, self.next_row) = (1, 0);
        let quiet = self.line == Line::Quiet;
        let mut all = self.requests.iter_mut().chain([&mut self.other]);
        let Some(sent) = all.find(|sent| sent.is_recent(now) && sent.is(frame)) else { return false };
        if !request::is_its_answer(frame) {
            // No master asks for what we have answered to something else.
            return true;
        }
        if quiet && sent.row < IN_A_ROW {
            self.next_row = sent.row.saturating_add(1);
            return false;
        }
        if sent.come < sent.copies {
            sent.come = sent.come.saturating_add(1);
            return true;
        }
        self.next_copies = sent.copies.saturating_mul(2);
        false
    }

    /// Something was heard that no master has sent.
    pub fn doubt(&mut self) {
        self.line = Line::Doubtful;
    }

    /// Remembers an answer; `echo_by` is when its echo is whole at the latest.
    pub fn sent(&mut self, answer: &[u8], echo_by: Instant) {
        let copies = core::mem::replace(&mut self.next_copies, 1);
        let row = core::mem::replace(&mut self.next_row, 0);
        let sent = Sent { copies, row, ..Sent::new(answer, echo_by) };
        if request::form(answer) == Form::Answer {
            self.other = sent;
            if self.line == Line::Doubtful {
                self.line = Line::Probed(echo_by);
            }
        } else if let Some(place) = self.place(answer, echo_by) {
            *place = sent;
        }
    }

    /// Whether there is no place for an answer to be known when it comes back, and it might.
    pub fn is_full(&mut self, answer: &[u8], now: Instant) -> bool {
        self.line != Line::Quiet
            && self.place(answer, now).is_none_or(|place| place.is_recent(now) && !place.is(answer))
    }

    /// Where an answer belongs at about `now`: to its like, or in place of the oldest.
    fn place(&mut self, answer: &[u8], now: Instant) -> Option<&mut Sent> {
        self.requests.iter_mut().min_by_key(|sent| (!sent.is(answer), sent.until.near(now)))
    }
}

impl Sent {
    const NOTHING: Sent = Sent {
        head: [0; HEAD],
        tail: [0; 2],
        length_less_one: 0,
        until: Stamp::of(Instant::ZERO),
        copies: 1,
        come: 0,
        row: 0,
    };

    fn new(answer: &[u8], until: Instant) -> Sent {
        let mut head = [0; HEAD];
        head.iter_mut().zip(answer).for_each(|(place, &byte)| *place = byte);
        let tail = answer.last_chunk().copied().unwrap_or_default();
        let length_less_one = answer.len().saturating_sub(1) as u8;
        Sent { head, tail, length_less_one, until: Stamp::of(until), ..Sent::NOTHING }
    }

    /// Whether a repeat that is whole at `now` is an echo.
    fn is_recent(&self, now: Instant) -> bool {
        self.until.micros_ago(now) == 0
    }

    /// Whether a frame is this answer, zeros behind it or not.
    fn is(&self, frame: &[u8]) -> bool {
        let length = usize::from(self.length_less_one).saturating_add(1);
        let Some(whole) = frame.get(..length) else { return false };
        is_padded(frame, length)
            && whole.iter().zip(&self.head).all(|(byte, head)| byte == head)
            && whole.ends_with(&self.tail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crc;
    use std::collections::BTreeSet;

    /// So four bytes and the checksum stand for the whole answer.
    #[test]
    fn no_two_answers_of_eight_bytes_have_beginning_and_checksum_in_common() {
        for [a, b, c, d] in [[1, 6, 0x1C, 0], [247, 6, 0xFF, 0xFF], [5, 8, 0, 0]] {
            let checksums: BTreeSet<u16> = (0..=u16::MAX)
                .map(|value| {
                    let [high, low] = value.to_be_bytes();
                    crc::over(&[a, b, c, d, high, low])
                })
                .collect();
            assert_eq!(checksums.len(), 65_536);
        }
        assert_eq!((HEAD, size_of::<Sent>()), (4, 16));
    }

    #[test]
    fn an_answer_of_any_length_is_known() {
        let frame: std::vec::Vec<u8> = (0..=255).map(|n: u8| n ^ 1).collect();
        for length in 4..=frame.len() {
            let answer = &frame[..length];
            let sent = Sent::new(answer, Instant::ZERO);
            assert!(sent.is(answer), "{length}");
            assert!(
                !sent.is(&frame[..length - 1]) && (length == 256 || !sent.is(&frame[..length + 1])),
                "{length}"
            );
        }
        assert!(!Sent::NOTHING.is(&frame[..1]) && !Sent::NOTHING.is(&[0; 8]) && !Sent::NOTHING.is(&[]));
    }
}

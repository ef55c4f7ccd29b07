//! Answers that were sent lately, to know them when they come back.
//!
//! A port hears itself late where a radio link or a store-and-forward server repeats what it hears. The answer to
//! function 06 is its request, and most of function 08's are theirs: what comes back cannot be told from a master that
//! asks for the same thing again. The rule:
//!
//! | a frame that repeats an answer | |
//! |---|---|
//! | the first within [`ECHO_WINDOW`] of it | is the echo: dropped, not carried out, not answered |
//! | the next one | is the master's, which tries again: carried out and answered |
//! | a repeat of the answer to that | is dropped once more often than before it |
//! | later | is the master's |
//!
//! So an echo provokes nothing, and where each answer comes back k times, one request is answered at most k times. A
//! master whose answer was lost is answered at its second try, or the first that is later than the window. The price:
//! one that sends the same function 06 twice within the window, as function 16 could, has to repeat the second.
//!
//! Limits: [`PLACES`] answers that look like requests, and the last one of the others; the oldest is forgotten.

use clino_bus::Micros;

use crate::request::{self, Form, is_padded};

/// From the end of an answer to the beginning of its echo: twice the half second of store-and-forward servers.
pub const ECHO_WINDOW: Micros = Micros::from_millis(1_000);

/// Answers that look like requests. At 19200 bit/s one and its request take 14 ms at least, and a link that repeats them
/// takes their time again.
const PLACES: usize = 8;

/// The beginning of an answer that is kept: all of an answer to function 06.
const HEAD: usize = 8;

/// Answers that were sent lately.
#[derive(Debug)]
pub struct Repeats {
    /// Those that look like requests.
    requests: [Sent; PLACES],
    /// The place of the next one.
    next: usize,
    /// The last one of the others.
    other: Sent,
    /// Of the next answer, so many repeats are dropped.
    copies: u8,
}

/// An answer.
#[derive(Clone, Copy, Debug)]
struct Sent {
    head: [u8; HEAD],
    /// Its last two bytes: its checksum.
    tail: [u8; 2],
    length: usize,
    /// A repeat that is whole until then is an echo,
    until: Micros,
    /// if less than so many have come.
    copies: u8,
    come: u8,
}

impl Repeats {
    pub const fn new() -> Repeats {
        Repeats { requests: [Sent::NOTHING; PLACES], next: 0, other: Sent::NOTHING, copies: 1 }
    }

    /// Whether a frame may be one of our answers that has come back.
    pub fn knows(&self, frame: &[u8]) -> bool {
        self.requests.iter().chain([&self.other]).any(|sent| sent.is(frame))
    }

    /// Whether a frame that is whole now is one of our answers that has come back.
    pub fn is_echo(&mut self, frame: &[u8], now: Micros) -> bool {
        self.copies = 1;
        let Some(sent) = self.find(frame).filter(|sent| now <= sent.until) else { return false };
        if sent.come < sent.copies {
            sent.come = sent.come.saturating_add(1);
            return true;
        }
        self.copies = sent.copies.saturating_add(1);
        false
    }

    /// Remembers an answer; `echo_by` is when its echo is whole at the latest.
    pub fn sent(&mut self, answer: &[u8], echo_by: Micros) {
        let sent = Sent::new(answer, echo_by, core::mem::replace(&mut self.copies, 1));
        if request::form(answer) == Form::Answer {
            self.other = sent;
        } else if let Some(same) = self.find(answer) {
            *same = sent;
        } else if let Some(place) = self.requests.get_mut(self.next) {
            *place = sent;
            self.next = self.next.wrapping_add(1) % PLACES;
        }
    }

    fn find(&mut self, frame: &[u8]) -> Option<&mut Sent> {
        self.requests.iter_mut().chain([&mut self.other]).find(|sent| sent.is(frame))
    }
}

impl Sent {
    const NOTHING: Sent =
        Sent { head: [0; HEAD], tail: [0; 2], length: 0, until: Micros::ZERO, copies: 0, come: 0 };

    fn new(answer: &[u8], until: Micros, copies: u8) -> Sent {
        let mut head = [0; HEAD];
        head.iter_mut().zip(answer).for_each(|(place, &byte)| *place = byte);
        let tail = answer.last_chunk().copied().unwrap_or_default();
        Sent { head, tail, length: answer.len(), until, copies, come: 0 }
    }

    /// Whether a frame is this answer, zeros behind it or not.
    fn is(&self, frame: &[u8]) -> bool {
        let Some(whole) = frame.get(..self.length) else { return false };
        self.length != 0
            && is_padded(frame, self.length)
            && whole.iter().zip(&self.head).all(|(byte, head)| byte == head)
            && whole.ends_with(&self.tail)
    }
}

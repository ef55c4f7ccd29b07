//! The echo of our own answer, while it goes out and right behind it.
//!
//! | [`EchoMode`] | while it goes out | behind it, within t3.5 of the last character of it |
//! |---|---|---|
//! | off | all that is heard is ours | nothing is |
//! | expected | the same | as many characters as were sent are ours, changed or not |
//! | detect | the same | those that are as they were sent; as with *expected* after an answer that came back whole |
//!
//! So the rest of an echo that is late by less than the answer takes does not spoil the next request. An answer that comes
//! back later is a frame like others: [`repeat`](crate::repeat) knows those, in every mode.

use clino_bus::Instant;
use clino_bus::line::{EchoMode, EchoTracker, EchoVerdict};
use clino_codec::character::Character;

use crate::settings::Settings;

/// Bits after our last stop bit in which a character is still our own: no master can have sent a whole one.
const ECHO_BITS: u32 = 5;

/// Follows our answer on its way back.
#[derive(Debug)]
pub struct Own {
    echo: EchoTracker,
    /// An answer is going out.
    sending: bool,
    /// Characters received until then are ours.
    deaf_until: Instant,
    /// A part of it has come back: a character that is whole until then may be the next one.
    tail: Option<Instant>,
}

impl Own {
    pub const fn new(mode: EchoMode) -> Own {
        Own { echo: EchoTracker::new(mode), sending: false, deaf_until: Instant::ZERO, tail: None }
    }

    /// An answer goes out now.
    pub fn begin(&mut self) {
        _ = self.echo.end();
        self.echo.begin();
        self.sending = true;
        self.tail = None;
    }

    /// Its last stop bit was over at `at`.
    pub fn out(&mut self, at: Instant, settings: &Settings) {
        self.sending = false;
        self.deaf_until = at + settings.bits(ECHO_BITS);
        // As if its centre was a whole bit before: no master begins so early.
        self.expect_tail(at - settings.bits(1), settings);
    }

    /// No answer goes out any more.
    pub fn forget(&mut self) {
        self.sending = false;
        self.tail = None;
    }

    /// Whether all that is heard now is ours.
    pub fn is_deaf(&self, at: Instant) -> bool {
        self.sending || at < self.deaf_until
    }

    /// Whether a character is of the last answer, `sent`; `at` is the centre of its stop bit.
    pub fn is_own(&mut self, character: Character, at: Instant, sent: &[u8], settings: &Settings) -> bool {
        if self.is_deaf(at) {
            _ = self.echo.judge(character, sent, sent.len());
            if !self.sending {
                self.expect_tail(at, settings);
            }
            return true;
        }
        let own = self.tail.is_some_and(|until| at < until)
            && self.echo.judge(character, sent, sent.len()) != EchoVerdict::Foreign;
        self.tail = None;
        if own {
            self.expect_tail(at, settings);
        }
        own
    }

    /// One of its characters had the centre of its stop bit at `at`. The next one begins within t3.5.
    fn expect_tail(&mut self, at: Instant, settings: &Settings) {
        self.tail = self.echo.is_coming_back().then_some(at + settings.t3_5() + settings.characters(1));
    }
}

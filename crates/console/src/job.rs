//! A command in hand: what was typed, for whom, and what it needs.
//!
//! The function that finds an error reports it at once and returns [`Reported`]: passing the error itself through every
//! function would double their flash.

use clino_bus::Instant;
use clino_gateway::order::{Order, Refusal};

use crate::error::Error;
use crate::host::Host;
use crate::meter::Meter;
use crate::number;
use crate::pending::{Next, Pending};
use crate::presence::Presence;
use crate::reply::Reply;
use crate::typed::{Opt, Typed};
use crate::value::Label;
use crate::words::{Words, place};

/// A command in hand.
pub struct Job<'j, 'a> {
    pub typed: Typed<'a>,
    pub reply: Reply<'j>,
    pub host: &'j mut dyn Host,
    pub meter: &'j Meter,
    pub presence: &'j Presence,
    pub now: Instant,
    /// The next step after the command.
    pub next: &'j mut Next,
}

/// The command is not carried out, and the error was written.
#[derive(Clone, Copy, Debug)]
pub struct Reported;

/// Whether a command was carried out.
pub type Outcome = Result<(), Reported>;

impl<'a> Job<'_, 'a> {
    /// Writes an error.
    #[inline(never)]
    pub fn refuse(&mut self, error: &Error<'_>) -> Reported {
        error.write(&mut self.reply);
        Reported
    }

    /// The next word.
    #[inline(never)]
    pub fn word(&mut self, what: &'static str) -> Result<&'a str, Reported> {
        self.typed.next().ok_or_else(|| self.refuse(&Error::Missing(what)))
    }

    /// What a word means.
    pub fn meaning<W: Words>(&mut self, word: &str) -> Result<W, Reported> {
        let place = self.place(word, W::NAMES)?;
        W::VALUES.get(place).copied().ok_or(Reported)
    }

    /// The next word, one of a list.
    pub fn one_of<W: Words>(&mut self, what: &'static str) -> Result<W, Reported> {
        let word = self.word_of(what, W::NAMES)?;
        self.meaning(word)
    }

    /// The next word, which is to be one of a list.
    #[inline(never)]
    pub fn word_of(
        &mut self,
        what: &'static str,
        expected: &'static [&'static str],
    ) -> Result<&'a str, Reported> {
        self.typed.next().ok_or_else(|| self.refuse(&Error::MissingOne { what, expected }))
    }

    /// Where a word stands in a list.
    #[inline(never)]
    pub fn place(&mut self, word: &str, expected: &'static [&'static str]) -> Result<usize, Reported> {
        place(word, expected).ok_or_else(|| self.refuse(&Error::Word { value: word, expected }))
    }

    /// A number within limits.
    #[inline(never)]
    pub fn number(&mut self, word: &str, what: &'static str, least: i64, most: i64) -> Result<i64, Reported> {
        match number::parse(word, 0) {
            Some(value) if (least..=most).contains(&value) => Ok(value),
            value => {
                let what = Label::plain(what);
                Err(self.refuse(&Error::Range { what, word, value, least, most, decimals: 0 }))
            }
        }
    }

    /// A number that is not below zero.
    #[inline(never)]
    pub fn up_to(&mut self, word: &str, what: &'static str, most: u32) -> Result<u32, Reported> {
        self.number(word, what, 0, most.into()).map(|value| value as u32)
    }

    /// A small number within limits.
    #[inline(never)]
    pub fn byte(&mut self, word: &str, what: &'static str, least: u8, most: u8) -> Result<u8, Reported> {
        self.number(word, what, least.into(), most.into()).map(|value| value as u8)
    }

    /// The value of an option. To be called before the words are fetched.
    #[inline(never)]
    pub fn option(&mut self, option: Opt) -> Result<Option<&'a str>, Reported> {
        self.typed.option(option).map_err(|error| self.refuse(&error))
    }

    /// Nothing more is expected.
    #[inline(never)]
    pub fn end(&mut self) -> Outcome {
        match self.typed.rest() {
            Some(error) => Err(self.refuse(&error)),
            None => Ok(()),
        }
    }

    /// What the gateway says to an order.
    #[inline(never)]
    pub fn accepted(&mut self, result: Result<(), Refusal>) -> Outcome {
        result.map_err(|refusal| self.refuse(&Error::Refused(refusal)))
    }

    /// Has an order carried out that needs no more words.
    #[inline(never)]
    pub fn order(&mut self, order: Order) -> Outcome {
        let result = self.host.order(order);
        self.accepted(result)?;
        self.reply.done();
        Ok(())
    }

    /// Carries out an irreversible action after its confirmation.
    #[inline(never)]
    pub fn confirmed(&mut self, pending: Pending) -> Outcome {
        self.end()?;
        if self.typed.yes {
            *self.next = Next::CarryOut(pending);
        } else if self.reply.is_for_people() {
            *self.next = Next::Ask(pending);
        } else {
            return Err(self.refuse(&Error::Unconfirmed(pending.consequence())));
        }
        Ok(())
    }
}

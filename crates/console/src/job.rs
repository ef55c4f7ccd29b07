//! A command in hand: what was typed, for whom, and what it needs.
//!
//! The function that finds an error reports it at once and returns [`Reported`]: passing the error itself through every
//! function would double their flash.

use clino_bus::Instant;
use clino_gateway::order::{Order, Refusal};

use crate::choice::Choice;
use crate::consequences;
use crate::error::{self, MISSING, MISSING_ONE, Mistake, NO_NUMBER, RANGE, WORD};
use crate::host::Host;
use crate::label::Label;
use crate::meter::Meter;
use crate::number;
use crate::pending::{Next, Pending};
use crate::presence::Presence;
use crate::reply::Reply;
use crate::typed::{Opt, Typed};
use crate::value::Value;
use crate::words::Words;

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
    pub fn refuse(&mut self, row: &'static str, values: &[Value<'_>]) -> Reported {
        self.reply.refuse(row, values);
        Reported
    }

    /// Writes what is wrong with the line.
    #[inline(never)]
    pub fn mistaken(&mut self, mistake: &Mistake<'_>) -> Reported {
        self.refuse(mistake.row, &[mistake.value.into()])
    }

    /// The next word.
    #[inline(never)]
    pub fn word(&mut self, what: &'static str) -> Result<&'a str, Reported> {
        self.typed.next().ok_or_else(|| self.refuse(MISSING, &[what.into()]))
    }

    /// What a word means.
    pub fn meaning<W: Words>(&mut self, word: &str) -> Result<W, Reported> {
        let place = self.place(word, Choice::Words(W::NAMES))?;
        W::VALUES.get(place).copied().ok_or(Reported)
    }

    /// The next word, one of a list.
    pub fn one_of<W: Words>(&mut self, what: &'static str) -> Result<W, Reported> {
        let place = self.place_of(what, Choice::Words(W::NAMES))?;
        W::VALUES.get(place).copied().ok_or(Reported)
    }

    /// Where the next word stands in a list.
    #[inline(never)]
    pub fn place_of(&mut self, what: &'static str, expected: Choice) -> Result<usize, Reported> {
        match self.typed.next() {
            Some(word) => self.place(word, expected),
            None => Err(self.refuse(MISSING_ONE, &[what.into(), Value::OneOf(expected)])),
        }
    }

    /// Where a word stands in a list.
    #[inline(never)]
    pub fn place(&mut self, word: &str, expected: Choice) -> Result<usize, Reported> {
        expected.place(word).ok_or_else(|| self.refuse(WORD, &[word.into(), Value::OneOf(expected)]))
    }

    /// A number within limits.
    #[inline(never)]
    pub fn number(&mut self, word: &str, what: &'static str, least: i64, most: i64) -> Result<i64, Reported> {
        match number::parse(word, 0) {
            Some(value) if (least..=most).contains(&value) => Ok(value),
            value => Err(self.beyond(&Label::plain(what), word, value, (least, most), 0)),
        }
    }

    /// A number is out of its range, or none.
    #[inline(never)]
    pub fn beyond(
        &mut self,
        what: &Label,
        word: &str,
        value: Option<i64>,
        (least, most): (i64, i64),
        decimals: u8,
    ) -> Reported {
        let number = |number| Value::Decimal(number, decimals);
        let (row, value) = match value {
            Some(value) => (RANGE, number(value)),
            None => (NO_NUMBER, word.into()),
        };
        self.refuse(row, &[Value::Label(what), value, number(least), number(most), word.into()])
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
        self.typed.option(option).map_err(|mistake| self.mistaken(&mistake))
    }

    /// Nothing more is expected.
    #[inline(never)]
    pub fn end(&mut self) -> Outcome {
        match self.typed.rest() {
            Some(mistake) => Err(self.mistaken(&mistake)),
            None => Ok(()),
        }
    }

    /// Writes why the gateway refuses an order.
    #[inline(never)]
    pub fn refused(&mut self, refusal: &Refusal) -> Reported {
        error::refused(&mut self.reply, refusal);
        Reported
    }

    /// What the gateway says to an order.
    #[inline(never)]
    pub fn accepted(&mut self, result: Result<(), Refusal>) -> Outcome {
        result.map_err(|refusal| self.refused(&refusal))
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
            consequences::unconfirmed(&mut self.reply, pending.consequence());
            return Err(Reported);
        }
        Ok(())
    }
}

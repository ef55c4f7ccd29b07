//! The interface of all operations.

use clino_bus::{Duration, ExchangeOutcome, Instant, Protocol, Serial};

/// What an operation wants next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step<A, Q> {
    /// One exchange.
    Ask {
        /// The address to ask.
        address: A,
        /// What is asked.
        request: Q,
        /// How often the request may be sent, until there is an answer. The operation receives the last outcome only.
        tries: u8,
    },
    /// One request that several may answer. The operation receives every outcome.
    Collect {
        /// The address to ask.
        address: A,
        /// What is asked.
        request: Q,
        /// How long answers may begin after the request's last stop bit; at least what one node may take to answer.
        window: Duration,
    },
    /// Nothing before that instant.
    Wait {
        /// When to ask again.
        until: Instant,
    },
    /// The line runs at this bit rate from now on.
    Serial(Serial),
    /// The end: [`Operation::result`] has the result. Asking again gives the same.
    Done,
}

/// The step type of an operation.
pub type StepOf<O> = Step<
    <<O as Operation>::Protocol as Protocol>::Address,
    <<O as Operation>::Protocol as Protocol>::Request,
>;

/// How far an operation is, in exchanges or so. `of` is an estimate that may grow; `done` never exceeds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TaskProgress {
    /// Parts done.
    pub done: u16,
    /// All parts.
    pub of: u16,
}

impl TaskProgress {
    pub(crate) fn new(done: u16, of: u16) -> TaskProgress {
        TaskProgress { done: done.min(of), of }
    }
}

/// A task on one bus as a resumable state machine, run by a [`Runner`](crate::Runner).
pub trait Operation {
    /// What is spoken on the bus.
    type Protocol: Protocol;
    /// What it reports before its end.
    type Event;
    /// The result, when all went well.
    type Report;
    /// Why it did not.
    type Error;

    /// What to do next. May be asked any number of times, except that a [`Step::Serial`] is said once and taken as
    /// done: otherwise only time and [`on`](Self::on) move it.
    fn next(&mut self, now: Instant) -> StepOf<Self>;

    /// How it has ended, once [`next`](Self::next) has returned [`Step::Done`]; before, it need not be true.
    fn result(&self) -> Option<Result<Self::Report, Self::Error>>;

    /// An exchange asked for has ended; one answer, when collecting.
    fn on(&mut self, outcome: &ExchangeOutcome<Self::Protocol>) -> Option<Self::Event>;

    /// How far it is.
    fn progress(&self) -> TaskProgress;

    /// Stops at the next consistent point. The runner still has to run the operation to its end.
    fn cancel(&mut self);

    /// Whether the operation needs the line between two exchanges, too: its bit rate is not the one that the others expect,
    /// or is about to change.
    fn is_exclusive(&self) -> bool {
        false
    }
}

//! Repairs a module whose EEPROM checksum is wrong: it is in its Hard Error state and answers every request with that error.
//!
//! ```text
//!  Look ──▶ (soft error state) ──▶ Read all ──▶ audit ── wrong ──▶ Write the checksum ──▶ Boot ── measures ──▶ done
//!   │ ▲                              ▲            │ right                                  │
//!   ▼ │ none, or a healthy one        └──────────── still in error: the other reading ◀─────┘
//!  next address
//! ```
//! The document describes in two ways what the checksum covers ([`ChecksumReading`]). A known one is tried first;
//! the state of the module after the reset decides. A checksum that was right at first, and turned out not to
//! be the problem, is restored.
//!
//! Source: AN #201 section 4 (Module is in Error State), sections 6 and 7, appendix A (function 000).

use clino_bus::{Duration, ExchangeOutcome, Instant, Isu};
use clino_codec::isu::eeprom::{Audit, ChecksumReading, Plan};
use clino_codec::isu::{Address, Function, Request, Response};

use super::boot::{Alive, Boot};
use super::image::Reader;
use super::talk::{Said, Talk, response};
use super::writer::Writer;
use super::{Cause, Failure, Fault, Module};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// The two address bits that the word at 49H holds; the other two are in the word at 48H.
const LOW_PAIR: u8 = 0b0011;

/// The reading closer to the document's words first.
const READINGS: [Option<ChecksumReading>; 2] =
    [Some(ChecksumReading::UpperBitsCounted), Some(ChecksumReading::WordsLeftOut)];

/// Repairs a module's checksum. Nothing else is written.
#[derive(Clone, Debug)]
pub struct Repair {
    /// Where the module may be.
    candidates: [Address; 3],
    /// Which of them.
    candidate: usize,
    talk: Talk,
    reader: Reader,
    state: State,
    /// The module came up in error after a reset: what its checksum is now is wrong, or something else is.
    in_error: bool,
    /// The checksum as it was found.
    found: Option<Audit>,
    /// Tried in this order, unless found to be right already; `None` once done.
    readings: [Option<ChecksumReading>; 2],
    /// A healthy module met on the way.
    healthy: Option<Repaired>,
    fault: Option<Fault>,
    writes: u8,
    cancelled: bool,
}

/// A module that measures again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Repaired {
    /// Where it answers.
    pub at: Address,
    /// The address in its EEPROM. After an interrupted change that may be the old one, the new one, or a third.
    pub stored_address: Address,
    /// The checksum as it was found.
    pub found: Audit,
    /// What its checksum turned out to cover; `None` when nothing was wrong.
    pub reading: Option<ChecksumReading>,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Look,
    Read,
    Write(Writer, After),
    /// With the reading in which the checksum was written, if it was.
    Boot(Boot, Option<ChecksumReading>),
    Ended(Result<Repaired, Failure>),
}

/// What follows a write.
#[derive(Clone, Copy, Debug)]
enum After {
    /// The module's opinion about a checksum in this reading.
    Boot(ChecksumReading),
    /// The end: the checksum is again as it was found, because it was not what is wrong.
    GiveUp,
}

impl Repair {
    /// Repairs that module.
    pub const fn new(module: Module) -> Repair {
        Self::at([module.address(); 3])
    }

    /// Repairs the module that was to change its address from `from` to `to` when it was interrupted: it is at one of
    /// them, or at a third that is made of both. Healthy modules there are reset, and not changed.
    pub fn after_address_change(from: Module, to: Module) -> Repair {
        let (from, to) = (from.address(), to.address());
        let mixed = to.get() & !LOW_PAIR | from.get() & LOW_PAIR;
        // 0 and 15 address no single module.
        let mixed = Address::new(mixed).filter(|address| !address.is_any()).unwrap_or(to);
        Self::at([from, to, mixed])
    }

    /// With what the module's checksum covers, as an [`Audit`] of its sound EEPROM has told.
    #[must_use]
    pub fn knowing(mut self, reading: ChecksumReading) -> Repair {
        let [first, second] = &mut self.readings;
        if *second == Some(reading) {
            core::mem::swap(first, second);
        }
        self
    }

    const fn at(candidates: [Address; 3]) -> Repair {
        let [first, ..] = candidates;
        Repair {
            candidates,
            candidate: 0,
            talk: Talk::new(first),
            reader: Reader::new(),
            state: State::Look,
            in_error: false,
            found: None,
            readings: READINGS,
            healthy: None,
            fault: None,
            writes: 0,
            cancelled: false,
        }
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        let torn = matches!(&self.state, State::Write(writer, _) if writer.is_torn());
        let unsound = self.found.is_some_and(|found| !found.is_sound());
        self.state = State::Ended(Err(Failure { cause, writes: self.writes, repair: torn || unsound }));
    }

    /// The present candidate is not the one.
    fn look_further(&mut self) {
        let asked = self.candidates.get(..=self.candidate).unwrap_or(&[]);
        let next = self.candidates.iter().enumerate().find(|(_, address)| !asked.contains(address));
        match (next, self.healthy) {
            (Some((index, &address)), _) => {
                self.candidate = index;
                self.talk = Talk::new(address);
                self.reader.restart();
                self.found = None;
                self.in_error = false;
                self.state = State::Look;
            }
            (None, Some(healthy)) => self.state = State::Ended(Ok(healthy)),
            (None, None) => {
                let fault = self.fault.unwrap_or(Fault::NoAnswer { waited: Duration::ZERO });
                self.fail(Cause::NotFound { fault });
            }
        }
    }

    fn on_look(&mut self, outcome: &ExchangeOutcome<Isu>) {
        match response(Function::ReadRam, self.talk.at, &outcome.result) {
            Ok(_) => self.state = State::Read,
            Err(Cause::HardError) => {
                self.talk.soften();
                self.state = State::Read;
            }
            Err(Cause::NoAnswer { fault, .. }) => {
                self.fault = Some(fault);
                self.look_further();
            }
            Err(cause) => self.fail(cause),
        }
    }

    /// The whole EEPROM has been read.
    fn decide(&mut self) {
        let image = &self.reader.image;
        let audit = image.audit();
        if audit.is_sound() && !self.in_error {
            // Only a reset tells whether the module agrees: it may have been left in its Soft Error state.
            self.found.get_or_insert(audit);
            self.state = State::Boot(self.boot(), None);
            return;
        }
        let found = *self.found.get_or_insert(audit);
        // A reading in which the checksum is right already, and yet the module is in error, is not the module's.
        let is_open =
            |reading: &Option<ChecksumReading>| reading.is_some_and(|reading| !audit.holds(reading));
        let next = self.readings.iter_mut().find(|reading| is_open(reading)).and_then(Option::take);
        if let Some(reading) = next {
            let plan = Plan::repair(image, reading);
            self.state = State::Write(Writer::new(plan), After::Boot(reading));
            return;
        }
        match found.only_reading() {
            Some(reading) if !audit.holds(reading) => {
                let plan = Plan::repair(image, reading);
                self.state = State::Write(Writer::new(plan), After::GiveUp);
            }
            _ => self.fail(Cause::NotTheChecksum(found)),
        }
    }

    /// After the reset it is where its EEPROM says, which may not be where it is now.
    fn boot(&self) -> Boot {
        let at = self.talk.at;
        let stored = self.reader.image.module_address();
        let is_one = !at.is_any() && !stored.is_any() && !stored.is_reserved() && stored != at;
        if is_one { Boot::new(stored, Some(at)) } else { Boot::new(at, None) }
    }

    fn on_written(&mut self, sent: Result<bool, Cause>, is_done: bool, after: After) {
        match (sent, after) {
            (Err(cause), _) => self.fail(cause),
            (Ok(sent), _) if sent || !is_done => {
                self.writes = self.writes.saturating_add(u8::from(sent));
            }
            (Ok(_), After::Boot(reading)) => self.state = State::Boot(self.boot(), Some(reading)),
            (Ok(_), After::GiveUp) => {
                let found = self.found.unwrap_or(self.reader.image.audit());
                self.fail(Cause::NotTheChecksum(found));
            }
        }
    }

    fn on_boot(&mut self, alive: Option<Result<Alive, Cause>>, reading: Option<ChecksumReading>) {
        match alive {
            None => {}
            Some(Err(cause)) => self.fail(cause),
            Some(Ok(Alive { at, hard_error: true, .. })) => {
                self.in_error = true;
                self.talk.at = at;
                self.talk.soften();
                self.reader.restart();
                self.state = State::Read;
            }
            Some(Ok(Alive { at, .. })) => {
                let image = &self.reader.image;
                let found = self.found.unwrap_or(image.audit());
                let stored_address = image.module_address();
                let repaired = Repaired { at, stored_address, found, reading, writes: self.writes };
                if reading.is_some() {
                    self.state = State::Ended(Ok(repaired));
                } else {
                    self.healthy = Some(repaired);
                    self.look_further();
                }
            }
        }
    }
}

impl Operation for Repair {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Repaired;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        if matches!(self.state, State::Read) && self.reader.request().is_none() {
            self.decide();
        }
        match &self.state {
            State::Boot(boot, _) => boot.next(&self.talk, now),
            State::Ended(_) => Step::Done,
            state => {
                let (request, tries) = match state {
                    State::Write(writer, _) => writer.request(),
                    State::Read => self.reader.request().map(|request| (request, READ_TRIES)),
                    _ => None,
                }
                .unwrap_or((Request::READ_ANGLE, READ_TRIES));
                self.talk.ask(request, tries)
            }
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ended(result) => Some(result),
            _ => None,
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Self::Event> {
        match &mut self.state {
            State::Look => self.on_look(outcome),
            State::Read => match self.talk.settle(Function::ReadEeprom, outcome) {
                Said::Response(Response::ReadEeprom { start, words }) => self.reader.take(*start, words),
                Said::Response(_) | Said::Again => {}
                Said::Failed(cause) => self.fail(cause),
            },
            State::Write(writer, after) => {
                let sent = writer.on(&mut self.talk, outcome);
                let (is_done, after) = (writer.is_done(), *after);
                self.on_written(sent, is_done, after);
            }
            State::Boot(boot, reading) => {
                let (alive, reading) = (boot.on(&mut self.talk, outcome), *reading);
                self.on_boot(alive, reading);
            }
            State::Ended(_) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        // Reading, one run of words, reset.
        let of = Reader::EXCHANGES.saturating_add(2);
        let done = match &self.state {
            State::Look => 0,
            State::Read => self.reader.done(),
            State::Write(..) => Reader::EXCHANGES,
            State::Boot(..) => of.saturating_sub(1),
            State::Ended(_) => of,
        };
        TaskProgress::new(done, of)
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

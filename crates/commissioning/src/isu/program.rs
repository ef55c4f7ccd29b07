//! Changing address, null position or auto-shutoff in the EEPROM.
//!
//! ```text
//!  Probe ──▶ Read all ──▶ audit ──▶ Write (data, then checksum) ──▶ Boot ──▶ Verify ──▶ done
//!    │ an answer            │ bad
//!    ▼                      ▼
//!  taken                  refused
//! ```
//! Whether a new address acts at once or after a reset the document does not say: a module that falls silent after a
//! write is looked for at its new address. A module that notices the wrong checksum between the two writes goes into
//! its Hard Error state; it is taken out of it and the sequence goes on.
//!
//! Source: AN #201 sections 6 and 7.

use clino_bus::{ExchangeOutcome, Instant, Isu};
use clino_codec::isu::eeprom::{Change, Plan, WORDS_PER_DATA_WORD};
use clino_codec::isu::{Address, Function, Request, Response};

use super::boot::{Alive, Boot};
use super::image::{Reader, place, present};
use super::talk::{Said, Talk};
use super::writer::Writer;
use super::{Cause, Failure, Fault, Module};
use crate::{Operation, READ_TRIES, Report, Step, StepOf, TaskProgress};

/// Changes one setting in a module's EEPROM.
#[derive(Clone, Debug)]
pub struct Program {
    module: Module,
    wanted: Change,
    talk: Talk,
    reader: Reader,
    state: State,
    writes: u8,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// No module may answer at the new address, however often it is asked.
    Probe {
        at: Address,
        silences: u8,
    },
    Read,
    Write(Writer),
    Boot(Boot),
    Verify,
    Ended(Result<Report<Change>, Failure>),
}

impl Program {
    /// Begins with reading the whole EEPROM; an address change with asking at the new address.
    ///
    /// # Errors
    /// [`Cause::ReservedAddress`]; [`Cause::ZeroOnSharedLine`] for address 0 unless the module is
    /// [single](Module::single).
    // As `Reader::new`.
    #[inline(always)]
    pub fn new(module: Module, wanted: Change) -> Result<Program, Cause> {
        let mut talk = Talk::new(module.address());
        let mut state = State::Read;
        if let Change::ModuleAddress(to) = wanted {
            if to.is_reserved() {
                return Err(Cause::ReservedAddress);
            }
            if !module.is_single() {
                if to.is_any() {
                    return Err(Cause::ZeroOnSharedLine);
                }
                if to != module.address() {
                    talk.other = Some(to);
                    state = State::Probe { at: to, silences: 0 };
                }
            }
        }
        Ok(Program { module, wanted, talk, reader: Reader::new(), state, writes: 0, cancelled: false })
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        let repair = match &self.state {
            State::Write(writer) => writer.is_torn(),
            // The checksum was right when it was read back; the module alone knows what it dislikes.
            _ => matches!(cause, Cause::HardError) && self.writes > 0,
        };
        self.state = State::Ended(Err(Failure { cause, writes: self.writes, repair }));
    }

    fn done(&mut self, from: Change, to: Change) {
        self.state = State::Ended(Ok(Report::new(from, to, self.writes)));
    }

    fn on_probe(&mut self, at: Address, silences: u8, outcome: &ExchangeOutcome<Isu>) {
        match outcome.result {
            Err(Fault::NoAnswer { .. }) => {
                let silences = silences.saturating_add(1);
                self.state = if silences < READ_TRIES { State::Probe { at, silences } } else { State::Read };
            }
            // One module, or several at once.
            Ok(_) | Err(Fault::Garbled { .. } | Fault::Bad(_)) => {
                self.fail(Cause::AddressTaken { address: at });
            }
            Err(fault) => self.fail(Cause::NoAnswer { function: Function::ReadRam, address: at, fault }),
        }
    }

    /// The whole EEPROM has been read.
    fn decide(&mut self) {
        let image = &self.reader.image;
        let audit = image.audit();
        if !audit.is_sound() {
            self.fail(Cause::Unsound(audit));
        } else if self.talk.was_in_hard_error() {
            self.fail(Cause::NotTheChecksum(audit));
        } else {
            match Plan::change(image, self.wanted) {
                Ok(plan) if plan.writes().is_empty() => self.done(self.wanted, self.wanted),
                Ok(plan) => self.state = State::Write(Writer::new(plan)),
                Err(_) => self.fail(Cause::ReservedAddress),
            }
        }
    }

    fn on_written(&mut self, sent: Result<bool, Cause>, is_done: bool) {
        match sent {
            Err(cause) => self.fail(cause),
            Ok(true) => self.writes = self.writes.saturating_add(1),
            Ok(false) if is_done => self.boot(),
            Ok(false) => {}
        }
    }

    /// Where it should be after the reset, and where else it may be.
    fn boot(&mut self) {
        let at = self.module.address();
        self.state = State::Boot(match self.wanted {
            Change::ModuleAddress(to) if !self.module.is_single() => Boot::new(to, Some(at)),
            _ => Boot::new(at, None),
        });
    }

    fn on_boot(&mut self, alive: Option<Result<Alive, Cause>>) {
        match (alive, self.wanted) {
            (None, _) => {}
            (Some(Err(cause)), _) => self.fail(cause),
            (Some(Ok(Alive { hard_error: true, .. })), _) => self.fail(Cause::HardError),
            (Some(Ok(Alive { at, .. })), Change::ModuleAddress(to))
                if !self.module.is_single() && at != to =>
            {
                self.fail(Cause::StillAt { address: at });
            }
            (Some(Ok(Alive { at, .. })), _) => {
                self.talk.at = at;
                self.state = State::Verify;
            }
        }
    }

    fn on_verify(&mut self, outcome: &ExchangeOutcome<Isu>) {
        match self.talk.settle(Function::ReadEeprom, outcome) {
            Said::Response(Response::ReadEeprom { start, words }) => {
                let before = present(&self.reader.image, self.wanted);
                self.reader.image.fill(*start, words.iter());
                let seen = present(&self.reader.image, self.wanted);
                if seen == self.wanted {
                    self.done(before, seen);
                } else {
                    self.fail(Cause::NotKept { wanted: self.wanted, seen });
                }
            }
            Said::Response(_) | Said::Again => {}
            Said::Failed(cause) => self.fail(cause),
        }
    }
}

impl Operation for Program {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Report<Change>;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        if matches!(self.state, State::Read) && self.reader.request().is_none() {
            self.decide();
        }
        match &self.state {
            State::Probe { at, .. } => Step::Ask { address: *at, request: Request::READ_ANGLE, tries: 1 },
            State::Boot(boot) => boot.next(&self.talk, now),
            State::Ended(_) => Step::Done,
            state => {
                let (request, tries) = match state {
                    State::Write(writer) => writer.request(),
                    State::Read => self.reader.request().map(|request| (request, READ_TRIES)),
                    _ => None,
                }
                .unwrap_or((read_back(self.wanted), READ_TRIES));
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
            &mut State::Probe { at, silences } => self.on_probe(at, silences, outcome),
            State::Read => match self.talk.settle(Function::ReadEeprom, outcome) {
                Said::Response(Response::ReadEeprom { start, words }) => self.reader.take(*start, words),
                Said::Response(_) | Said::Again => {}
                Said::Failed(cause) => self.fail(cause),
            },
            State::Write(writer) => {
                let sent = writer.on(&mut self.talk, outcome);
                let is_done = writer.is_done();
                self.on_written(sent, is_done);
            }
            State::Boot(boot) => {
                let alive = boot.on(&mut self.talk, outcome);
                self.on_boot(alive);
            }
            State::Verify => self.on_verify(outcome),
            State::Ended(_) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        // Reading, two runs of words, reset, verification.
        let of = Reader::EXCHANGES.saturating_add(4);
        let done = match &self.state {
            State::Probe { .. } => 0,
            State::Read => self.reader.done(),
            State::Write(writer) => Reader::EXCHANGES.saturating_add(writer.progress().0),
            State::Boot(_) => of.saturating_sub(2),
            State::Verify => of.saturating_sub(1),
            State::Ended(_) => of,
        };
        TaskProgress::new(done, of)
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

/// Reads the words that hold the setting.
fn read_back(change: Change) -> Request {
    Request::ReadEeprom { start: place(change).start(), count: WORDS_PER_DATA_WORD as u8 }
}

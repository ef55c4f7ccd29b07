//! Reset Null Position: the present angle becomes zero (appendix A, function 110).
//!
//! ```text
//!  Audit ──▶ Watch ── zero ──▶ done
//!   │ bad     │ ▲ │              ▲
//!   ▼   moves ▼ │ │ stands still │ zero
//!  refused      │ ▼              │
//!               │ Write ──────▶ Read, after 600 ms: the next angle is there
//!               │ not zero       │
//!               └────────────────┘
//! ```
//! The module writes null position and checksum itself, which it corrects by the difference: a checksum that is wrong
//! before is wrong afterwards, and the module in its Hard Error state after the next reset. So the EEPROM is read first.
//! When power fails meanwhile, it needs a [repair](super::Repair).

use clino_bus::{Duration, ExchangeOutcome, Instant, Isu};
use clino_codec::isu::{Address, Function, Request, Response};

use super::image::Reader;
use super::talk::response;
use super::{Cause, Failure, Module, NEW_ANGLE, REFRESH};
use crate::motion::Motion;
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress, WRITE_TRIES};

/// How far from zero the angle may read afterwards: 18/65536 of a turn, 0.1°. The document gives no noise figure.
pub const NULL_TOLERANCE: u16 = 18;

/// Readings by which motion is seen, each a [`REFRESH`] after the one before: 1.07 s together. A zero is read back 0.6 s
/// after the write, and the angle is then up to a refresh old. At a steady rate a module passes that moves by less than
/// [`NULL_TOLERANCE`] in that time, 0.09° a second.
const LOOKS: u8 = 3;

/// Units of the angle in a turn.
const TURN: i32 = 65_536;
/// Thousandths of a degree in a turn.
const TURN_MDEG: u64 = 360_000;

/// Makes the present angle zero.
#[derive(Clone, Debug)]
pub struct ResetNull {
    address: Address,
    reader: Reader,
    state: State,
    /// What was read since it is watched.
    motion: Motion<TURN>,
    before: Option<u16>,
    writes: u8,
    cancelled: bool,
}

/// What the angle read before and after, in 360/65536°.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nulled {
    /// Before. Exactly zero: nothing was written.
    pub before: u16,
    /// As read back, within [`NULL_TOLERANCE`] of zero.
    pub after: u16,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Audit,
    Watch { from: Instant },
    Read { from: Instant },
    Write,
    Ended(Result<Nulled, Failure>),
}

impl ResetNull {
    /// Begins with reading the whole EEPROM. A module that moves is refused.
    // As `Reader::new`.
    #[inline(always)]
    pub const fn new(module: Module) -> ResetNull {
        ResetNull {
            address: module.address(),
            reader: Reader::new(),
            state: State::Audit,
            motion: Motion::new(),
            before: None,
            writes: 0,
            cancelled: false,
        }
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause, repair: bool) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes, repair }));
    }

    /// The whole EEPROM has been read.
    fn audited(&mut self, now: Instant) {
        let audit = self.reader.image.audit();
        if audit.is_sound() {
            self.state = State::Watch { from: now };
        } else {
            self.fail(Cause::Unsound(audit), false);
        }
    }

    /// An angle while it is watched whether the module stands still.
    fn on_watch(&mut self, seen: u16, from: Instant, at: Instant) {
        self.before.get_or_insert(seen);
        self.motion.take(seen.into(), at);
        if self.motion.readings() < LOOKS {
            // From instant to instant, however long an answer takes: a refresh has passed, and not two.
            self.state = State::Watch { from: from + REFRESH };
        } else if self.motion.spread() > NULL_TOLERANCE.into() {
            self.fail(Cause::Moving { mdeg_per_s: self.mdeg_per_s() }, false);
        } else if self.is_zero(seen) {
            self.done(seen);
        } else if self.cancelled {
            self.fail(Cause::Cancelled, false);
        } else {
            self.state = State::Write;
        }
    }

    /// The angle after a write.
    fn on_read_back(&mut self, seen: u16, at: Instant) {
        if self.is_zero(seen) {
            self.done(seen);
        } else if self.cancelled {
            self.fail(Cause::Cancelled, false);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::NotZero { seen }, false);
        } else {
            self.motion = Motion::new();
            self.state = State::Watch { from: at };
        }
    }

    /// How fast it moves. The angles are those of refreshes, so that whole refreshes have passed between them.
    fn mdeg_per_s(&self) -> u32 {
        let half = Duration::from_micros(REFRESH.as_micros() / 2);
        let refreshes =
            (self.motion.span() + half).as_micros().checked_div(REFRESH.as_micros()).unwrap_or(0).max(1);
        let codes = self.motion.rate(REFRESH.times(refreshes));
        let mdeg = u64::from(codes).saturating_mul(TURN_MDEG).checked_div(TURN as u64);
        mdeg.and_then(|mdeg| u32::try_from(mdeg).ok()).unwrap_or(u32::MAX)
    }

    fn is_zero(&self, seen: u16) -> bool {
        let tolerance = if self.writes == 0 { 0 } else { NULL_TOLERANCE };
        seen.min(seen.wrapping_neg()) <= tolerance
    }

    fn done(&mut self, after: u16) {
        let before = self.before.unwrap_or(after);
        self.state = State::Ended(Ok(Nulled { before, after, writes: self.writes }));
    }
}

impl Operation for ResetNull {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Nulled;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled, false);
        }
        if matches!(self.state, State::Audit) && self.reader.request().is_none() {
            self.audited(now);
        }
        let address = self.address;
        match self.state {
            State::Audit => {
                let request = self.reader.request().unwrap_or(Request::READ_ANGLE);
                Step::Ask { address, request, tries: READ_TRIES }
            }
            State::Watch { from } | State::Read { from } if now < from => Step::Wait { until: from },
            State::Watch { .. } | State::Read { .. } => {
                Step::Ask { address, request: Request::READ_ANGLE, tries: READ_TRIES }
            }
            State::Write => Step::Ask { address, request: Request::ResetNullPosition, tries: 1 },
            State::Ended(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ended(result) => Some(result),
            _ => None,
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Self::Event> {
        let function = match self.state {
            State::Audit => Function::ReadEeprom,
            State::Watch { .. } | State::Read { .. } => Function::ReadRam,
            State::Write => {
                self.writes = self.writes.saturating_add(1);
                self.state = State::Read { from: outcome.at + NEW_ANGLE };
                return None;
            }
            State::Ended(_) => return None,
        };
        match (response(function, self.address, &outcome.result), self.state) {
            (Ok(Response::ReadEeprom { start, words }), State::Audit) => self.reader.take(*start, words),
            (Ok(response), State::Watch { from }) => {
                response.angle_word().into_iter().for_each(|seen| self.on_watch(seen, from, outcome.at));
            }
            (Ok(response), State::Read { .. }) => {
                response.angle_word().into_iter().for_each(|seen| self.on_read_back(seen, outcome.at));
            }
            (Ok(_), _) => {}
            // The module itself writes the memory: if it is silent or in its Hard Error state, it may have stopped half-way.
            (Err(cause), _) => self.fail(cause, self.writes > 0),
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        // Reading, watching, a write and a reading.
        let watched = Reader::EXCHANGES.saturating_add(LOOKS.into());
        let of = watched.saturating_add(2);
        let done = match self.state {
            State::Audit => self.reader.done(),
            State::Watch { .. } => Reader::EXCHANGES.saturating_add(self.motion.readings().into()),
            State::Write => watched,
            State::Read { .. } => watched.saturating_add(1),
            State::Ended(_) => of,
        };
        TaskProgress::new(done, of)
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

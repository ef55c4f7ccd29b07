//! Reset Null Position: the angle as it stands becomes zero (appendix A, function 110).
//!
//! ```text
//!  Read ── zero ──▶ done
//!   │ ▲
//!   ▼ │ 600 ms: the next angle is there
//!  Write
//! ```
//! The module writes null position and checksum itself. When power fails meanwhile, it needs a
//! [repair](super::Repair).

use clino_bus::{Isu, Micros, Outcome};
use clino_codec::isu::{Address, Function, Request};

use super::talk::response;
use super::{Cause, Failure, Module, NEW_ANGLE};
use crate::{Operation, Progress, READ_TRIES, Step, StepOf, WRITE_TRIES};

/// How far from zero the angle may read afterwards: 18/65536 of a turn, 0.1°. The document gives no noise figure.
pub const NULL_TOLERANCE: u16 = 18;

/// Makes the present angle zero.
#[derive(Clone, Copy, Debug)]
pub struct ResetNull {
    address: Address,
    state: State,
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
    Read { from: Micros },
    Write,
    Ended(Result<Nulled, Failure>),
}

impl ResetNull {
    /// Begins with reading the angle. The module should stand still.
    pub const fn new(module: Module) -> ResetNull {
        ResetNull {
            address: module.address(),
            state: State::Read { from: Micros::ZERO },
            before: None,
            writes: 0,
            cancelled: false,
        }
    }

    fn fail(&mut self, cause: Cause, repair: bool) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes, repair }));
    }

    fn on_angle(&mut self, seen: u16) {
        let before = *self.before.get_or_insert(seen);
        let off = seen.min(seen.wrapping_neg());
        let tolerance = if self.writes == 0 { 0 } else { NULL_TOLERANCE };
        if off <= tolerance {
            self.state = State::Ended(Ok(Nulled { before, after: seen, writes: self.writes }));
        } else if self.cancelled {
            self.fail(Cause::Cancelled, false);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::NotZero { seen }, false);
        } else {
            self.state = State::Write;
        }
    }
}

impl Operation for ResetNull {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Nulled;
    type Error = Failure;

    fn next(&mut self, now: Micros) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled, false);
        }
        let address = self.address;
        match self.state {
            State::Read { from } if now < from => Step::Wait { until: from },
            State::Read { .. } => Step::Ask { address, request: Request::READ_ANGLE, tries: READ_TRIES },
            State::Write => Step::Ask { address, request: Request::ResetNullPosition, tries: 1 },
            State::Ended(result) => Step::Done(result),
        }
    }

    fn on(&mut self, outcome: &Outcome<Isu>) -> Option<Self::Event> {
        match self.state {
            State::Read { .. } => match response(Function::ReadRam, self.address, outcome.result) {
                Ok(response) => {
                    if let Some(seen) = response.angle_word() {
                        self.on_angle(seen);
                    }
                }
                // The module writes by itself: silent or in its Hard Error state, it may have got half-way.
                Err(cause) => self.fail(cause, self.writes > 0),
            },
            State::Write => {
                self.writes = self.writes.saturating_add(1);
                self.state = State::Read { from: outcome.at + NEW_ANGLE };
            }
            State::Ended(_) => {}
        }
        None
    }

    fn progress(&self) -> Progress {
        match self.state {
            State::Read { .. } if self.writes == 0 => Progress::new(0, 3),
            State::Write => Progress::new(1, 3),
            State::Read { .. } => Progress::new(2, 3),
            State::Ended(_) => Progress::new(3, 3),
        }
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

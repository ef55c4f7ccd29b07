//! Whether a value may be published, or has to be confirmed by a second one first.
//!
//! One damaged frame in a few hundred passes its 8-bit sum. Two that say the same are 10 000 times rarer and more, as
//! long as what damaged the first is over before the second. So unconfirmed values are held back: the first one, one
//! after a line error, and a jump. The sensor is asked again after [`CONFIRM_AFTER`], once, in another way where the
//! sensor has one, and from then on with every reading, until two in a row agree. Meanwhile the slot keeps its last
//! value, which grows old, or its last error; it turns *suspect* when two have disagreed.
//!
//! Two values agree if they differ by no more than the sensor's resolution and what it may have moved in between; where
//! a slot has no limit of its rate, any two do, if the first is not too old. Silence is no line error: nothing was
//! received that could be wrong.
//!
//! [`CONFIRM_AFTER`]: crate::schedule::queue::CONFIRM_AFTER

use clino_bus::{Duration, Instant};
use clino_codec::angle::Angle;

use super::maths::step;
use crate::stamp::Stamp;

/// The rate of a slot whose motion has no limit.
const NO_LIMIT: u32 = 0;
/// Micro-degrees a microsecond, per millidegree a second: one in a thousand.
const PER_MDEG_PER_S: u64 = 1_000;

/// What to do with a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Acceptance {
    /// It is the slot's value.
    Publish,
    /// The next one has to agree with it.
    Hold,
    /// It does not agree with the one before; the next one has to agree with it.
    Suspect,
}

/// What a slot demands of its values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Demands {
    /// Two values this close are the same, in µ°.
    pub resolution: u32,
    /// In 0.001°/s; [`NO_LIMIT`] allows any.
    pub max_rate: u32,
    /// A value older than this confirms nothing.
    pub life: Duration,
}

impl Demands {
    /// Whether an angle can have become the other within `us` microseconds.
    fn allow(&self, from: Angle, to: Angle, us: u64) -> bool {
        let moved = step(from, to).unsigned_abs().saturating_sub(self.resolution);
        let most = u64::from(self.max_rate).saturating_mul(us);
        self.max_rate == NO_LIMIT || u64::from(moved).saturating_mul(PER_MDEG_PER_S) <= most
    }

    fn agree(&self, one: Angle, other: Angle, us: u64) -> bool {
        self.holds(us) && self.allow(one, other, us)
    }

    /// Whether a value that came `us` microseconds ago can confirm another.
    fn holds(&self, us: u64) -> bool {
        us <= self.life.as_micros().into()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The next value needs no confirmation unless it jumps.
    Trusting,
    /// The next value needs a confirmation.
    Distrusting,
    /// The candidate waits for its confirmation.
    Waiting,
}

/// The plausibility check of one slot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plausibility {
    state: State,
    /// The candidate wants a confirmation out of turn, and the sensor has not been asked for it yet.
    wants_confirmation: bool,
    candidate: Angle,
    at: Stamp,
}

impl Plausibility {
    /// Nothing was read yet, or nothing for long.
    pub const NEW: Plausibility = Plausibility {
        state: State::Distrusting,
        wants_confirmation: false,
        candidate: Angle::ZERO,
        at: Stamp::of(Instant::ZERO),
    };

    /// No confirmation came: the sensor is not asked for it out of turn again.
    pub fn relax(&mut self) {
        self.wants_confirmation = false;
    }

    /// No answer came for long: the candidate confirms nothing any more.
    pub fn forget(&mut self) {
        self.wants_confirmation = false;
        if self.state == State::Waiting {
            self.state = State::Distrusting;
        }
    }

    /// Something was wrong with what was received.
    pub fn distrust(&mut self) {
        if self.state == State::Trusting {
            self.state = State::Distrusting;
        }
    }

    /// Whether the candidate wants a confirmation out of turn.
    pub fn wants_confirmation(&self) -> bool {
        self.wants_confirmation
    }

    /// The last value.
    pub fn candidate(&self) -> Angle {
        self.candidate
    }

    /// When the candidate came.
    pub fn since(&self, now: Instant) -> Instant {
        self.at.near(now)
    }

    /// A value came at `at`; `last` was published before.
    pub fn judge(
        &mut self,
        value: Angle,
        at: Instant,
        last: Option<(Angle, Instant)>,
        demands: &Demands,
    ) -> Acceptance {
        let waited = self.at.micros_ago(at);
        let acceptance = match self.state {
            State::Waiting if demands.agree(self.candidate, value, waited) => Acceptance::Publish,
            State::Waiting if demands.holds(waited) => Acceptance::Suspect,
            State::Waiting | State::Distrusting => Acceptance::Hold,
            State::Trusting => match last {
                Some((angle, then)) if demands.allow(angle, value, at.micros_since(then)) => {
                    Acceptance::Publish
                }
                _ => Acceptance::Hold,
            },
        };
        (self.candidate, self.at) = (value, Stamp::of(at));
        self.wants_confirmation = acceptance == Acceptance::Hold;
        self.state = if acceptance == Acceptance::Publish { State::Trusting } else { State::Waiting };
        acceptance
    }
}

#[cfg(test)]
mod tests;

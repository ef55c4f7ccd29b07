//! What a slot's last value is worth.

use clino_bus::Micros;
use clino_codec::angle::Angle;

use crate::Source;

/// Status of a slot. Only [`Status::Ok`] comes with an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// Nothing was read since reset.
    #[default]
    NeverRead,
    /// The angle is right and fresh.
    Ok,
    /// The last angle was right, but it is too old.
    Stale,
    /// The node did not answer in time.
    NoAnswer,
    /// Something came back that is not a valid answer.
    BadAnswer,
    /// The node answered that it cannot.
    DeviceError,
    /// The node answered with an angle outside its documented range.
    OutOfRange,
    /// Our own request did not get out.
    NotSent,
    /// The PWM input sits at a low level.
    StuckLow,
    /// The PWM input sits at a high level.
    StuckHigh,
    /// The PWM period is not that of an ISU.
    BadPeriod,
    /// The slot is switched off.
    Disabled,
}

impl Status {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Status::NeverRead => "never_read",
            Status::Ok => "ok",
            Status::Stale => "stale",
            Status::NoAnswer => "no_answer",
            Status::BadAnswer => "bad_answer",
            Status::DeviceError => "device_error",
            Status::OutOfRange => "out_of_range",
            Status::NotSent => "not_sent",
            Status::StuckLow => "stuck_low",
            Status::StuckHigh => "stuck_high",
            Status::BadPeriod => "bad_period",
            Status::Disabled => "disabled",
        }
    }
}

/// A slot as others see it: its source, and the last value with the means to judge it at any later time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Number of the slot.
    pub slot: u8,
    /// Where the value comes from.
    pub source: Source,
    /// Counts the outcomes, good or bad; wraps.
    pub sequence: u32,
    pub(crate) status: Status,
    pub(crate) angle: Angle,
    pub(crate) measured: Option<Micros>,
    pub(crate) stale_after: Micros,
    pub(crate) period: Micros,
    pub(crate) report_every: Micros,
}

impl Reading {
    /// What the value is worth at `now`: an *ok* that has grown too old is *stale*.
    pub fn status(&self, now: Micros) -> Status {
        match (self.status, self.age(now)) {
            (Status::Ok, Some(age)) if age <= self.stale_after => Status::Ok,
            (Status::Ok, _) => Status::Stale,
            (other, _) => other,
        }
    }

    /// The angle, if it is right and fresh at `now`.
    pub fn angle(&self, now: Micros) -> Option<Angle> {
        (self.status(now) == Status::Ok).then_some(self.angle)
    }

    /// Time since the last good value was received; `None` when there was none since reset.
    pub fn age(&self, now: Micros) -> Option<Micros> {
        self.measured.map(|at| now.since(at))
    }
}

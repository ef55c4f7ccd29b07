//! What a slot's last value is worth.

use clino_bus::{Duration, Instant};
use clino_codec::angle::Angle;

use crate::Source;
use crate::alarm::Alarms;
use crate::health::Health;

mod publication;

pub use publication::Published;

/// Status of a slot. Only [`Status::Ok`] comes with an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// The slot is switched off.
    Disabled,
    /// Nothing was read since reset, or since the slot or its sensor was set up anew.
    #[default]
    NeverRead,
    /// The angle is right and fresh.
    Ok,
    /// The last angle was right, but it is too old.
    Stale,
    /// The node did not answer in time.
    NoAnswer,
    /// Characters came back that are not a valid answer.
    BadAnswer,
    /// The node answered with an error.
    DeviceError,
    /// The node answered with an angle outside its documented range.
    OutOfRange,
    /// Our own request did not get out.
    NotSent,
    /// Two values in a row disagree; neither is published.
    Suspect,
    /// The PWM input has edges, but no whole cycle.
    NoSignal,
    /// The PWM input sits at a low level.
    StuckLow,
    /// The PWM input sits at a high level.
    StuckHigh,
    /// The PWM period is not that of an ISU.
    BadPeriod,
    /// The slot cannot be read as it is set: its source has no address, or its T7 does not measure the axis.
    ConfigFault,
}

impl Status {
    /// All of them, in the order of their numbers.
    pub const ALL: [Status; 15] = [
        Status::Disabled,
        Status::NeverRead,
        Status::Ok,
        Status::Stale,
        Status::NoAnswer,
        Status::BadAnswer,
        Status::DeviceError,
        Status::OutOfRange,
        Status::NotSent,
        Status::Suspect,
        Status::NoSignal,
        Status::StuckLow,
        Status::StuckHigh,
        Status::BadPeriod,
        Status::ConfigFault,
    ];

    /// The number in every numeric interface. It never changes its meaning.
    pub const fn code(self) -> u8 {
        match self {
            Status::NeverRead => 0,
            Status::Ok => 1,
            Status::Stale => 2,
            Status::NoAnswer => 3,
            Status::BadAnswer => 4,
            Status::DeviceError => 5,
            Status::OutOfRange => 6,
            Status::NotSent => 7,
            Status::NoSignal => 8,
            Status::StuckLow => 9,
            Status::StuckHigh => 10,
            Status::BadPeriod => 11,
            Status::Suspect => 12,
            Status::Disabled => 13,
            Status::ConfigFault => 14,
        }
    }

    /// What it means, for the documentation.
    pub const fn meaning(self) -> &'static str {
        match self {
            Status::NeverRead => "nothing was read since reset",
            Status::Ok => "the angle is right and fresh",
            Status::Stale => "the last angle was right, but it is too old",
            Status::NoAnswer => "the node did not answer in time",
            Status::BadAnswer => "characters came back that are not a valid answer",
            Status::DeviceError => "the node answered with an error",
            Status::OutOfRange => "the angle is outside its documented range",
            Status::NotSent => "the gateway's own request did not get out",
            Status::NoSignal => "a PWM input without a signal",
            Status::StuckLow => "the PWM input sits at a low level",
            Status::StuckHigh => "the PWM input sits at a high level",
            Status::BadPeriod => "the PWM period is not that of an ISU",
            Status::Suspect => "two values in a row disagree; neither is published",
            Status::Disabled => "the slot is switched off, or unused",
            Status::ConfigFault => {
                "the slot cannot be read as it is set: no address of its kind, or an axis that its T7 lacks"
            }
        }
    }

    /// Whether the last attempt brought a sign of life from the sensor, be it a wrong one.
    pub const fn is_online(self) -> bool {
        matches!(
            self,
            Status::Ok
                | Status::BadAnswer
                | Status::DeviceError
                | Status::OutOfRange
                | Status::BadPeriod
                | Status::Suspect
                | Status::ConfigFault
        )
    }

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
            Status::Suspect => "suspect",
            Status::NoSignal => "no_signal",
            Status::StuckLow => "stuck_low",
            Status::StuckHigh => "stuck_high",
            Status::BadPeriod => "bad_period",
            Status::ConfigFault => "config_fault",
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
    /// Whether the slot is read at all.
    pub enabled: bool,
    /// Counts the outcomes, good or bad; wraps.
    pub sequence: u32,
    /// Signals of the cross-checks.
    pub health: Health,
    /// The state of its alarms.
    pub alarms: Alarms,
    pub(crate) fresh: bool,
    pub(crate) status: Status,
    pub(crate) raw: Angle,
    pub(crate) angle: Published,
    pub(crate) rate: i32,
    pub(crate) turns: i32,
    pub(crate) temperature: Option<i16>,
    pub(crate) measured: Option<Instant>,
    pub(crate) stale_after: Duration,
    pub(crate) period: Duration,
    pub(crate) report_every: Duration,
}

/// The parts of a reading that decide whether it is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadingBrief {
    /// What the value is worth.
    pub status: Status,
    /// Counts the outcomes.
    pub sequence: u32,
    /// The state of its alarms.
    pub alarms: Alarms,
    /// From one reading to the next, at most.
    pub period: Duration,
    /// Least time between two printed lines while the status stays.
    pub report_every: Duration,
}

impl Reading {
    /// The least of it, as of `now`.
    pub fn brief(&self, now: Instant) -> ReadingBrief {
        let Reading { sequence, alarms, period, report_every, .. } = *self;
        ReadingBrief { status: self.status(now), sequence, alarms, period, report_every }
    }

    /// What the value is worth at `now`: an *ok* that has grown too old is *stale*.
    #[inline(never)]
    pub fn status(&self, now: Instant) -> Status {
        match (self.status, self.measured) {
            (Status::Ok, Some(at)) if now <= at + self.stale_after => Status::Ok,
            (Status::Ok, _) => Status::Stale,
            (other, _) => other,
        }
    }

    /// The angle as it is published, if it is right and fresh at `now`.
    #[inline(never)]
    pub fn angle(&self, now: Instant) -> Option<Published> {
        (self.status(now) == Status::Ok).then_some(self.angle)
    }

    /// The angle as the sensor said it, under the same condition: not rounded yet ([`Published::of_sensor`]).
    #[inline(never)]
    pub fn raw(&self, now: Instant) -> Option<Angle> {
        (self.status(now) == Status::Ok).then_some(self.raw)
    }

    /// How fast the angle changes, in 0.001°/s, under the same condition; between the last two angles that the sensor
    /// measured anew.
    #[inline(never)]
    pub fn rate(&self, now: Instant) -> Option<i32> {
        (self.status(now) == Status::Ok).then_some(self.rate)
    }

    /// Whole turns since the first angle, to be added to [`Reading::angle`]; wraps.
    pub fn turns(&self) -> i32 {
        self.turns
    }

    /// The angle with its turns, in 0.001°, under the same condition; `None` where that does not fit, beyond 5 965
    /// turns.
    pub fn unwrapped(&self, now: Instant) -> Option<i32> {
        self.angle(now)?.unwrapped(self.turns)
    }

    /// Temperature of a T7 that is asked for everything, with its last good value, in 0.01 °C.
    pub fn temperature(&self) -> Option<i16> {
        self.temperature
    }

    /// Whether the last good value was measured anew. An ISU that is asked twice within one refresh repeats itself.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// Time since the last good value was received, in milliseconds; `None` when there was none since reset.
    #[inline(never)]
    pub fn age_ms(&self, now: Instant) -> Option<u64> {
        self.measured.map(|at| now.millis_since(at))
    }
}

//! The alarms of a slot: their states, by the limits in [`AlarmConfig`].
//!
//! ```text
//!            condition lasts for the delay          ends (hysteresis)
//!   quiet ─────────────────────────────▶ active ─────────────────────▶ quiet
//!                                          │  ▲     latching: ─▶ unacknowledged ─ acknowledge ─▶ quiet
//!                              acknowledge │  │ condition holds again
//!                                          ▼  │
//!                                       active, acknowledged ── ends ─▶ quiet
//! ```
//!
//! | alarm | raised when | ends when |
//! |---|---|---|
//! | *high* | angle > high | angle ≤ high − hysteresis |
//! | *low* | angle < low | angle ≥ low + hysteresis |
//! | *rate* | rate beyond `alarm_rate`, either way | it is within |
//! | *no_value* | no right and fresh angle for longer than `no_value` | the next one comes |
//!
//! The angle is the published one: filtered, in the slot's range. Limits do not reach across the end of the range.
//! While there is no right angle, *high*, *low* and *rate* stay what they are: no value raises them and none ends them;
//! *no_value* reports the gap. A condition has to hold in every value for the whole delay; a gap in the values begins
//! it anew.
//!
//! An alarm that waits for its acknowledgement is active again at once when its condition holds again, and keeps its
//! first time. When the sensor's numbers mean something else (a new zero, another sensor), *high*, *low* and *rate*
//! end; what latches still waits for its acknowledgement. States are not stored: they begin anew with a reset.

use clino_bus::{Duration, Instant};

use crate::config::AlarmConfig;
use crate::stamp::{Halves, Stamp};

/// An alarm. The numbers are those of the bits in [`Alarms`], and part of the register map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Alarm {
    /// The angle is above its high limit.
    High = 0,
    /// The angle is below its low limit.
    Low = 1,
    /// The angle changes too fast.
    Rate = 2,
    /// There is no right and fresh angle.
    NoValue = 3,
}

/// How many alarms a slot has.
pub const ALARMS: usize = 4;

impl Alarm {
    /// All of them, by their numbers, with what they mean.
    pub const ALL: [(Alarm, &str, &str); ALARMS] = [
        (Alarm::High, "high", "the angle is above its high limit"),
        (Alarm::Low, "low", "the angle is below its low limit"),
        (Alarm::Rate, "rate", "the angle changes faster than its limit"),
        (Alarm::NoValue, "no_value", "no right and fresh angle for longer than allowed"),
    ];

    /// All of them, by their numbers.
    pub const EACH: [Alarm; ALARMS] = [Alarm::High, Alarm::Low, Alarm::Rate, Alarm::NoValue];

    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Alarm::High => "high",
            Alarm::Low => "low",
            Alarm::Rate => "rate",
            Alarm::NoValue => "no_value",
        }
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// The state of a slot's alarms: active ones in bits 0 to 3, unacknowledged ones in bits 4 to 7, by [`Alarm`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Alarms(u8);

/// The unacknowledged half.
const UNACKNOWLEDGED: u32 = 4;

/// The state of one alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmState {
    /// Its condition does not hold, and nothing waits for an acknowledgement.
    Quiet,
    /// Its condition holds, and it is not acknowledged.
    Active,
    /// Its condition holds, and it is acknowledged.
    Acknowledged,
    /// Its condition has ended; it latches and is not acknowledged.
    Unacknowledged,
}

impl AlarmState {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            AlarmState::Quiet => "quiet",
            AlarmState::Active => "active",
            AlarmState::Acknowledged => "acknowledged",
            AlarmState::Unacknowledged => "unacknowledged",
        }
    }
}

impl Alarms {
    /// All quiet.
    pub const QUIET: Alarms = Alarms(0);

    /// As bits.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// From [`Alarms::bits`].
    pub const fn from_bits(bits: u8) -> Alarms {
        Alarms(bits)
    }

    /// The state of one.
    pub const fn state(self, alarm: Alarm) -> AlarmState {
        match (self.is_active(alarm), self.is_unacknowledged(alarm)) {
            (false, false) => AlarmState::Quiet,
            (true, true) => AlarmState::Active,
            (true, false) => AlarmState::Acknowledged,
            (false, true) => AlarmState::Unacknowledged,
        }
    }

    /// Whether all are quiet.
    pub const fn is_quiet(self) -> bool {
        self.0 == 0
    }

    /// The first alarm whose state is not the same in both.
    pub fn first_change(self, other: Alarms) -> Option<Alarm> {
        let changed = |alarm: &Alarm| self.state(*alarm) != other.state(*alarm);
        Alarm::EACH.into_iter().find(changed)
    }

    /// The same, with the state of this one taken from `other`.
    #[must_use]
    pub const fn with(self, alarm: Alarm, other: Alarms) -> Alarms {
        let both = alarm.bit() | alarm.bit() << UNACKNOWLEDGED;
        Alarms(self.0 & !both | other.0 & both)
    }

    const fn is_active(self, alarm: Alarm) -> bool {
        self.0 & alarm.bit() != 0
    }

    const fn is_unacknowledged(self, alarm: Alarm) -> bool {
        self.0 & alarm.bit() << UNACKNOWLEDGED != 0
    }

    fn raise(&mut self, alarm: Alarm) {
        self.0 |= alarm.bit() | alarm.bit() << UNACKNOWLEDGED;
    }

    fn end(&mut self, alarm: Alarm, latching: bool) {
        self.0 &= !alarm.bit();
        if !latching {
            self.0 &= !(alarm.bit() << UNACKNOWLEDGED);
        }
    }

    fn acknowledge(&mut self) {
        self.0 &= (1 << UNACKNOWLEDGED) - 1;
    }
}

/// What is known of an alarm that is not quiet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlarmDetail {
    /// Its state.
    pub state: AlarmState,
    /// How long ago it was raised first, since it was quiet last, in milliseconds.
    pub age_ms: u64,
    /// The angle (0.001°) or the rate (0.001°/s) furthest beyond its limit; *no_value* has none.
    pub extreme: Option<i32>,
}

/// The alarms of one slot. 38 bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Watch {
    alarms: Alarms,
    /// Conditions that hold and have not lasted for the delay, a bit each.
    pending: u8,
    /// When the condition of each began, or when it was raised.
    since: [Stamp; ALARMS],
    /// The angle or the rate furthest beyond the limit, in 0.001° or 0.001°/s. *no_value*, the last one, has none.
    extremes: [Halves; ALARMS - 1],
}

impl Watch {
    /// The state of all.
    pub fn alarms(&self) -> Alarms {
        self.alarms
    }

    /// What is known of one at `now`; `None` while it is quiet.
    pub fn detail(&self, alarm: Alarm, now: Instant) -> Option<AlarmDetail> {
        let state = self.alarms.state(alarm);
        let since = self.since.get(alarm as usize).filter(|_| state != AlarmState::Quiet)?;
        let extreme = self.extremes.get(alarm as usize).map(|extreme| extreme.get());
        Some(AlarmDetail { state, age_ms: now.millis_since(since.near(now)), extreme })
    }

    /// A right angle (0.001°) and its rate (0.001°/s) came at `at`; after a `gap` in the values conditions begin anew.
    pub fn take(&mut self, config: &AlarmConfig, angle: i32, rate: i32, at: Instant, gap: bool) {
        if gap {
            self.pending = 0;
        }
        let hysteresis = i32::try_from(config.hysteresis).unwrap_or(i32::MAX);
        let (high, low) = (config.limits.has_high(), config.limits.has_low());
        let falls = angle > config.high.saturating_sub(hysteresis);
        let rises = angle < config.low.saturating_add(hysteresis);
        self.judge(config, Alarm::High, high && angle > config.high, high && falls, angle, at);
        self.judge(config, Alarm::Low, low && angle < config.low, low && rises, angle, at);
        let fast = config.rate > 0 && rate.unsigned_abs() > config.rate;
        self.judge(config, Alarm::Rate, fast, fast, rate, at);
        self.end(config, Alarm::NoValue);
    }

    /// An alarm is raised when `holds` for the delay, and stays while `stays`.
    fn judge(
        &mut self,
        config: &AlarmConfig,
        alarm: Alarm,
        holds: bool,
        stays: bool,
        value: i32,
        at: Instant,
    ) {
        let record = self.since.get_mut(alarm as usize).zip(self.extremes.get_mut(alarm as usize));
        let Some((since, extreme)) = record else { return };
        if self.alarms.is_active(alarm) {
            if !stays {
                self.end(config, alarm);
            } else if is_further(alarm, value, extreme.get()) {
                *extreme = Halves::of(value);
            }
            return;
        }
        if !holds {
            self.pending &= !alarm.bit();
            return;
        }
        // One that waits for its acknowledgement has been an alarm already.
        if self.alarms.is_unacknowledged(alarm) {
            if is_further(alarm, value, extreme.get()) {
                *extreme = Halves::of(value);
            }
            self.alarms.raise(alarm);
            return;
        }
        if self.pending & alarm.bit() == 0 {
            self.pending |= alarm.bit();
            (*since, *extreme) = (Stamp::of(at), Halves::of(value));
        } else if is_further(alarm, value, extreme.get()) {
            *extreme = Halves::of(value);
        }
        if at.since(since.near(at)) >= tenths(config.delay) {
            *since = Stamp::of(at);
            self.pending &= !alarm.bit();
            self.alarms.raise(alarm);
        }
    }

    fn end(&mut self, config: &AlarmConfig, alarm: Alarm) {
        self.pending &= !alarm.bit();
        self.alarms.end(alarm, config.latching);
    }

    /// Time passes without a right and fresh angle; the last one came at `measured`, if one did. Returns whether
    /// *no_value* is raised now.
    pub fn miss(&mut self, config: &AlarmConfig, measured: Option<Instant>, now: Instant) -> bool {
        let alarm = Alarm::NoValue;
        let Some(since) = self.since.get_mut(alarm as usize) else { return false };
        if config.no_value == 0 || self.alarms.is_active(alarm) {
            return false;
        }
        if self.pending & alarm.bit() == 0 {
            self.pending |= alarm.bit();
            if !self.alarms.is_unacknowledged(alarm) {
                *since = Stamp::of(now);
            }
        }
        let last = measured.unwrap_or_else(|| since.near(now));
        if now.since(last) <= tenths(config.no_value) {
            return false;
        }
        if !self.alarms.is_unacknowledged(alarm) {
            *since = Stamp::of(now);
        }
        self.pending &= !alarm.bit();
        self.alarms.raise(alarm);
        true
    }

    /// What waits for an acknowledgement has it. Returns whether something did.
    pub fn acknowledge(&mut self) -> bool {
        let before = self.alarms;
        self.alarms.acknowledge();
        self.alarms != before
    }

    /// Something else is watched now: what is watched as before stays as it is, the rest ends.
    pub fn change(&mut self, from: &AlarmConfig, to: &AlarmConfig) {
        let (one, other) = (from.limits, to.limits);
        let stays = [
            (Alarm::High, one.has_high() == other.has_high() && from.high == to.high),
            (Alarm::Low, one.has_low() == other.has_low() && from.low == to.low),
            (Alarm::Rate, from.rate == to.rate),
            (Alarm::NoValue, from.no_value == to.no_value),
        ];
        for (alarm, _) in stays.into_iter().filter(|(_, stays)| !stays) {
            self.end(to, alarm);
        }
    }

    /// The sensor's numbers mean something else now.
    pub fn restart(&mut self, config: &AlarmConfig) {
        for alarm in [Alarm::High, Alarm::Low, Alarm::Rate] {
            self.end(config, alarm);
        }
    }
}

/// Whether a value lies further beyond the limit of an alarm than another.
fn is_further(alarm: Alarm, value: i32, than: i32) -> bool {
    match alarm {
        Alarm::High => value > than,
        Alarm::Low => value < than,
        Alarm::Rate => value.unsigned_abs() > than.unsigned_abs(),
        Alarm::NoValue => false,
    }
}

/// A tenth of a second.
const TENTH: Duration = Duration::from_millis(100);

/// The settings allow at most an hour, which a duration holds.
fn tenths(count: u16) -> Duration {
    TENTH.times(count.into())
}

#[cfg(test)]
mod tests;

//! What a slot's alarms watch: set like everything else of a slot, off as delivered. What comes of it is in `alarm.rs`.

/// Which limits of the angle raise an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlarmLimits {
    /// None.
    #[default]
    Off,
    /// The high one.
    High,
    /// The low one.
    Low,
    /// Both.
    Both,
}

impl AlarmLimits {
    /// The names used in every text interface, by their codes.
    pub const NAMES: &'static [&'static str] = &["off", "high", "low", "both"];

    /// The limits with this code; [`AlarmLimits::Off`] if there are none.
    pub const fn from_code(code: i64) -> AlarmLimits {
        match code {
            1 => AlarmLimits::High,
            2 => AlarmLimits::Low,
            3 => AlarmLimits::Both,
            _ => AlarmLimits::Off,
        }
    }

    /// Whether the high limit is among them.
    pub const fn has_high(self) -> bool {
        matches!(self, AlarmLimits::High | AlarmLimits::Both)
    }

    /// Whether the low limit is among them.
    pub const fn has_low(self) -> bool {
        matches!(self, AlarmLimits::Low | AlarmLimits::Both)
    }
}

/// The alarm settings of a slot. 24 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlarmConfig {
    /// An angle above this raises the alarm *high*, in 0.001°, as the slot publishes it.
    pub high: i32,
    /// An angle below this raises the alarm *low*, in 0.001°.
    pub low: i32,
    /// How far the angle has to return behind its limit before the alarm ends, in 0.001°.
    pub hysteresis: u32,
    /// A rate beyond this, in either sense, raises the alarm *rate*, in 0.001°/s; zero: none does.
    pub rate: u32,
    /// How long a condition has to last before it is an alarm, in 0.1 s.
    pub delay: u16,
    /// No right and fresh angle for longer than this raises the alarm *no_value*, in 0.1 s; zero: never.
    pub no_value: u16,
    /// Which limits count.
    pub limits: AlarmLimits,
    /// An alarm stays until it is acknowledged.
    pub latching: bool,
}

impl AlarmConfig {
    /// Nothing is watched.
    pub const OFF: AlarmConfig = AlarmConfig {
        high: 0,
        low: 0,
        hysteresis: 0,
        rate: 0,
        delay: 0,
        no_value: 0,
        limits: AlarmLimits::Off,
        latching: false,
    };

    /// Whether anything is watched.
    pub const fn is_on(&self) -> bool {
        !matches!(self.limits, AlarmLimits::Off) || self.rate > 0 || self.no_value > 0
    }
}

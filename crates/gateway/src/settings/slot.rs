//! Settings of a slot, and the result of a change.
//!
//! The settings of a slot are one value: [`changed`] makes it of the old one and of what a change names, [`check`] says
//! whether it can be. Rules:
//!
//! - Another kind brings its usual settings ([`SlotConfig::usual`]) for all that the change does not name. An unused slot
//!   keeps all its settings, so that kind, address and the rest may come in any order.
//! - The address stays when the kind changes. A kind without such an address is held and reported, not read.
//! - A stale limit that is not set follows period and timeout; one that is set has to fit them.
//! - What the kind does not have ([`applies`]) is held without effect.

use clino_bus::Duration;
use clino_codec::angle::{Angle, Range};
use clino_codec::t7;

use super::setting::{Definition, Form, Given, NO_SLOT, Named, Setting, Shown, Tabled, change, names};
use crate::config::{AlarmLimits, Ask, Direction, Filter, Kind, PWM_PERIOD, SINGLE_AXIS, SlotConfig, Source};
use crate::refusal::{Number, Refusal};

/// The settings' numbers in the stored record. A number is never given to another setting.
pub mod id {
    #![allow(missing_docs, reason = "the table says what each is")]
    pub const KIND: u8 = 1;
    pub const ADDRESS: u8 = 2;
    pub const AXIS: u8 = 3;
    pub const ENABLED: u8 = 4;
    pub const ASK: u8 = 5;
    pub const PERIOD: u8 = 6;
    pub const TIMEOUT: u8 = 7;
    pub const RETRIES: u8 = 8;
    pub const STALE: u8 = 9;
    pub const REPORT: u8 = 10;
    pub const CONFIRM: u8 = 11;
    pub const FILTER: u8 = 12;
    pub const SAMPLES: u8 = 13;
    pub const ZERO: u8 = 14;
    pub const DIRECTION: u8 = 15;
    pub const RANGE: u8 = 16;
    pub const RATE: u8 = 17;
    pub const PARTNER: u8 = 18;
    pub const TOLERANCE: u8 = 19;
    pub const STALE_AUTO: u8 = 20;
    /// Four characters each.
    pub const NAME: [u8; 4] = [21, 22, 23, 24];
    pub const ALARM: u8 = 25;
    pub const HIGH: u8 = 26;
    pub const LOW: u8 = 27;
    pub const HYSTERESIS: u8 = 28;
    pub const DELAY: u8 = 29;
    pub const LATCH: u8 = 30;
    pub const ALARM_RATE: u8 = 31;
    pub const NO_VALUE: u8 = 32;
}

/// Longest period: twenty minutes.
pub const LONGEST_PERIOD: Duration = Duration::from_micros(1_200_000_000);
/// Longest age of a good value: an hour, three of the longest periods.
pub const LONGEST_STALE: Duration = Duration::from_micros(3_600_000_000);
/// Shortest age at which a value may be called stale: a slower T7 answers within 25 ms, µs.
const SHORTEST_STALE: i64 = 10_000;
/// Longest time allowed for an answer to begin: the only one an ISU's document knows, 400 ms (AN #201 section 4), and
/// room, µs.
const LONGEST_TIMEOUT: i64 = 500_000;
/// Most tries of one reading after the first.
const MOST_RETRIES: i64 = 10;
/// A turn: a soft zero beyond it says nothing new, µ°.
const TURN: i64 = 360_000_000;
/// A hundred turns a second: no inclinometer follows, 0.001°/s.
const LARGEST_RATE: i64 = 36_000_000;
/// A turn: no angle is published beyond it, 0.001°.
const TURN_MDEG: i64 = 360_000;
/// Longest delay of an alarm, and longest time without a value that is none: an hour, 0.1 s.
const LONGEST_DELAY: i64 = 36_000;
/// The highest address of all kinds: a T7 as it leaves the factory.
const HIGHEST_ADDRESS: i64 = 127;

/// What a T7 is allowed before it answers (T7 guide section 1): shorter timeouts refuse good answers.
const T7_LATENCY: Duration = Duration::from_millis(2);
/// An ISU raises its driver 1 ms before its first bit (AN #201 section 2, TXEN).
const ISU_LATENCY: Duration = Duration::from_millis(1);

const fn ms(least: i64, most: i64) -> Form {
    thousandths(least, most)
}

const fn thousandths(least: i64, most: i64) -> Form {
    Form::number(least, most, 3)
}

const fn whole(least: i64, most: i64) -> Form {
    Form::number(least, most, 0)
}

/// Four characters of the name.
const fn name(
    id: u8,
    name: &'static str,
    get: fn(&SlotConfig) -> i64,
    set: fn(&mut SlotConfig, i64),
) -> Setting<SlotConfig> {
    Setting {
        definition: Definition {
            id,
            name,
            unit: "",
            form: Form::Characters,
            text: "name of the slot: 16 printable ASCII characters, four in each number",
        },
        get,
        set,
    }
}

/// The table, for use in constants.
pub const TABLE: [Setting<SlotConfig>; 32] = [
    Setting {
        definition: Definition {
            id: id::KIND,
            name: "kind",
            unit: "",
            form: Form::Choice(Kind::NAMES),
            text: "kind of source; another kind brings its default settings",
        },
        get: |c| c.source.kind() as i64,
        set: |c, v| c.source = Source::held(kind(v), c.source.address(), c.axis()),
    },
    Setting {
        definition: Definition {
            id: id::ADDRESS,
            name: "address",
            unit: "",
            form: whole(0, HIGHEST_ADDRESS),
            text: "T7: 1 to 100, 127; ISU: 1 to 14, 0 if it is alone; PWM: input 1 or 2",
        },
        get: |c| c.source.address().into(),
        set: |c, v| c.source = Source::of(c.source.kind(), v as u8, c.axis()),
    },
    Setting {
        definition: Definition {
            id: id::AXIS,
            name: "axis",
            unit: "",
            form: whole(0, 2),
            text: "axis of a T7; a single-axis device measures axis 2",
        },
        get: |c| c.axis().get().into(),
        set: |c, v| c.set_axis(t7::Axis::new(v as u8).unwrap_or(c.axis())),
    },
    Setting {
        definition: Definition {
            id: id::ENABLED,
            name: "enabled",
            unit: "",
            form: Form::Flag,
            text: "1: the slot is read",
        },
        get: |c| c.enabled.into(),
        set: |c, v| c.enabled = v != 0,
    },
    Setting {
        definition: Definition {
            id: id::ASK,
            name: "ask",
            unit: "",
            form: Form::Choice(&["angle", "everything"]),
            text: "T7: everything also reads temperature and gravity",
        },
        get: |c| (c.ask == Ask::Everything).into(),
        set: |c, v| c.ask = if v == 0 { Ask::Angle } else { Ask::Everything },
    },
    Setting {
        definition: Definition {
            id: id::PERIOD,
            name: "period",
            unit: "ms",
            form: ms(0, LONGEST_PERIOD.as_micros() as i64),
            text: "time from one reading to the next; 0: as often as the bus allows",
        },
        get: |c| c.period.as_micros().into(),
        set: |c, v| c.period = Duration::from_micros(v as u32),
    },
    Setting {
        definition: Definition {
            id: id::TIMEOUT,
            name: "timeout",
            unit: "ms",
            form: ms(0, LONGEST_TIMEOUT),
            text: "longest wait for an answer; 0: the limit of the sensor's document",
        },
        get: |c| c.timeout.as_micros().into(),
        set: |c, v| c.timeout = Duration::from_micros(v as u32),
    },
    Setting {
        definition: Definition {
            id: id::RETRIES,
            name: "retries",
            unit: "",
            form: whole(0, MOST_RETRIES),
            text: "further tries within one reading",
        },
        get: |c| c.retries.into(),
        set: |c, v| c.retries = v as u8,
    },
    Setting {
        definition: Definition {
            id: id::STALE,
            name: "stale",
            unit: "ms",
            form: ms(SHORTEST_STALE, LONGEST_STALE.as_micros() as i64),
            text: "a value older than this is stale",
        },
        get: |c| c.stale_after().as_micros().into(),
        set: |c, v| c.stale = Duration::from_micros(v as u32),
    },
    Setting {
        definition: Definition {
            id: id::STALE_AUTO,
            name: "stale_auto",
            unit: "",
            form: Form::Flag,
            text: "1: stale follows, three times the longer of period and timeout; 0: stale keeps the value that was set",
        },
        get: |c| (c.stale == Duration::ZERO).into(),
        set: |c, v| c.stale = if v == 0 { c.stale_after() } else { Duration::ZERO },
    },
    Setting {
        definition: Definition {
            id: id::REPORT,
            name: "report",
            unit: "ms",
            form: ms(0, LONGEST_STALE.as_micros() as i64),
            text: "shortest time between two lines of the stream while the status stays the same",
        },
        get: |c| c.report_every.as_micros().into(),
        set: |c, v| c.report_every = Duration::from_micros(v as u32),
    },
    Setting {
        definition: Definition {
            id: id::CONFIRM,
            name: "confirm",
            unit: "",
            form: Form::Flag,
            text: "1: the first value, a value after an error and a jump are read twice",
        },
        get: |c| c.confirm.into(),
        set: |c, v| c.confirm = v != 0,
    },
    Setting {
        definition: Definition {
            id: id::FILTER,
            name: "filter",
            unit: "",
            form: Form::Choice(&["off", "mean", "median"]),
            text: "circular mean or median of the last angles",
        },
        get: |c| c.filter as i64,
        set: |c, v| c.filter = filter(v),
    },
    Setting {
        definition: Definition {
            id: id::SAMPLES,
            name: "samples",
            unit: "",
            form: whole(1, Filter::MOST as i64),
            text: "number of angles in the filter",
        },
        get: |c| c.samples.into(),
        set: |c, v| c.samples = v as u8,
    },
    Setting {
        definition: Definition {
            id: id::ZERO,
            name: "zero",
            unit: "deg",
            form: Form::number(-TURN, TURN, 6),
            text: "soft zero: subtracted from the angle of the sensor",
        },
        get: |c| c.soft_zero.udeg().into(),
        set: |c, v| c.soft_zero = Angle::from_udeg(v as i32),
    },
    Setting {
        definition: Definition {
            id: id::DIRECTION,
            name: "direction",
            unit: "",
            form: Form::Choice(&["normal", "reversed"]),
            text: "reversed: the angle counts the other way",
        },
        get: |c| (c.direction == Direction::Reversed).into(),
        set: |c, v| c.direction = if v == 0 { Direction::Normal } else { Direction::Reversed },
    },
    Setting {
        definition: Definition {
            id: id::RANGE,
            name: "range",
            unit: "",
            form: Form::Choice(&["bidirectional", "unidirectional"]),
            text: "bidirectional: −180° to 180°; unidirectional: 0° to 360°",
        },
        get: |c| (c.range == Range::Unidirectional).into(),
        set: |c, v| c.range = if v == 0 { Range::Bidirectional } else { Range::Unidirectional },
    },
    Setting {
        definition: Definition {
            id: id::RATE,
            name: "rate",
            unit: "deg/s",
            form: Form::number(0, LARGEST_RATE, 3),
            text: "a faster change is a jump; 0: none is",
        },
        get: |c| c.max_rate.into(),
        set: |c, v| c.max_rate = v as u32,
    },
    Setting {
        definition: Definition {
            id: id::PARTNER,
            name: "partner",
            unit: "",
            form: Form::Slot,
            text: "PWM: the slot that reads the same ISU on its serial line; none: no comparison",
        },
        get: |c| c.partner.map_or(NO_SLOT, i64::from),
        set: |c, v| c.partner = u8::try_from(v).ok(),
    },
    Setting {
        definition: Definition {
            id: id::TOLERANCE,
            name: "tolerance",
            unit: "",
            form: Form::number(0, u16::MAX as i64, 3),
            text: "PWM: difference to its partner, deg; T7 asked for everything: deviation from 1 g, g",
        },
        get: |c| c.tolerance.into(),
        set: |c, v| c.tolerance = v as u16,
    },
    Setting {
        definition: Definition {
            id: id::ALARM,
            name: "alarm",
            unit: "",
            form: Form::Choice(AlarmLimits::NAMES),
            text: "limits of the angle that raise an alarm",
        },
        get: |c| c.alarm.limits as i64,
        set: |c, v| c.alarm.limits = AlarmLimits::from_code(v),
    },
    Setting {
        definition: Definition {
            id: id::HIGH,
            name: "high",
            unit: "deg",
            form: thousandths(-TURN_MDEG, TURN_MDEG),
            text: "an angle above this raises the alarm high",
        },
        get: |c| c.alarm.high.into(),
        set: |c, v| c.alarm.high = v as i32,
    },
    Setting {
        definition: Definition {
            id: id::LOW,
            name: "low",
            unit: "deg",
            form: thousandths(-TURN_MDEG, TURN_MDEG),
            text: "an angle below this raises the alarm low",
        },
        get: |c| c.alarm.low.into(),
        set: |c, v| c.alarm.low = v as i32,
    },
    Setting {
        definition: Definition {
            id: id::HYSTERESIS,
            name: "hysteresis",
            unit: "deg",
            form: thousandths(0, TURN_MDEG),
            text: "distance by which the angle returns behind its limit before the alarm ends",
        },
        get: |c| c.alarm.hysteresis.into(),
        set: |c, v| c.alarm.hysteresis = v as u32,
    },
    Setting {
        definition: Definition {
            id: id::DELAY,
            name: "delay",
            unit: "s",
            form: Form::number(0, LONGEST_DELAY, 1),
            text: "an angle or a rate beyond its limit for less than this raises no alarm",
        },
        get: |c| c.alarm.delay.into(),
        set: |c, v| c.alarm.delay = v as u16,
    },
    Setting {
        definition: Definition {
            id: id::LATCH,
            name: "latch",
            unit: "",
            form: Form::Flag,
            text: "1: an alarm stays until it is acknowledged; 0: it ends with its cause",
        },
        get: |c| c.alarm.latching.into(),
        set: |c, v| c.alarm.latching = v != 0,
    },
    Setting {
        definition: Definition {
            id: id::ALARM_RATE,
            name: "alarm_rate",
            unit: "deg/s",
            form: thousandths(0, LARGEST_RATE),
            text: "a faster turn, either way, raises the alarm rate; 0: none does",
        },
        get: |c| c.alarm.rate.into(),
        set: |c, v| c.alarm.rate = v as u32,
    },
    Setting {
        definition: Definition {
            id: id::NO_VALUE,
            name: "no_value",
            unit: "s",
            form: Form::number(0, LONGEST_DELAY, 1),
            text: "no right and fresh angle for longer than this raises the alarm no_value; 0: never",
        },
        get: |c| c.alarm.no_value.into(),
        set: |c, v| c.alarm.no_value = v as u16,
    },
    name(id::NAME[0], "name", |c| c.name.part(0).into(), |c, v| c.name.set_part(0, v as u32)),
    name(id::NAME[1], "name_2", |c| c.name.part(1).into(), |c, v| c.name.set_part(1, v as u32)),
    name(id::NAME[2], "name_3", |c| c.name.part(2).into(), |c, v| c.name.set_part(2, v as u32)),
    name(id::NAME[3], "name_4", |c| c.name.part(3).into(), |c, v| c.name.set_part(3, v as u32)),
];

/// The table.
pub static SETTINGS: [Setting<SlotConfig>; 32] = TABLE;

/// The names of the table's settings, in its order; a text stands for its parts.
pub static NAMES: [&str; 29] = names(&TABLE);

/// The setting with this number.
pub fn setting(id: u8) -> Option<&'static Setting<SlotConfig>> {
    SETTINGS.iter().find(|setting| setting.id == id)
}

/// Whether a setting has an effect on a slot of this kind.
pub const fn applies(id: u8, kind: Kind) -> bool {
    match (id, kind) {
        (id::ADDRESS, Kind::Off) => false,
        (id::AXIS | id::ASK, _) => matches!(kind, Kind::T7),
        (id::TIMEOUT | id::RETRIES, Kind::Pwm) => false,
        (id::PARTNER, _) => matches!(kind, Kind::Pwm | Kind::Off),
        (id::TOLERANCE, Kind::Isu) => false,
        _ => true,
    }
}

/// Whether two slots differ in this setting.
pub fn differs(setting: &Setting<SlotConfig>, one: &SlotConfig, other: &SlotConfig) -> bool {
    match setting.id {
        // A limit that follows is not set.
        id::STALE => one.stale != other.stale,
        id::STALE_AUTO => false,
        _ => (setting.get)(one) != (setting.get)(other),
    }
}

/// The slot that comes of a change.
///
/// # Errors
/// A value that its setting does not have, or that does not fit another.
pub fn changed(now: &SlotConfig, named: Named<'_>) -> Result<SlotConfig, Refusal> {
    let kind = named(id::KIND).map(|given| given.value).filter(|&code| code != now.source.kind() as i64);
    let mut config = match kind {
        Some(code) => {
            if let Some(setting) = setting(id::KIND) {
                setting.check(code)?;
            }
            of_another_kind(now, self::kind(code))
        }
        None => *now,
    };
    check_address(&config, named)?;
    change(&mut Tabled::new(&SETTINGS, &mut config), named)?;
    // A named address is meant, even if it looks like none; a whole block that is written back changes nothing.
    let says_something = kind.is_some() || named(id::KIND).is_none();
    if let (Some(Given { value, .. }), true) = (named(id::ADDRESS), says_something) {
        config.source = Source::of(config.source.kind(), value as u8, config.axis());
    }
    // A limit that is named with the period may be the one that follows from it; named alone, it is meant.
    if let (Some(given), None, None) = (named(id::STALE), named(id::PERIOD), named(id::STALE_AUTO)) {
        config.stale = Duration::from_micros(u32::try_from(given.exact()).unwrap_or(u32::MAX));
    }
    check(&config)?;
    Ok(config)
}

/// A slot that reads another kind from now on.
fn of_another_kind(now: &SlotConfig, kind: Kind) -> SlotConfig {
    let address = if kind == Kind::Off { 0 } else { now.source.address() };
    let mut config = SlotConfig::usual(Source::held(kind, address, SINGLE_AXIS));
    if now.source.kind() == Kind::Off {
        let before = SlotConfig::OFF;
        for setting in SETTINGS.iter().filter(|setting| !matches!(setting.id, id::KIND | id::ADDRESS)) {
            if differs(setting, now, &before) {
                (setting.set)(&mut config, (setting.get)(now));
            }
        }
    }
    config
}

/// An address that is named is one of the kind; that of an unused slot is one of some kind.
fn check_address(config: &SlotConfig, named: Named<'_>) -> Result<(), Refusal> {
    let Some(Given { value, .. }) = named(id::ADDRESS) else { return Ok(()) };
    let kind = config.source.kind();
    let complete = |kind| {
        let address = u8::try_from(value).ok()?;
        Some(!matches!(Source::of(kind, address, config.axis()), Source::Incomplete { .. }))
    };
    let kinds: &[Kind] = if kind == Kind::Off { &Kind::ALL } else { &[kind] };
    match kinds.iter().any(|&kind| complete(kind) == Some(true)) || config.source.address() as i64 == value {
        true => Ok(()),
        false => Err(Refusal::Address { kind, value }),
    }
}

/// Whether a slot can be set like this: each value for itself, and those that have to fit each other.
///
/// # Errors
/// What cannot be, and why.
pub fn check(config: &SlotConfig) -> Result<(), Refusal> {
    let values: &dyn Shown = &Tabled::new(&SETTINGS, config);
    values.check()?;
    if !config.name.is_valid() {
        return Err(Refusal::Excluded("name"));
    }
    if let (AlarmLimits::Both, Some(high), Some(low)) =
        (config.alarm.limits, setting(id::HIGH), setting(id::LOW))
        && config.alarm.high < config.alarm.low
    {
        return Err(Refusal::Shorter { number: high.number(config), least: low.number(config) });
    }
    if config.timeout > Duration::ZERO {
        fits(config, id::TIMEOUT, config.timeout, span("latency", latency(config.source.kind())))?;
    }
    // The cycles of a PWM output come at their own period.
    let interval = match config.source.kind() {
        Kind::Pwm => span("cycle", PWM_PERIOD),
        _ => span("period", config.period),
    };
    fits(config, id::STALE, config.stale_after(), interval)?;
    fits(config, id::STALE, config.stale_after(), span("period", config.period))
}

/// What the sensor's document allows it before it answers.
pub const fn latency(kind: Kind) -> Duration {
    match kind {
        Kind::T7 => T7_LATENCY,
        Kind::Isu => ISU_LATENCY,
        Kind::Off | Kind::Pwm => Duration::ZERO,
    }
}

/// A span is not shorter than another.
fn fits(config: &SlotConfig, id: u8, is: Duration, least: Number) -> Result<(), Refusal> {
    match setting(id) {
        Some(setting) if i64::from(is.as_micros()) < least.value => {
            Err(Refusal::Shorter { number: setting.number(config), least })
        }
        _ => Ok(()),
    }
}

fn span(name: &'static str, span: Duration) -> Number {
    Number { name, unit: "ms", value: span.as_micros().into(), decimals: 3 }
}

fn kind(code: i64) -> Kind {
    u8::try_from(code).ok().and_then(Kind::from_code).unwrap_or_default()
}

fn filter(code: i64) -> Filter {
    match code {
        0 => Filter::Off,
        1 => Filter::Mean,
        _ => Filter::Median,
    }
}

impl SlotConfig {
    /// The axis, of a T7 or held for one.
    pub const fn axis(&self) -> t7::Axis {
        match self.source {
            Source::T7 { axis, .. } => axis,
            _ => self.held_axis,
        }
    }

    fn set_axis(&mut self, to: t7::Axis) {
        match &mut self.source {
            Source::T7 { axis, .. } => *axis = to,
            _ => self.held_axis = to,
        }
    }
}

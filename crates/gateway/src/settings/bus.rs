//! Settings of a bus.
//!
//! A bit rate brings its usual waits with it ([`BusSettings::usual`]). Changes are in `change.rs`.

use clino_bus::line::EchoMode;
use clino_bus::{Duration, Serial, Timing};

use super::BusSettings;
use super::setting::{Definition, Form, Setting, Shown, Tabled, names};
use crate::config::Bus;
use crate::refusal::Refusal;

/// The settings' numbers in the stored record. A number is never given to another setting.
pub mod id {
    #![allow(missing_docs, reason = "the table says what each is")]
    pub const BAUD: u8 = 1;
    pub const GUARD: u8 = 2;
    pub const PRE: u8 = 3;
    pub const POST: u8 = 4;
    pub const ECHO: u8 = 5;
}

/// Bit rates of a T7 (T7 guide section 2.7.2), bit/s.
pub const T7_BIT_RATES: &[u32] = &[115_200, 57_600, 38_400, 19_200, 9_600];
/// The bit rate of an ISU (AN #201 section 4), bit/s.
pub const ISU_BIT_RATES: &[u32] = &[9_600];

/// Longest turnaround guard, µs.
const LONGEST_GUARD: i64 = 20_000;
/// Longest delay between driver enable and the first start bit, µs.
const LONGEST_PRE: i64 = 5_000;
/// A T7 answers within 2 ms (T7 guide section 1): a driver that is on for longer meets every answer, µs.
const LONGEST_T7_POST: i64 = 2_000;
/// An ISU switches its own driver on 1 ms before its first bit (AN #201 section 2, TXEN), µs.
const LONGEST_ISU_POST: i64 = 1_000;

/// Names of the echo modes, by their codes.
pub const ECHO: &[&str] = &["off", "expected", "detect"];

/// The table of a bus, for use in constants.
pub const fn table(bus: Bus) -> [Setting<BusSettings>; 5] {
    let (rates, set, longest_post): (_, fn(&mut BusSettings, i64), _) = match bus {
        Bus::T7 => (T7_BIT_RATES, |s, v| s.set_rate(Bus::T7, Serial { baud: v as u32 }), LONGEST_T7_POST),
        Bus::Isu => (ISU_BIT_RATES, |s, v| s.set_rate(Bus::Isu, Serial { baud: v as u32 }), LONGEST_ISU_POST),
    };
    [
        Setting {
            definition: Definition {
                id: id::BAUD,
                name: "baud",
                unit: "bit/s",
                form: Form::OneOf(rates),
                text: "bit rate; T7: 9600, 19200, 38400, 57600, 115200; ISU: 9600",
            },
            get: |s| s.timing.serial.baud.into(),
            set,
        },
        Setting {
            definition: Definition {
                id: id::GUARD,
                name: "guard",
                unit: "us",
                form: us(LONGEST_GUARD),
                text: "silence before the driver is switched on",
            },
            get: |s| micros(s.timing.guard),
            set: |s, v| s.set_guard(Duration::from_micros(v as u32)),
        },
        Setting {
            definition: Definition {
                id: id::PRE,
                name: "pre",
                unit: "us",
                form: us(LONGEST_PRE),
                text: "time from DE high to the first start bit of a request",
            },
            get: |s| micros(s.line.pre_delay),
            set: |s, v| s.line.pre_delay = Duration::from_micros(v as u32),
        },
        Setting {
            definition: Definition {
                id: id::POST,
                name: "post",
                unit: "us",
                form: us(longest_post),
                text: "time from the last stop bit of a request to DE low",
            },
            get: |s| micros(s.line.post_delay),
            set: |s, v| s.line.post_delay = Duration::from_micros(v as u32),
        },
        Setting {
            definition: Definition {
                id: id::ECHO,
                name: "echo",
                unit: "",
                form: Form::Choice(ECHO),
                text: "echo of the gateway's own characters",
            },
            get: |s| echo_code(s.line.echo),
            set: |s, v| s.line.echo = echo_of(v),
        },
    ]
}

/// The tables of both buses.
pub static T7_SETTINGS: [Setting<BusSettings>; 5] = table(Bus::T7);
/// See [`T7_SETTINGS`].
pub static ISU_SETTINGS: [Setting<BusSettings>; 5] = table(Bus::Isu);

/// The names of both tables' settings, in their order.
pub static NAMES: [&str; 5] = names(&table(Bus::T7));

/// The table of a bus.
pub fn settings(bus: Bus) -> &'static [Setting<BusSettings>] {
    match bus {
        Bus::T7 => &T7_SETTINGS,
        Bus::Isu => &ISU_SETTINGS,
    }
}

/// Whether a bus can run like this.
///
/// # Errors
/// What cannot be.
pub fn check(bus: Bus, of: &BusSettings) -> Result<(), Refusal> {
    let values: &dyn Shown = &Tabled::new(settings(bus), of);
    values.check()
}

/// The waits of a bus at this bit rate, as its sensors' documents say.
#[inline(never)]
pub(super) const fn usual(bus: Bus, serial: Serial) -> Timing {
    match bus {
        Bus::T7 => Timing::t7(serial),
        Bus::Isu => Timing { serial, ..Timing::isu() },
    }
}

impl BusSettings {
    /// A bus at this bit rate, as its sensors' documents say.
    pub const fn usual(bus: Bus, baud: u32) -> BusSettings {
        BusSettings::new(usual(bus, Serial { baud }))
    }

    /// A bus at the first bit rate of its sensors.
    pub const fn first(bus: Bus) -> BusSettings {
        match bus {
            Bus::T7 => BusSettings::usual(bus, Serial::T7_DEFAULT.baud),
            Bus::Isu => BusSettings::usual(bus, Serial::ISU.baud),
        }
    }

    pub(super) fn set_guard(&mut self, guard: Duration) {
        self.timing.guard = guard;
        self.line.guard = guard;
    }
}

const fn us(most: i64) -> Form {
    Form::number(0, most, 0)
}

fn micros(span: Duration) -> i64 {
    span.as_micros().into()
}

/// The code of an echo mode.
pub const fn echo_code(echo: EchoMode) -> i64 {
    match echo {
        EchoMode::Off => 0,
        EchoMode::Expected => 1,
        EchoMode::Detect => 2,
    }
}

/// The echo mode with this code.
pub const fn echo_of(code: i64) -> EchoMode {
    match code {
        0 => EchoMode::Off,
        1 => EchoMode::Expected,
        _ => EchoMode::Detect,
    }
}

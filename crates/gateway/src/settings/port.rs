//! Settings of the Modbus port.

use clino_bus::line::EchoMode;

use super::bus::{ECHO, echo_code, echo_of};
use super::setting::{Definition, Form, Named, Setting, Shown, Tabled, change, names};
use crate::refusal::Refusal;

mod times;

/// The settings' numbers in the stored record. A number is never given to another setting.
pub mod id {
    #![allow(missing_docs, reason = "the table says what each is")]
    pub const ADDRESS: u8 = 1;
    pub const BAUD: u8 = 2;
    pub const PARITY: u8 = 3;
    pub const STOP_BITS: u8 = 4;
    pub const ECHO: u8 = 5;
    pub const PAUSES: u8 = 6;
    pub const LOCKED: u8 = 7;
}

/// How the Modbus port runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PortSettings {
    /// The address this server answers to, 1 to 247.
    pub address: u8,
    /// Bit rate, one of [`BIT_RATES`].
    pub baud: u32,
    /// Parity.
    pub parity: Parity,
    /// Stop bits.
    pub stop_bits: StopBits,
    /// Whether our own characters come back.
    pub echo: EchoMode,
    /// Which pauses a frame may have.
    pub pauses: Pauses,
    /// Nothing can be written through the port.
    pub locked: bool,
}

/// Bit rates of the port, bit/s.
pub const BIT_RATES: [u32; 7] = [2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];

/// Lowest and highest address of a server (MODBUS over Serial Line V1.02 section 2.2).
pub const ADDRESSES: (u8, u8) = (1, 247);

/// The parity bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Parity {
    /// There is none.
    None = 0,
    /// It makes the number of ones even.
    Even = 1,
    /// It makes the number of ones odd.
    Odd = 2,
}

/// Number of stop bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopBits {
    /// One.
    One = 1,
    /// Two.
    Two = 2,
}

/// Which pauses a frame may have (MODBUS over Serial Line V1.02 section 2.5.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pauses {
    /// Below t3.5, as USB adapters make them.
    Tolerant = 0,
    /// Up to t1.5, as the standard says.
    Strict = 1,
}

impl PortSettings {
    /// Address 1, 19200 bit/s, 8E1.
    pub const DEFAULT: PortSettings = PortSettings {
        address: 1,
        baud: 19_200,
        parity: Parity::Even,
        stop_bits: StopBits::One,
        echo: EchoMode::Off,
        pauses: Pauses::Tolerant,
        locked: false,
    };

    /// Whether the port can run like this.
    pub fn is_valid(&self) -> bool {
        check(self).is_ok()
    }
}

/// The table, for use in constants.
pub const TABLE: [Setting<PortSettings>; 7] = [
    Setting {
        definition: Definition {
            id: id::ADDRESS,
            name: "address",
            unit: "",
            form: Form::number(ADDRESSES.0 as i64, ADDRESSES.1 as i64, 0),
            text: "address of this server",
        },
        get: |s| s.address.into(),
        set: |s, v| s.address = v as u8,
    },
    Setting {
        definition: Definition {
            id: id::BAUD,
            name: "baud",
            unit: "bit/s",
            form: Form::OneOf(&BIT_RATES),
            text: "bit rate: 2400, 4800, 9600, 19200, 38400, 57600 or 115200",
        },
        get: |s| s.baud.into(),
        set: |s, v| s.baud = v as u32,
    },
    Setting {
        definition: Definition {
            id: id::PARITY,
            name: "parity",
            unit: "",
            form: Form::Choice(&["none", "even", "odd"]),
            text: "parity bit",
        },
        get: |s| s.parity as i64,
        set: |s, v| {
            s.parity = match v {
                0 => Parity::None,
                1 => Parity::Even,
                _ => Parity::Odd,
            }
        },
    },
    Setting {
        definition: Definition {
            id: id::STOP_BITS,
            name: "stop_bits",
            unit: "",
            form: Form::number(1, 2, 0),
            text: "stop bits",
        },
        get: |s| s.stop_bits as i64,
        set: |s, v| s.stop_bits = if v == 2 { StopBits::Two } else { StopBits::One },
    },
    Setting {
        definition: Definition {
            id: id::ECHO,
            name: "echo",
            unit: "",
            form: Form::Choice(ECHO),
            text: "echo of the gateway's own characters",
        },
        get: |s| echo_code(s.echo),
        set: |s, v| s.echo = echo_of(v),
    },
    Setting {
        definition: Definition {
            id: id::PAUSES,
            name: "pauses",
            unit: "",
            form: Form::Choice(&["tolerant", "strict"]),
            text: "tolerant: pauses below t3.5 within a frame; strict: up to t1.5, as the standard says",
        },
        get: |s| s.pauses as i64,
        set: |s, v| s.pauses = if v == 0 { Pauses::Tolerant } else { Pauses::Strict },
    },
    Setting {
        definition: Definition {
            id: id::LOCKED,
            name: "locked",
            unit: "",
            form: Form::Flag,
            text: "1: nothing can be written through the port; only the console unlocks it",
        },
        get: |s| s.locked.into(),
        set: |s, v| s.locked = v != 0,
    },
];

/// The table.
pub static SETTINGS: [Setting<PortSettings>; 7] = TABLE;

/// The names of the table's settings, in its order.
pub static NAMES: [&str; 7] = names(&TABLE);

/// The port that comes of a change.
///
/// # Errors
/// A value that its setting does not have.
pub fn changed(now: &PortSettings, named: Named<'_>) -> Result<PortSettings, Refusal> {
    let mut settings = *now;
    change(&mut Tabled::new(&SETTINGS, &mut settings), named)?;
    Ok(settings)
}

/// Whether the port can run like this.
///
/// # Errors
/// What cannot be.
pub fn check(of: &PortSettings) -> Result<(), Refusal> {
    let values: &dyn Shown = &Tabled::new(&SETTINGS, of);
    values.check()
}

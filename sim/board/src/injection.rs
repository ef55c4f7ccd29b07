//! Fault injection: faults planted into the running image from outside: which, at which level, how often.
//!
//! The image is not changed. When a fault is due, and the core is about to execute an instruction at its level, the
//! registers are set so that the fault follows: what it takes of code and constants is found in the image itself. Only
//! `flip` changes memory instead.
//! Level names are those of the gateway's architecture; the exception numbers are those of the board text.

mod payload;
#[cfg(test)]
mod tests;

use std::fmt;

use clino_sim::node::Ns;
use serde::Deserialize;

pub use payload::{NoPayload, Payload};

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum What {
    /// The level runs an endless loop; higher levels interrupt it. Injected where interrupts are enabled.
    Hang,
    /// The same with all interrupts masked (PRIMASK).
    MaskedHang,
    /// The level jumps to an address without memory: IBUSERR.
    BusFault,
    /// The level loads from an address without memory: PRECISERR.
    DataFault,
    /// The level executes an undefined instruction: UNDEFINSTR.
    UsageFault,
    /// The level enters a function with the stack full: its first push goes below the stack's lower end.
    StackOverflow,
    /// The level panics: enters a panic function of `core`.
    Panic,
    /// The supply is too low for a moment, and the chip is reset. Memory is kept: it dips no further than that.
    BrownOut,
    /// The reset pin is pulled low.
    PinReset,
    /// A bit of memory is inverted, and the level goes on.
    Flip {
        /// Address of the byte.
        address: u32,
        /// Bit of the byte, 0 to 7.
        bit: u32,
    },
}

/// Where a fault is injected: what the core is executing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// The main loop, awake.
    Main,
    /// The bus level: EXTI0.
    Bus,
    /// The Modbus level: EXTI1.
    Modbus,
    /// The clock's interrupt: TIM4.
    Clock,
    /// The interrupt of the T7 bus's USART.
    T7Port,
    /// That of the ISU bus's.
    IsuPort,
    /// That of the console's.
    ConsolePort,
    /// That of the Modbus port's.
    ModbusPort,
    /// The interrupt of PWM input 1: TIM5.
    Pwm1,
    /// That of PWM input 2: TIM2.
    Pwm2,
}

/// Number of the exception of interrupt line 0.
const IRQ0: u16 = 16;

impl Level {
    /// Number of the exception in which the level executes; 0 for none. The lines are RM0090 table 62's.
    pub(crate) const fn exception(self) -> u16 {
        let line = match self {
            Level::Main => return 0,
            Level::Bus => 6,
            Level::Modbus => 7,
            Level::Clock => 30,
            Level::T7Port => 37,
            Level::IsuPort => 39,
            Level::ConsolePort => 38,
            Level::ModbusPort => 71,
            Level::Pwm1 => 50,
            Level::Pwm2 => 28,
        };
        IRQ0 + line
    }
}

/// A fault to inject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Injection {
    /// Earliest instant: it happens when the level executes next.
    pub at: Ns,
    /// What it does.
    pub what: What,
    /// Where.
    pub level: Level,
    /// How often.
    pub times: u32,
    /// How long after the reset that it brought it is due again.
    pub again: Ns,
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            What::Hang => "hang",
            What::MaskedHang => "masked_hang",
            What::BusFault => "bus_fault",
            What::DataFault => "data_fault",
            What::UsageFault => "usage_fault",
            What::StackOverflow => "stack_overflow",
            What::Panic => "panic",
            What::BrownOut => "brown_out",
            What::PinReset => "pin_reset",
            What::Flip { address, bit } => return write!(f, "flip={address:#010x}.{bit}"),
        })
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Level::Main => "main",
            Level::Bus => "bus",
            Level::Modbus => "modbus",
            Level::Clock => "clock",
            Level::T7Port => "t7_port",
            Level::IsuPort => "isu_port",
            Level::ConsolePort => "console_port",
            Level::ModbusPort => "modbus_port",
            Level::Pwm1 => "pwm1",
            Level::Pwm2 => "pwm2",
        })
    }
}

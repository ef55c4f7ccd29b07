//! The record of a crash.
//!
//! Fault status bits: ARMv7-M Architecture Reference Manual, section B3.2.15 (CFSR) and B3.2.16 (HFSR).

use crate::cause::StartCause;
use crate::monitor::MonitoredTask;

/// Characters kept of the name of the file in which a panic was.
pub const PLACE: usize = 16;

/// What went wrong, where and when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crash {
    /// What.
    pub cause: StartCause,
    /// The start in which it happened, counted like [`Start::boots`](crate::Start::boots).
    pub boot: u32,
    /// Milliseconds from that start to the crash; saturates.
    pub uptime_ms: u32,
    /// Where the program was; unknown for a panic, and for a watchdog reset without a known cause.
    pub registers: Option<Registers>,
    /// Status of a fault, all zero otherwise.
    pub fault: FaultStatus,
    /// The number of the task that was silent, or the line of a panic.
    pub detail: u32,
    /// The last characters of the file that panicked; zeros before.
    pub place: [u8; PLACE],
}

/// Where the program was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registers {
    /// The next instruction, or the one that failed.
    pub pc: u32,
    /// Where it was called from.
    pub lr: u32,
    /// The stack at that instant.
    pub sp: u32,
    /// The level: number of the exception that was active, 0 for the main loop.
    pub exception: u16,
}

/// What the core says of a fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultStatus {
    /// Configurable fault status register.
    pub cfsr: u32,
    /// HardFault status register.
    pub hfsr: u32,
    /// The address that was accessed, if the core knows it, 0 otherwise.
    pub address: u32,
}

/// Memory management faults, CFSR bits 0 to 7.
const MEMORY: u32 = 0x0000_00FF;
/// Bus faults, bits 8 to 15.
const BUS: u32 = 0x0000_FF00;
/// Usage faults, bits 16 to 31.
const USAGE: u32 = 0xFFFF_0000;
/// The stack could not be written when an exception began: MSTKERR, STKERR, and MLSPERR, LSPERR for its floating-point half.
const STACKING: u32 = 1 << 4 | 1 << 5 | 1 << 12 | 1 << 13;
/// The address of a memory management fault is known: MMARVALID.
const MEMORY_ADDRESS: u32 = 1 << 7;
/// The address of a bus fault is known: BFARVALID.
const BUS_ADDRESS: u32 = 1 << 15;

impl FaultStatus {
    /// From the registers CFSR, HFSR, MMFAR and BFAR.
    pub const fn new(cfsr: u32, hfsr: u32, mmfar: u32, bfar: u32) -> FaultStatus {
        let address = if cfsr & MEMORY_ADDRESS != 0 {
            mmfar
        } else if cfsr & BUS_ADDRESS != 0 {
            bfar
        } else {
            0
        };
        FaultStatus { cfsr, hfsr, address }
    }

    /// Whether there was a fault at all.
    pub const fn is_fault(&self) -> bool {
        self.cfsr | self.hfsr != 0
    }

    /// The address that was accessed, if the core knows it.
    pub const fn known_address(&self) -> Option<u32> {
        if self.cfsr & (MEMORY_ADDRESS | BUS_ADDRESS) != 0 { Some(self.address) } else { None }
    }

    /// What kind of fault it was. `outside`: the stack pointer was outside the stack.
    pub const fn cause(&self, outside: bool) -> StartCause {
        let cfsr = self.cfsr;
        if outside || cfsr & STACKING != 0 {
            StartCause::StackOverflow
        } else if cfsr & USAGE != 0 {
            StartCause::UsageFault
        } else if cfsr & BUS != 0 {
            StartCause::BusFault
        } else if cfsr & MEMORY != 0 {
            StartCause::MemoryFault
        } else {
            StartCause::HardFault
        }
    }
}

impl Crash {
    /// A fault.
    pub fn fault(fault: FaultStatus, registers: Option<Registers>, outside: bool) -> Crash {
        Crash { cause: fault.cause(outside), registers, fault, ..Crash::default() }
    }

    /// A task that has not checked in, and where the program was when the monitor noticed it.
    pub fn stalled(task: MonitoredTask, registers: Registers) -> Crash {
        Crash {
            cause: StartCause::Stalled,
            registers: Some(registers),
            detail: task as u32,
            ..Crash::default()
        }
    }

    /// A panic, at this line of this file.
    pub fn panic(file: &str, line: u32) -> Crash {
        let mut place = [0; PLACE];
        // From the end: the name of the file is there.
        for (to, from) in place.iter_mut().rev().zip(file.bytes().rev()) {
            *to = from;
        }
        Crash { cause: StartCause::Panic, detail: line, place, ..Crash::default() }
    }

    /// The crystal has stopped.
    pub fn clock_failed(registers: Option<Registers>) -> Crash {
        Crash { cause: StartCause::ClockFailed, registers, ..Crash::default() }
    }

    /// The task that was silent.
    pub fn task(&self) -> Option<MonitoredTask> {
        if self.cause == StartCause::Stalled { MonitoredTask::from_number(self.detail) } else { None }
    }

    /// The line of a panic.
    pub fn line(&self) -> Option<u32> {
        (self.cause == StartCause::Panic).then_some(self.detail)
    }

    /// The end of the name of the file of a panic.
    pub fn file(&self) -> Option<&str> {
        if self.cause != StartCause::Panic {
            return None;
        }
        let start = self.place.iter().position(|byte| *byte != 0)?;
        core::str::from_utf8(self.place.get(start..)?).ok()
    }
}

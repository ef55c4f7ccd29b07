//! A gateway whose numbers can be told apart, and which changes with every look at it.

use std::cell::Cell;

use clino_bus::line::EchoMode;
use clino_bus::{Counters, DriverEnable, Micros};
use clino_gateway::summary::Summary;
use clino_gateway::{BusFault, BusHealth};
use clino_modbus::command::{Command, Outcome, Progress};
use clino_modbus::config::{BusConfig, SlotConfig};
use clino_modbus::{
    Bus, GatewayView, Host, Kind, Refusal, SlotCounters, SlotDetail, SlotReading, Status, Write,
};
use clino_recovery::{Cause, Clock, Crash, FaultStatus, Mode, Registers, Start};

/// All slots move by this much, in millidegrees, whenever somebody looks.
pub const STEP: i32 = 7;

pub struct Model {
    /// Looks at it so far.
    looks: Cell<i32>,
    /// Looks when the state was held still; `None`: nobody has asked for that yet.
    pub held: Option<i32>,
    pub snapshots: u32,
    pub writes: Vec<Write>,
    /// What the next change is answered with.
    pub refusal: Option<Refusal>,
    pub slots: [SlotConfig; 48],
    pub buses: [BusConfig; 2],
    pub counters: [Counters; 2],
    pub progress: Progress,
    pub start: Start,
}

/// Angle of a slot when nobody has looked at it.
pub fn angle(slot: usize) -> i32 {
    slot as i32 * 12_345 - 179_999
}

pub fn status(slot: usize) -> Status {
    match slot {
        3 => Status::NeverRead,
        5 => Status::Stale,
        7 => Status::NoAnswer,
        9 => Status::DeviceError,
        11 | 40 => Status::Disabled,
        _ => Status::Ok,
    }
}

pub fn age(slot: usize) -> Option<u64> {
    match slot {
        3 => None,
        4 => Some(65_534_999),
        5 => Some(65_535_000),
        6 => Some(1 << 40),
        slot => Some(slot as u64 * 1_000 + 999),
    }
}

pub fn has_detail(slot: usize) -> bool {
    slot.is_multiple_of(2)
}

impl Model {
    pub fn new() -> Model {
        let slot = |slot: usize| SlotConfig {
            enabled: slot < 6,
            kind: Kind::T7,
            address: slot as u8 + 1,
            axis: 2,
            period_ms: 100_000 + slot as u32,
            stale_ms: 200_000 + slot as u32,
            timeout_ms: 300 + slot as u16,
            retries: 1,
            zero_mdeg: -70_000 - slot as i32,
            reversed: slot == 1,
            unidirectional: slot == 2,
            filter: clino_modbus::config::Filter::Median,
            filter_length: 3,
            confirm: true,
            jump_mdeg_s: 400_000 + slot as u32,
        };
        let bus = BusConfig {
            baud: 115_200,
            guard_us: 87,
            pre_delay_us: 1,
            post_delay_us: 2,
            echo: EchoMode::Detect,
        };
        Model {
            looks: Cell::new(0),
            held: None,
            snapshots: 0,
            writes: Vec::new(),
            refusal: None,
            slots: std::array::from_fn(slot),
            buses: [bus, BusConfig { baud: 9_600, echo: EchoMode::Off, ..bus }],
            counters: [counters(1), counters(2)],
            progress: Progress {
                command: Some(Command::SensorZero),
                outcome: Outcome::Running,
                sequence: 0xFFFE,
                done: 3,
                of: 8,
                silenced: 5,
            },
            start: start(),
        }
    }

    fn look(&self) -> i32 {
        self.looks.set(self.looks.get() + 1);
        self.held.expect("a snapshot before the first look")
    }
}

/// A start after a fault of which everything is known.
pub fn start() -> Start {
    // The address is valid: BFARVALID, PRECISERR.
    let fault = FaultStatus::new(0x8200, 0x4000_0000, 0x1111_1111, 0x2222_2222);
    let registers = Registers { pc: 0x0801_0203, lr: 0x0801_0405, sp: 0x2001_FF08, exception: 22 };
    let crash = Crash::fault(fault, Some(registers), false);
    Start {
        cause: Cause::PowerOn,
        boots: 70_001,
        crashes: 70_002,
        mode: Mode::Bare,
        clock: Clock::Fallback,
        crash: Some(Crash { boot: 70_003, uptime_ms: 70_004, ..crash }),
    }
}

/// The T7 bus is mute, the ISU bus is well.
pub fn health(bus: Bus) -> BusHealth {
    BusHealth {
        fault: (bus == Bus::T7).then_some(BusFault::Mute),
        in_vain: 70 + bus as u32,
        faults: 90 + bus as u32,
    }
}

/// Every counter another number; `bus` in the millions.
pub fn counters(bus: u32) -> Counters {
    let n = bus * 1_000_000;
    Counters {
        requests: n + 1,
        retries: n + 2,
        writes: n + 3,
        good: n + 4,
        first_try: n + 5,
        no_answer: n + 6,
        bad_answer: n + 7,
        checksum: n + 8,
        length: n + 9,
        foreign: n + 10,
        late: n + 11,
        forced: n + 12,
        line_busy: n + 13,
        contention: n + 14,
        echo: n + 15,
        junk: n + 16,
        framing: n + 17,
        noise: n + 18,
        overrun: n + 19,
        parity: n + 20,
        unasked: n + 24,
        breaks: n + 25,
        response_last: Micros(u64::from(n) + 21),
        response_min: Micros(u64::from(n) + 22),
        response_max: Micros(1 << 33),
    }
}

impl Host for Model {
    fn snapshot(&mut self) {
        self.held = Some(self.looks.get());
        self.snapshots += 1;
    }

    fn held_still(&self) -> bool {
        true
    }

    fn gateway(&self) -> GatewayView {
        self.look();
        GatewayView {
            version: (1, 2, 3),
            uptime: Micros(4_000_000_999_999),
            status: 0xA55A,
            sequence: 0xBEEF,
            progress: self.progress,
        }
    }

    fn summary(&self) -> Summary {
        self.look();
        let set =
            |is: fn(Status) -> bool| (0..48).fold(0, |set, slot| set | u64::from(is(status(slot))) << slot);
        Summary {
            // The gateway's own word is in the view.
            signals: Default::default(),
            online: set(|status| matches!(status, Status::Ok | Status::DeviceError)),
            valid: set(|status| status == Status::Ok),
            enabled: 46,
            oldest: Micros(u64::MAX),
        }
    }

    fn start(&self) -> Start {
        self.look();
        self.start
    }

    fn reading(&self, slot: usize) -> SlotReading {
        let moved = self.look() * STEP;
        // With an angle always: what it is worth is the server's to see.
        SlotReading { status: status(slot), angle: Some(angle(slot) + moved), age: age(slot).map(Micros) }
    }

    fn detail(&self, slot: usize) -> SlotDetail {
        self.look();
        let n = slot as u16;
        let counters = SlotCounters {
            requests: 0x10_0000 + slot as u32,
            first_try: 0x20_0000 + slot as u32,
            retries: 0x100 + n,
            timeouts: 0x200 + n,
            checksum: 0x300 + n,
            length: 0x400 + n,
            late: 0x500 + n,
            writes: 0x600 + n,
            response_last: Micros(20_839),
            response_max: Micros(655_350),
        };
        if !has_detail(slot) {
            return SlotDetail { flags: 0x8000 + n, sequence: 0x700 + n, ..SlotDetail::default() };
        }
        SlotDetail {
            flags: 0x8000 + n,
            raw: Some(-5 - slot as i32),
            unwrapped: Some(3_600_000 + slot as i32),
            temperature: Some(-500 - slot as i16),
            sequence: 0x700 + n,
            last_error: Some(Status::BadAnswer),
            kind: Kind::Isu,
            address: slot as u8 + 1,
            counters,
        }
    }

    fn counters(&self, bus: Bus) -> Counters {
        self.look();
        self.counters[bus as usize]
    }

    fn health(&self, bus: Bus) -> BusHealth {
        self.look();
        health(bus)
    }

    fn driver_enable(&self, bus: Bus) -> DriverEnable {
        self.look();
        DriverEnable { release_max_ns: 1_279 + bus as u32, high_max_us: 261 + bus as u32 }
    }

    fn slot_config(&self, slot: usize) -> SlotConfig {
        self.look();
        self.slots[slot]
    }

    fn bus_config(&self, bus: Bus) -> BusConfig {
        self.look();
        self.buses[bus as usize]
    }

    fn write(&mut self, write: &Write) -> Result<(), Refusal> {
        if let Some(refusal) = self.refusal {
            return Err(refusal);
        }
        match *write {
            Write::Slot { slot, config } => self.slots[usize::from(slot)] = config,
            Write::Bus { bus, change } => {
                let us = |wait: Option<Micros>, before| wait.map_or(before, |wait| wait.0 as u16);
                let before = self.buses[bus as usize];
                self.buses[bus as usize] = BusConfig {
                    baud: change.baud.unwrap_or(before.baud),
                    guard_us: us(change.guard, before.guard_us),
                    pre_delay_us: us(change.pre_delay, before.pre_delay_us),
                    post_delay_us: us(change.post_delay, before.post_delay_us),
                    echo: change.echo.unwrap_or(before.echo),
                };
            }
            Write::Port(_) | Write::Command { .. } => {}
        }
        self.writes.push(*write);
        Ok(())
    }
}

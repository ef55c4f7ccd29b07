//! A simulated US Digital T7 inclinometer on RS485: commands 80 to 8F and 91.
//!
//! Source: "T7 Communication User Guide" 1.7. Messages are described in `t7/frame.rs`, the choices where the
//! document is silent in `t7/command.rs` and `t7/angle.rs`.
//!
//! Timing, per answer:
//!
//! ```text
//! command's last stop bit ends          first start bit            last stop bit ends
//!           |------- latency ----------------|====== answer ===========|-- hold --|
//!           |------ write time -----X        ^drive lead before it     |-- 10 ms: new bit rate
//!                        setting is stored
//! ```
//!
//! While it works on a command a T7 keeps its place in the traffic, but drops further commands to itself;
//! while its driver is on it hears nothing.

mod angle;
mod command;
mod frame;
mod settings;

use oorandom::Rand64;

use crate::fault::Faults;
use crate::latency::Latency;
use crate::motion::Motion;
use crate::node::{Burst, Heard, Node, Ns};
use crate::said::{Record, Said};
use crate::uart;
use command::{ALL_RESPOND, Command};
pub use settings::{
    AXES, BAUD_RATES, DAMPING_MS, DEFAULT_ADDRESS, Direction, Identity, Model, OutputRange,
    SETTABLE_ADDRESSES, SINGLE_AXIS, Settings,
};

const MICROSECOND: Ns = 1_000;
const MILLISECOND: Ns = 1_000_000;

/// Longest documented time to answer a Get command (section 1).
pub const GET_LIMIT: Ns = 2 * MILLISECOND;

/// Longest documented time to answer a Set command (section 1).
pub const SET_LIMIT: Ns = 25 * MILLISECOND;

/// From the end of the answer to Set Baud Rate to the change, "about 10 milliseconds" (section 2.7.2).
pub const BAUD_CHANGE_DELAY: Ns = 10 * MILLISECOND;

/// What damping does to the angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Damping {
    /// Nothing: the reported angle is the true one at the instant of the answer. Oracles stay simple.
    #[default]
    Ignored,
    /// The reported angle is the mean over the damping time before the answer, so it lags a motion by half of
    /// that and has settled one damping time after a step.
    Averaged,
}

/// Everything about a simulated T7 that is not in its own memory.
#[derive(Clone, Debug)]
pub struct Options {
    /// True angle per axis; a T7-1 uses axis 2 only.
    pub motion: [Motion; AXES],
    /// What damping does.
    pub damping: Damping,
    /// Temperature in 0.01 °C; documented −500 to 19000.
    pub temperature: i16,
    /// End of a Get command to first start bit; at most [`GET_LIMIT`].
    pub get_latency: Latency,
    /// End of a Set command to first start bit; at most [`SET_LIMIT`].
    pub set_latency: Latency,
    /// End of a Set command to the setting being stored; counted to the answer if that comes earlier.
    pub write_time: Ns,
    /// How long before the first start bit the line driver is on.
    pub drive_lead: Ns,
    /// How long after the last stop bit the line driver stays on. The document does not say.
    pub hold: Ns,
    /// Power-up to the first character heard. The document does not say.
    pub boot_time: Ns,
    /// Answers Get All Angles with the length byte 0A, as the document's example prints it.
    pub length_quirk: bool,
    /// Seed of the latency jitter.
    pub seed: u64,
}

impl Default for Options {
    /// A device as slow as the document allows.
    fn default() -> Self {
        Self {
            motion: [const { Motion::Constant(0) }; AXES],
            damping: Damping::Ignored,
            temperature: 2300,
            get_latency: Latency::fixed(GET_LIMIT),
            set_latency: Latency::fixed(SET_LIMIT),
            write_time: 20 * MILLISECOND,
            drive_lead: MICROSECOND,
            // About half a character at 115200: an interrupt on transmission complete that is not the only
            // one, and less than the one character that masters customarily wait.
            hold: 40 * MICROSECOND,
            boot_time: 20 * MILLISECOND,
            length_quirk: false,
            seed: 0,
        }
    }
}

/// Why a T7 cannot be made like that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadOption {
    /// An answer could take longer than documented (use a fault for that).
    Latency {
        /// Longest time asked for, in ns.
        longest: Ns,
        /// Longest documented time, in ns.
        limit: Ns,
    },
    /// No T7 has this address.
    Address(u8),
    /// There is no such baud rate index.
    BaudIndex(u8),
    /// The damping time is outside 2 … 5000 ms.
    Damping(u16),
}

impl core::fmt::Display for BadOption {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Latency { longest, limit } => {
                write!(f, "latency {longest} ns is above the documented limit of {limit} ns")
            }
            Self::Address(address) => write!(f, "address {address} is not 1 to 100 or 127"),
            Self::BaudIndex(index) => write!(f, "baud rate index {index} is not 0 to 4"),
            Self::Damping(ms) => write!(f, "damping {ms} ms is not 2 to 5000 ms"),
        }
    }
}

impl core::error::Error for BadOption {}

/// What the device is doing.
#[derive(Clone, Debug, Default)]
enum Work {
    #[default]
    Idle,
    /// Has heard a command that it carries out at `at`.
    Command { at: Ns, slot: Slot, message: frame::Message },
    /// Has an answer ready.
    Answer { slot: Slot, bytes: Vec<u8>, angles: Vec<Said>, new_baud: Option<u8> },
}

/// When an answer takes the line, and when its first start bit comes.
#[derive(Clone, Copy, Debug)]
struct Slot {
    drive_at: Ns,
    start_at: Ns,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Off,
    /// Hears from this instant on.
    On {
        ready_at: Ns,
    },
}

/// A simulated T7. A new one has been powered since before time 0.
#[derive(Clone, Debug)]
pub struct T7 {
    /// Faults to show; may be changed at any time.
    pub faults: Faults,
    identity: Identity,
    settings: Settings,
    options: Options,
    random: Rand64,
    said: Record,
    power: Power,
    baud_index: u8,
    baud_change: Option<(Ns, u8)>,
    receiver: frame::Receiver,
    work: Work,
}

impl T7 {
    /// Makes a device with the given non-volatile settings.
    ///
    /// # Errors
    /// A setting that no T7 can have, or a latency above the documented limit.
    pub fn new(identity: Identity, settings: Settings, options: Options) -> Result<Self, BadOption> {
        for (latency, limit) in [(options.get_latency, GET_LIMIT), (options.set_latency, SET_LIMIT)] {
            let longest = latency.max.max(latency.min);
            if longest > limit {
                return Err(BadOption::Latency { longest, limit });
            }
        }
        if !SETTABLE_ADDRESSES.contains(&settings.address) && settings.address != DEFAULT_ADDRESS {
            return Err(BadOption::Address(settings.address));
        }
        if usize::from(settings.baud_index) >= BAUD_RATES.len() {
            return Err(BadOption::BaudIndex(settings.baud_index));
        }
        if !DAMPING_MS.contains(&settings.damping_ms) {
            return Err(BadOption::Damping(settings.damping_ms));
        }
        Ok(Self {
            faults: Faults::default(),
            identity,
            random: Rand64::new(u128::from(options.seed)),
            said: Record::default(),
            power: Power::On { ready_at: 0 },
            baud_index: settings.baud_index,
            baud_change: None,
            receiver: frame::Receiver::default(),
            work: Work::Idle,
            settings,
            options,
        })
    }

    /// What the factory burnt in.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The non-volatile settings as they are now.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Angles told so far.
    #[must_use]
    pub fn said(&self) -> &Record {
        &self.said
    }

    /// The angle that the device would report for an axis at `t` with its present settings, in 0.001°. 0 for
    /// an axis that the model does not have.
    #[must_use]
    pub fn angle_at(&self, axis: usize, t: Ns) -> i32 {
        if angle::has_axis(self.identity.model, axis) {
            angle::reported(self.absolute_at(axis, t), axis, &self.settings)
        } else {
            0
        }
    }

    fn absolute_at(&self, axis: usize, t: Ns) -> i32 {
        angle::absolute(&self.options.motion[axis], self.options.damping, self.settings.damping_ms, t)
    }

    /// A command to this device has been heard whole; `end` is the end of its last stop bit.
    fn accept(&mut self, end: Ns, message: frame::Message) {
        let is_set = message.body.first().and_then(|code| Command::from_code(*code)).is_some_and(Command::is_set);
        let latency = if is_set { self.options.set_latency } else { self.options.get_latency };
        let start_at = end + latency.draw(&mut self.random);
        let drive_at = start_at.saturating_sub(self.options.drive_lead).max(end);
        let at = if is_set { drive_at.min(end + self.options.write_time) } else { drive_at };
        self.work = Work::Command { at, slot: Slot { drive_at, start_at }, message };
    }

    /// Does all that is due at `now` except sending.
    fn settle(&mut self, now: Ns) {
        if let Some((_, index)) = self.baud_change.take_if(|(at, _)| *at <= now) {
            self.baud_index = index;
            self.receiver.reset();
        }
        if let Work::Command { at, slot, message } = &self.work
            && *at <= now
        {
            let (at, slot, message) = (*at, *slot, message.clone());
            self.work = self.carry_out(at, slot, &message);
        }
    }

    fn carry_out(&mut self, at: Ns, slot: Slot, message: &frame::Message) -> Work {
        let outcome = self.execute(at, message);
        if outcome.bytes.is_empty() {
            return Work::Idle;
        }
        let struck = self.faults.strike(outcome.bytes, command::with_status);
        Work::Answer {
            slot: Slot {
                drive_at: slot.drive_at.saturating_add(struck.delay),
                start_at: slot.start_at.saturating_add(struck.delay),
            },
            angles: if struck.unharmed { outcome.angles } else { Vec::new() },
            bytes: struck.bytes,
            new_baud: outcome.new_baud,
        }
    }
}

impl Node for T7 {
    fn baud(&self) -> u32 {
        BAUD_RATES[usize::from(self.baud_index)]
    }

    fn hear(&mut self, heard: Heard) {
        self.settle(heard.at);
        let awake = matches!(self.power, Power::On { ready_at } if ready_at <= heard.at);
        if !awake || self.faults.deaf {
            return;
        }
        let Some(message) = self.receiver.take(heard) else {
            return;
        };
        let for_us = message.address == self.settings.address || message.address == ALL_RESPOND;
        if for_us && matches!(self.work, Work::Idle) {
            self.accept(heard.at + uart::rest_of_stop_bit(self.baud()), message);
        }
    }

    fn next_event(&self) -> Option<Ns> {
        let work = match &self.work {
            Work::Idle => None,
            Work::Command { at, .. } => Some(*at),
            Work::Answer { slot, .. } => Some(slot.drive_at),
        };
        let baud_change = self.baud_change.map(|(at, _)| at);
        work.into_iter().chain(baud_change).min()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        self.settle(now);
        if !matches!(&self.work, Work::Answer { slot, .. } if slot.drive_at <= now) {
            return None;
        }
        let Work::Answer { slot, bytes, angles, new_baud } = core::mem::take(&mut self.work) else {
            return None;
        };
        let Slot { drive_at, start_at } = slot;
        let end = start_at + uart::characters(bytes.len(), self.baud());
        if let Some(index) = new_baud {
            self.baud_change = Some((end + BAUD_CHANGE_DELAY, index));
        }
        if bytes.is_empty() {
            return None;
        }
        for said in angles {
            self.said.push(Said { at: start_at, ..said });
        }
        // What was half heard before the driver went on cannot be completed.
        self.receiver.reset();
        Some(Burst { drive_at, start_at, bytes, baud: self.baud(), hold: self.options.hold })
    }

    fn power_off(&mut self, now: Ns) {
        self.settle(now);
        self.power = Power::Off;
        self.work = Work::Idle;
        self.baud_change = None;
        self.receiver.reset();
    }

    fn power_on(&mut self, now: Ns) {
        self.power = Power::On { ready_at: now + self.options.boot_time };
        self.baud_index = self.settings.baud_index;
    }
}

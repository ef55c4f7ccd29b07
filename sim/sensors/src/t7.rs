//! A simulated US Digital T7 inclinometer on RS485: commands 80 to 8F and 91.
//!
//! Source: "T7 Communication User Guide" 1.7. Messages are described in `t7/frame.rs`, the choices where the
//! document is silent in `t7/execute.rs` and `t7/angle.rs`.
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
mod execute;
mod frame;
mod options;
mod settings;

use oorandom::Rand64;

use crate::fault::AnswerFaults;
use crate::node::{Burst, Heard, Node, Ns};
use crate::said::{Record, Said};
use crate::uart;
use command::Command;
use execute::ALL_RESPOND;
pub use options::{BadOption, Damping, GET_LIMIT, Options, SET_LIMIT, TwinsAnswers};
pub use settings::{
    AXES, BAUD_RATES, DAMPING_MS, DEFAULT_ADDRESS, Direction, Flash, Identity, Model, OutputRange,
    SETTABLE_ADDRESSES, SINGLE_AXIS, StoredSettings,
};

/// From the end of the answer to Set Baud Rate to the change, "about 10 milliseconds" (section 2.7.2).
pub const BAUD_CHANGE_DELAY: Ns = 10_000_000;

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
    pub faults: AnswerFaults,
    /// Whether settings can be stored; may be changed at any time.
    pub flash: Flash,
    identity: Identity,
    settings: StoredSettings,
    writes: u64,
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
    pub fn new(identity: Identity, settings: StoredSettings, options: Options) -> Result<Self, BadOption> {
        options::check(&settings, &options)?;
        Ok(Self {
            faults: AnswerFaults::default(),
            flash: Flash::default(),
            identity,
            writes: 0,
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

    /// Another device of the same kind is in its place.
    pub fn replace_serial(&mut self, serial: u32) {
        self.identity.serial = serial;
    }

    /// The non-volatile settings as they are now.
    #[must_use]
    pub fn settings(&self) -> &StoredSettings {
        &self.settings
    }

    /// How often a setting has been written to the non-volatile memory, the same value included: it wears.
    #[must_use]
    pub fn writes(&self) -> u64 {
        self.writes
    }

    /// Angles sent so far.
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

    fn is_for_us(&self, message: &frame::Message) -> bool {
        let Some(&code) = message.body.first() else {
            return false;
        };
        let is_answer = Command::from_code(code).is_some_and(|command| command.is_answer(message.body.len()));
        let dropped = is_answer && self.options.twins_answers == TwinsAnswers::Dropped;
        (message.address == self.settings.address || message.address == ALL_RESPOND) && !dropped
    }

    /// A command to this device has been heard whole; `end` is the end of its last stop bit.
    fn accept(&mut self, end: Ns, message: frame::Message) {
        let is_set =
            message.body.first().and_then(|code| Command::from_code(*code)).is_some_and(Command::is_set);
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
        if self.is_for_us(&message) && matches!(self.work, Work::Idle) {
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

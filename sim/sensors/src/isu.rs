//! A simulated STT ISU inclinometer: the two-way binary mode and the ASCII output mode. Its PWM output is in
//! [`crate::pwm`].
//!
//! Source: "Interfacing to an ISU Module". Messages are described in `isu/frame.rs`, the EEPROM in
//! `isu/eeprom.rs`, the choices where the document is silent in `isu/command.rs`.
//!
//! Timing, per answer:
//!
//! ```text
//! command's last stop bit ends    TXEN         first start bit       last stop bit ends
//!           |------ latency --------|--- 1 ms ------|===== answer =======|-- hold --|
//!           |- word -|- word -| …   (EEPROM words are stored one after the other; the answer waits for them)
//! ```
//!
//! The module hears nothing while TXEN is on, nor while it works on a command.

mod angle;
mod ascii;
mod command;
mod eeprom;
mod frame;
mod measure;
mod options;
mod rx_low;

use std::collections::VecDeque;

use oorandom::Rand64;

use crate::fault::AnswerFaults;
use crate::node::{Burst, Heard, Node, Ns};
use crate::said::{Record, Said};
use crate::uart;
pub use angle::REFRESH;
use angle::Schedule;
use ascii::Ascii;
use command::{After, CURRENT_ANGLE};
pub use eeprom::{ChecksumScope, Content, Eeprom, WORDS, location};
pub use frame::OthersAnswers;
pub use options::{Adoption, AnswerAddress, Options, Supervision, WriteRamEcho};
pub use rx_low::RxLow;

/// The only bit rate, in bit/s (section 4).
pub const BAUD: u32 = 9_600;

/// TXEN goes high this long before a transmission (section 2).
pub const TXEN_LEAD: Ns = 1_000_000;

/// Micro-degrees in 0.01°, the step of the ASCII mode.
const MICRO_PER_CENTI: i64 = 10_000;

/// Bytes of RAM that a one-byte address reaches.
const RAM_SIZE: usize = 256;

/// State of health (section 4, "Module is in Error State").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Measures and answers.
    Normal,
    /// Answers everything but Go To Soft Error State with an error message.
    HardError,
    /// Answers normally, but does not measure.
    SoftError,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Off,
    Booting { ready_at: Ns },
    On,
}

/// The settings in effect, as opposed to those stored.
#[derive(Clone, Copy, Debug)]
struct Active {
    address: u8,
    null: u16,
}

/// A command being worked on.
#[derive(Clone, Debug)]
struct Job {
    writes: VecDeque<(u8, u16)>,
    /// When the first of `writes` has been stored.
    next_write: Ns,
    drive_at: Ns,
    answer: Vec<u8>,
    told: Option<Said>,
    after: After,
}

/// A simulated ISU. A new one has been powered since before time 0, with RX high.
#[derive(Clone, Debug)]
pub struct Isu {
    /// Faults to show; may be changed at any time.
    pub faults: AnswerFaults,
    /// The non-volatile memory; changes made here take effect with the next reset.
    pub eeprom: Eeprom,
    /// The sensing element gives no valid angle: Hard Error with the next measurement, and again after every
    /// reset. May be changed at any time.
    pub no_valid_angle: bool,
    writes: u64,
    options: Options,
    random: Rand64,
    said: Record,
    power: Power,
    mode: Mode,
    active: Active,
    ram: [u8; RAM_SIZE],
    schedule: Schedule,
    measured_at: Ns,
    /// The last angle measured, from the default null position, in 360/65536 °.
    measured: u16,
    receiver: frame::Receiver,
    ascii: Ascii,
    job: Option<Job>,
    /// End of the last burst, driver time included.
    silent_from: Ns,
}

impl Isu {
    /// Makes a module with the given EEPROM.
    #[must_use]
    pub fn new(eeprom: Eeprom, options: Options) -> Self {
        let mut isu = Self {
            faults: AnswerFaults::default(),
            random: Rand64::new(u128::from(options.seed)),
            said: Record::default(),
            power: Power::Booting { ready_at: 0 },
            mode: Mode::Normal,
            active: Active { address: eeprom.address(), null: eeprom.null() },
            ram: [0; RAM_SIZE],
            schedule: Schedule { origin: 0, phase: 0 },
            measured_at: 0,
            measured: 0,
            receiver: frame::Receiver::default(),
            ascii: Ascii::new(),
            job: None,
            silent_from: 0,
            eeprom,
            no_valid_angle: false,
            writes: 0,
            options,
        };
        isu.boot(0);
        isu
    }

    /// State of health.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The address it answers to, besides 0.
    #[must_use]
    pub fn address(&self) -> u8 {
        self.active.address
    }

    /// How many EEPROM words commands have written, the same values included: it wears.
    #[must_use]
    pub fn writes(&self) -> u64 {
        self.writes
    }

    /// Angles sent so far, in both modes.
    #[must_use]
    pub fn said(&self) -> &Record {
        &self.said
    }

    /// The null position in effect, in 360/65536 °. An angle in RAM may still be from the one before.
    #[must_use]
    pub fn null(&self) -> u16 {
        self.active.null
    }

    /// The code in RAM while the module is healthy: the last angle measured, from the null position.
    #[must_use]
    pub fn code(&self) -> u16 {
        u16::from_be_bytes([self.ram[usize::from(CURRENT_ANGLE)], self.ram[usize::from(CURRENT_ANGLE) + 1]])
    }

    /// The last angle, in µ°, as a record of the sent angles; its instant is filled in when it is sent.
    fn reading(&self, microdegrees: i64) -> Said {
        Said { at: 0, sampled_at: self.measured_at, axis: 0, microdegrees }
    }

    /// Does all that is due at `now` except sending.
    fn settle(&mut self, now: Ns) {
        if let Power::Booting { ready_at } = self.power
            && ready_at <= now
        {
            self.boot(ready_at);
        }
        if self.power != Power::On {
            return;
        }
        while let Some((at, address, word)) = self.next_write().filter(|(at, ..)| *at <= now) {
            // An angle that is due between two writes must see the memory as it is between them.
            self.refresh(at);
            self.eeprom.set_word(address, word);
            self.writes += 1;
            self.word_written();
        }
        self.refresh(now);
    }

    fn next_write(&self) -> Option<(Ns, u8, u16)> {
        let job = self.job.as_ref()?;
        job.writes.front().map(|&(address, word)| (job.next_write, address, word))
    }

    fn word_written(&mut self) {
        let Some(job) = &mut self.job else {
            return;
        };
        job.writes.pop_front();
        job.next_write += self.options.word_write_time;
        if job.writes.is_empty() {
            match job.after {
                After::Adopt if self.options.adoption == Adoption::AtOnce => self.adopt(),
                After::Null(null) => self.active.null = null,
                After::Nothing | After::Adopt | After::Reset => {}
            }
        }
    }

    /// A message has been heard whole; `end` is the end of its last stop bit.
    fn accept(&mut self, end: Ns, message: &frame::Message) {
        let Some(plan) = self.plan(message) else {
            return;
        };
        let thinking = self.options.latency.draw(&mut self.random);
        let writing = self.options.word_write_time * plan.writes.len() as u64;
        let struck = self.faults.strike(plan.answer, |_, _| None);
        self.job = Some(Job {
            writes: plan.writes,
            next_write: end + self.options.word_write_time,
            drive_at: end.saturating_add(thinking.max(writing)).saturating_add(struck.delay),
            answer: struck.bytes,
            told: plan.told.filter(|_| struck.unharmed),
            after: plan.after,
        });
    }

    /// When a line is due and the module has nothing else to do.
    fn line_due(&self) -> Option<Ns> {
        let free = self.power == Power::On && self.job.is_none();
        self.ascii.due().filter(|_| free).map(|due| due.max(self.silent_from))
    }

    fn send(&mut self, drive_at: Ns, bytes: Vec<u8>, told: Option<Said>) -> Option<Burst> {
        if bytes.is_empty() {
            return None;
        }
        let start_at = drive_at + TXEN_LEAD;
        self.silent_from = start_at + uart::characters(bytes.len(), BAUD) + self.options.hold;
        if let Some(said) = told {
            self.said.push(Said { at: start_at, ..said });
        }
        // What was half heard before TXEN went on cannot be completed.
        self.receiver.reset();
        Some(Burst { drive_at, start_at, bytes, baud: BAUD, hold: self.options.hold })
    }

    /// Sends the answer of the job that is done.
    fn send_answer(&mut self, job: Job) -> Option<Burst> {
        let burst = self.send(job.drive_at, job.answer, job.told);
        if job.after == After::Reset {
            let sent = burst.as_ref().map_or(job.drive_at, |_| self.silent_from);
            self.restart(sent);
        }
        burst
    }

    /// Sends the line that is due, unless there is no angle to tell.
    fn send_line(&mut self, due: Ns) -> Option<Burst> {
        self.ascii.done(due, self.schedule.next_after(due));
        if self.mode != Mode::Normal {
            return None;
        }
        let centidegrees = angle::to_centidegrees(self.code());
        let struck = self.faults.strike(angle::ascii_line(centidegrees), |_, _| None);
        let told = struck.unharmed.then(|| self.reading(centidegrees * MICRO_PER_CENTI));
        self.send(due.saturating_add(struck.delay), struck.bytes, told)
    }
}

impl Node for Isu {
    fn baud(&self) -> u32 {
        BAUD
    }

    fn hear(&mut self, heard: Heard) {
        self.settle(heard.at);
        if self.power != Power::On || self.faults.deaf || self.job.is_some() {
            return;
        }
        self.receiver.push(heard);
        let end = heard.at + uart::rest_of_stop_bit(BAUD);
        while self.job.is_none()
            && let Some(message) = self.receiver.next_message(self.options.others_answers)
        {
            self.accept(end, &message);
        }
    }

    fn next_event(&self) -> Option<Ns> {
        let boot = match self.power {
            Power::Booting { ready_at } => Some(ready_at),
            Power::Off | Power::On => None,
        };
        let write = self.next_write().map(|(at, ..)| at);
        let answer = self.job.as_ref().map(|job| job.drive_at);
        [boot, write, answer, self.line_due()].into_iter().flatten().min()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        self.settle(now);
        if let Some(job) = self.job.take_if(|job| job.drive_at <= now) {
            return self.send_answer(job);
        }
        let due = self.line_due().filter(|due| *due <= now)?;
        self.send_line(due)
    }

    fn power_off(&mut self, now: Ns) {
        self.settle(now);
        self.power = Power::Off;
        self.job = None;
        self.silent_from = now;
    }

    fn power_on(&mut self, now: Ns) {
        self.restart(now);
    }

    fn line_level(&mut self, now: Ns, high: bool) {
        self.settle(now);
        self.ascii.level(now, high, self.power == Power::On);
    }
}

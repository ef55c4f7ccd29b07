//! One slot: its configuration, when it is due, and how an outcome becomes its value.
//!
//! An outcome is taken in two steps. [`Slot::settle`] decides whether it is published and is over soon: the next request
//! waits for it. [`Slot::digest`] makes the angle of it, afterwards.

use clino_bus::Micros;
use clino_codec::angle::Angle;

use crate::config::Filter;
use crate::counters::{SlotCounters, bump32};
use crate::gate::{Demands, Gate, Verdict};
use crate::health::{Health, Link, Strikes};
use crate::maths::{Motion, Window, oriented};
use crate::phase::Phase;
use crate::{Reading, SlotConfig, Source, Status};

mod follow;

/// What a good answer says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sample {
    pub angle: Angle,
    /// In 0.01 °C, if it was asked for.
    pub temperature: Option<i16>,
    /// Whether the accelerations add up to 1 g, if they were asked for.
    pub one_g: Option<bool>,
}

impl Sample {
    pub fn new(angle: Angle) -> Sample {
        Sample { angle, temperature: None, one_g: None }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub config: SlotConfig,
    pub due: Micros,
    /// Tries of the reading in hand that have failed.
    pub tried: u8,
    /// Readings in a row to which there was no answer.
    pub silent: u8,
    /// Least time to the next probe of a dead node, in milliseconds.
    pub pause_ms: u16,
    pub counters: SlotCounters,
    pub health: Health,
    pub strikes: Strikes,
    pub phase: Phase,
    gate: Gate,
    link: Link,
    status: Status,
    fresh: bool,
    /// The last value is not digested yet.
    pending: bool,
    raw: Angle,
    temperature: Option<i16>,
    measured: Option<Micros>,
    sequence: u32,
    window: Window,
    motion: Motion,
}

/// Readings in a row with an acceleration that is not 1 g, after which that is said.
const GRAVITY_STRIKES: u8 = 3;

/// A value that is to be confirmed may wait for its witness this long, however soon a value of its slot is stale.
const LEAST_LIFE: Micros = Micros::from_millis(1_000);

impl Slot {
    pub fn new(config: SlotConfig) -> Slot {
        Slot {
            config,
            due: Micros::ZERO,
            tried: 0,
            silent: 0,
            pause_ms: 0,
            counters: SlotCounters::default(),
            health: Health::WELL,
            strikes: Strikes::default(),
            phase: Phase::default(),
            gate: Gate::NEW,
            link: Link::default(),
            status: if config.is_on() { Status::NeverRead } else { Status::Disabled },
            fresh: false,
            pending: false,
            raw: Angle::ZERO,
            temperature: None,
            measured: None,
            sequence: 0,
            window: Window::default(),
            motion: Motion::default(),
        }
    }

    /// From now on the slot means this: nothing was read yet.
    pub fn set(&mut self, config: SlotConfig) {
        *self = Slot { sequence: self.sequence.wrapping_add(1), ..Slot::new(config) };
    }

    /// Books the next reading one period after this one was due: no drift. A reading that comes so late that
    /// the next one is due already is not made up for; it is counted.
    pub fn book_next(&mut self, now: Micros) {
        let next = self.due + self.config.period();
        if next > now || self.config.period() == Micros::ZERO {
            self.due = next.max(now);
            return;
        }
        if self.due > Micros::ZERO {
            bump32(&mut self.counters.skipped);
        }
        self.due = now + self.config.period();
    }

    /// When the last value wants to be confirmed, if it does.
    pub fn confirm_at(&self, after: Micros) -> Option<Micros> {
        self.gate.hurry_since().map(|since| since + after)
    }

    /// Something was wrong with what was heard: the next value is not believed at once.
    pub fn shake(&mut self) {
        self.gate.shake();
    }

    /// A request of this slot ended, well or not.
    pub fn note_link(&mut self, failed: bool) {
        if let Some(noisy) = self.link.count(failed) {
            self.health.set(Health::NOISY, noisy);
        }
    }

    /// A reading ended at `at`: with what the sensor says (`fresh`: it has measured anew), or with the reason why it says
    /// nothing. `resolution` is that of the sensor, in µ°. Returns whether this is to be published.
    pub fn settle(&mut self, result: Result<Sample, Status>, at: Micros, fresh: bool, resolution: u32) -> bool {
        match result {
            Ok(sample) => {
                let Some(status) = self.judge(sample.angle, at, resolution) else { return false };
                self.status = status;
                if status == Status::Ok {
                    self.accept(sample, at, fresh);
                }
            }
            Err(status) => {
                self.status = status;
                self.gate.relax();
            }
        }
        self.sequence = self.sequence.wrapping_add(1);
        true
    }

    /// What a value is worth; `None` while that is not known.
    fn judge(&mut self, raw: Angle, at: Micros, resolution: u32) -> Option<Status> {
        if !self.config.confirm {
            return Some(Status::Ok);
        }
        let last = self.measured.map(|measured| (self.raw, measured));
        let life = LEAST_LIFE.max(self.config.stale_after.into());
        let demands = Demands { resolution, max_rate: self.config.max_rate, life };
        match self.gate.judge(raw, at, last, &demands) {
            Verdict::Publish => Some(Status::Ok),
            Verdict::Hold => None,
            Verdict::Suspect => Some(Status::Suspect),
        }
    }

    fn accept(&mut self, sample: Sample, at: Micros, fresh: bool) {
        self.digest();
        // A value is new, too, if the one that it confirms was.
        self.fresh = fresh || sample.angle != self.raw || self.motion.at.is_none();
        (self.raw, self.measured) = (sample.angle, Some(at));
        self.pending = true;
        self.temperature = sample.temperature;
        if let Some(one_g) = sample.one_g {
            let speaks = self.strikes.count(one_g, GRAVITY_STRIKES);
            self.health.set(Health::GRAVITY, speaks);
        }
    }

    /// Makes the angle of the last value, if that has not been done.
    pub fn digest(&mut self) {
        if !core::mem::take(&mut self.pending) || !self.fresh {
            return;
        }
        let Some(at) = self.measured else { return };
        let config = &self.config;
        let angle = oriented(self.raw, config.soft_zero, config.direction);
        let gap = self.motion.at.is_none_or(|before| at.since(before) > config.stale_after.into());
        if gap {
            self.window.clear();
        }
        if config.filter != Filter::Off {
            self.window.push(angle, config.filter.samples());
        }
        let angle = match config.filter {
            Filter::Off => angle,
            Filter::Mean(_) => self.window.mean(),
            Filter::Median(_) => self.window.median(),
        };
        self.motion.take(angle.normalised(config.range), at);
    }

    /// The last value as the sensor said it, and its rate, if it is *ok* at `now`.
    pub fn sound(&self, now: Micros) -> Option<(Angle, i32)> {
        let age = now.since(self.measured?);
        let is_ok = self.status == Status::Ok && age <= self.config.stale_after.into();
        is_ok.then_some((self.raw, self.motion.rate))
    }

    /// Whether there was no good value for so long that the last one is stale.
    pub fn is_stale(&self, now: Micros) -> bool {
        self.measured.is_none_or(|at| now.since(at) > self.config.stale_after.into())
    }

    pub fn is(&self, source: &Source) -> bool {
        self.config.enabled && self.config.source == *source
    }

    pub fn reading(&self, slot: u8) -> Reading {
        Reading {
            slot,
            source: self.config.source,
            enabled: self.config.enabled,
            sequence: self.sequence,
            health: self.health,
            fresh: self.fresh,
            status: self.status,
            raw: self.raw,
            angle: self.motion.angle,
            rate: self.motion.rate,
            turns: self.motion.turns,
            temperature: self.temperature,
            measured: self.measured,
            stale_after: self.config.stale_after,
            period: self.config.period,
            report_every: self.config.report_every,
        }
    }
}

//! One slot: its configuration, and how an outcome becomes its value. `schedule.rs` decides when it is asked.
//!
//! An outcome is taken in two steps. [`Slot::settle`] decides whether it is published and is over soon: the next
//! request waits for it. [`Slot::digest`] makes the angle of it, afterwards.

use clino_bus::{Duration, Instant};
use clino_codec::angle::Angle;

use crate::alarm::{Alarm, AlarmDetail, Watch};
use crate::config::SINGLE_AXIS;
use crate::counters::{SlotCounters, bump16, bump32};
use crate::health::Health;
use crate::summary::Standing;
use crate::trace::Purpose;
use crate::{Published, Reading, ReadingBrief, SlotConfig, Source, Status};

mod checks;
mod extremes;
mod filter;
mod maths;
mod motion;
mod plausibility;

pub(crate) use checks::{Strikes, is_one_g};
pub use extremes::{ExtremeAngle, Extremes};
pub(crate) use maths::step;

use checks::Link;
use filter::Window;
use maths::oriented;
use motion::Motion;
use plausibility::{Acceptance, Demands, Plausibility};

/// What a good answer says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sample {
    pub angle: Angle,
    /// In 0.01 °C, if it was asked for.
    pub temperature: Option<i16>,
    /// Whether the accelerations add up to 1 g, if they were asked for.
    pub one_g: Option<bool>,
    /// Serial number of the sensor, if it was asked for.
    pub serial: Option<u32>,
}

/// What a sensor says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Identity {
    /// It measures one axis only.
    SingleAxis,
    /// It measures all its axes.
    MultiAxis,
}

impl Sample {
    pub fn new(angle: Angle) -> Sample {
        Sample { angle, temperature: None, one_g: None, serial: None }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub config: SlotConfig,
    pub counters: SlotCounters,
    pub health: Health,
    pub strikes: Strikes,
    plausibility: Plausibility,
    link: Link,
    status: Status,
    last_error: Option<Status>,
    facts: Facts,
    raw: Angle,
    temperature: i16,
    /// When the last good value came; [`NEVER`] before the first.
    measured: Instant,
    sequence: u32,
    window: Window,
    motion: Motion,
    alarm: Watch,
    extremes: Extremes,
}

/// What else is known of a slot, a bit each.
#[derive(Clone, Copy, Debug)]
struct Facts(u8);

impl Facts {
    const NONE: Facts = Facts(0);
    /// The sensor is known to measure the slot's axis.
    const IDENTIFIED: Facts = Facts(1 << 0);
    /// The last value was measured anew.
    const FRESH: Facts = Facts(1 << 1);
    /// The last value is not digested yet.
    const PENDING: Facts = Facts(1 << 2);
    /// There was no good value for a while before the one that is pending.
    const GAP: Facts = Facts(1 << 3);

    const fn has(self, fact: Facts) -> bool {
        self.0 & fact.0 != 0
    }

    fn set(&mut self, fact: Facts, on: bool) {
        self.0 = if on { self.0 | fact.0 } else { self.0 & !fact.0 };
    }
}

/// What a slot says before it is read.
fn first_status(config: &SlotConfig) -> Status {
    match config.enabled {
        true if config.source.is_faulty() => Status::ConfigFault,
        true if config.is_on() => Status::NeverRead,
        _ => Status::Disabled,
    }
}

/// Whether angles of a slot mean the same under both configurations.
fn means_the_same(one: &SlotConfig, other: &SlotConfig) -> bool {
    let meaning = |c: &SlotConfig| (c.source, c.soft_zero, c.direction, c.range, c.filter, c.samples);
    meaning(one) == meaning(other)
}

/// Nothing was measured yet.
const NEVER: Instant = Instant::NEVER;
/// Nothing was said of the temperature: colder than anything.
const NO_TEMPERATURE: i16 = i16::MIN;

/// Readings in a row with an acceleration that is not 1 g, after which the slot signals it.
const GRAVITY_STRIKES: u8 = 3;

/// A candidate may wait for its confirmation this long, however soon a value of its slot is stale.
const LEAST_LIFE: Duration = Duration::from_millis(1_000);

impl Slot {
    pub fn new(config: SlotConfig) -> Slot {
        Slot {
            config,
            counters: SlotCounters::default(),
            health: Health::WELL,
            strikes: Strikes::default(),
            plausibility: Plausibility::NEW,
            link: Link::default(),
            status: first_status(&config),
            last_error: None,
            facts: Facts::NONE,
            raw: Angle::ZERO,
            temperature: NO_TEMPERATURE,
            measured: NEVER,
            sequence: 0,
            window: Window::EMPTY,
            motion: Motion::default(),
            alarm: Watch::default(),
            extremes: Extremes::NONE,
        }
    }

    /// From now on the slot means this: nothing was read yet. What was counted goes on, unless it was another sensor's.
    pub fn set(&mut self, config: SlotConfig) {
        let same = config.source == self.config.source;
        if !same {
            self.counters = SlotCounters::default();
        }
        if !same || !config.enabled {
            self.alarm = Watch::default();
        }
        self.alarm.change(&self.config.alarm, &config.alarm);
        if !means_the_same(&self.config, &config) {
            self.alarm.restart(&config.alarm);
            self.extremes = Extremes::NONE;
        }
        self.forget_numbers();
        self.health = Health::WELL;
        self.link = Link::default();
        self.status = first_status(&config);
        self.last_error = None;
        self.measured = NEVER;
        self.config = config;
    }

    /// The sensor's number means something else now: what was kept of it is forgotten, and nothing was read yet. What
    /// was counted goes on, and so does what is known of the node's answers.
    pub fn restart(&mut self) {
        self.forget_numbers();
        self.alarm.restart(&self.config.alarm);
        self.extremes = Extremes::NONE;
        if matches!(self.status, Status::Ok | Status::Suspect) {
            self.status = Status::NeverRead;
        }
        let is_noisy = self.health.has(Health::NOISY);
        self.health = Health::WELL;
        self.health.set(Health::NOISY, is_noisy);
    }

    /// What the sensor has said so far is worth nothing. In its place: a slot is large.
    fn forget_numbers(&mut self) {
        self.facts = Facts::NONE;
        self.strikes = Strikes::default();
        self.plausibility = Plausibility::NEW;
        self.raw = Angle::ZERO;
        self.temperature = NO_TEMPERATURE;
        self.window = Window::EMPTY;
        self.motion = Motion::default();
        self.sequence = self.sequence.wrapping_add(1);
    }

    /// How the last reading that failed did; `None` if none has.
    pub fn last_error(&self) -> Option<Status> {
        self.last_error
    }

    /// When the sensor has to be asked to confirm the last value, if at all.
    pub fn confirm_at(&self, after: Duration, now: Instant) -> Option<Instant> {
        self.plausibility.wants_confirmation().then(|| self.plausibility.since(now) + after)
    }

    /// Whether the next request is to confirm the last value.
    pub fn is_to_confirm(&self) -> bool {
        self.plausibility.wants_confirmation()
    }

    /// No value has to be confirmed out of turn any more.
    pub fn relax(&mut self) {
        self.plausibility.relax();
    }

    /// No answer has come for long: earlier values neither confirm nor predict anything.
    pub fn lose_track(&mut self) {
        self.plausibility.forget();
    }

    /// The angle that the sensor has said last, published or not; it has to have said one.
    pub fn last_said(&self) -> Angle {
        if self.config.confirm { self.plausibility.candidate() } else { self.raw }
    }

    /// Whether the sensor has to say what it is before its value is of use.
    pub fn is_to_identify(&self) -> bool {
        !self.facts.has(Facts::IDENTIFIED)
            && matches!(self.config.source, Source::T7 { axis, .. } if axis != SINGLE_AXIS)
    }

    /// The sensor has said what it is.
    ///
    /// # Errors
    /// It does not measure the slot's axis.
    pub fn identify(&mut self, identity: Identity) -> Result<(), Status> {
        let measures_all = identity == Identity::MultiAxis;
        self.facts.set(Facts::IDENTIFIED, measures_all);
        if measures_all { Ok(()) } else { Err(Status::ConfigFault) }
    }

    /// The sensor did not answer: another one may be in its place.
    pub fn forget_identity(&mut self) {
        self.facts.set(Facts::IDENTIFIED, false);
    }

    /// Something was wrong with what was received: the next value needs a confirmation.
    pub fn distrust(&mut self) {
        self.plausibility.distrust();
    }

    /// A whole, checked answer came, `response` after the request; whether it has a value is another matter.
    pub fn note_answer(&mut self, response: Duration, purpose: Purpose, has_value: bool) {
        self.counters.answered(response);
        self.note_link(false);
        if !has_value {
            bump16(&mut self.counters.refused);
        } else if purpose != Purpose::Retry {
            bump32(&mut self.counters.first_try);
        }
    }

    /// A request of this slot failed. `damaged`: characters came, and something was wrong with them.
    pub fn note_damage(&mut self, damaged: bool) {
        self.note_link(damaged);
        if damaged {
            self.plausibility.distrust();
        }
    }

    fn note_link(&mut self, failed: bool) {
        if let Some(noisy) = self.link.count(failed) {
            self.health.set(Health::NOISY, noisy);
        }
    }

    /// A reading ended at `at`: with what the sensor says (`fresh`: it has measured anew), or with the reason why it
    /// says nothing. `resolution` is that of the sensor, in µ°. Returns whether this is to be published.
    pub fn settle(
        &mut self,
        result: Result<Sample, Status>,
        at: Instant,
        fresh: bool,
        resolution: u32,
    ) -> bool {
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
                self.last_error = Some(status);
                self.plausibility.relax();
            }
        }
        self.sequence = self.sequence.wrapping_add(1);
        true
    }

    /// What a value is worth; `None` while that is not known.
    fn judge(&mut self, raw: Angle, at: Instant, resolution: u32) -> Option<Status> {
        if !self.config.confirm {
            return Some(Status::Ok);
        }
        let last = self.measured().map(|measured| (self.raw, measured));
        let life = LEAST_LIFE.max(self.config.stale_after());
        let demands = Demands { resolution, max_rate: self.config.max_rate, life };
        match self.plausibility.judge(raw, at, last, &demands) {
            Acceptance::Publish => Some(Status::Ok),
            Acceptance::Hold => None,
            Acceptance::Suspect => Some(Status::Suspect),
        }
    }

    fn accept(&mut self, sample: Sample, at: Instant, fresh: bool) {
        self.digest();
        // A value is new, too, if the one that it confirms was.
        self.facts.set(Facts::FRESH, fresh || sample.angle != self.raw || !self.motion.has_begun());
        if self.is_stale(at) {
            self.facts.set(Facts::GAP, true);
        }
        (self.raw, self.measured) = (sample.angle, at);
        self.facts.set(Facts::PENDING, true);
        self.temperature = sample.temperature.unwrap_or(NO_TEMPERATURE);
        if let Some(one_g) = sample.one_g {
            let speaks = self.strikes.count(one_g, GRAVITY_STRIKES);
            self.health.set(Health::GRAVITY, speaks);
        }
    }

    /// Makes the angle of the last value, if that has not been done.
    #[inline]
    pub fn digest(&mut self) {
        if self.facts.has(Facts::PENDING) {
            self.facts.set(Facts::PENDING, false);
            self.make_angle();
        }
    }

    #[inline(never)]
    fn make_angle(&mut self) {
        let gap = self.facts.has(Facts::GAP);
        if self.facts.has(Facts::FRESH) {
            self.facts.set(Facts::GAP, false);
            self.move_on(gap);
        }
        let angle = self.motion.published(self.config.range).mdeg();
        self.extremes.take(angle, self.measured);
        let watched = &self.config.alarm;
        if watched.is_on() {
            self.alarm.take(watched, angle, self.motion.rate, self.measured, gap);
        }
    }

    /// The last value is a new one: it goes through the filter, and the slot moves there.
    fn move_on(&mut self, gap: bool) {
        let config = &self.config;
        let angle = oriented(self.raw, config.soft_zero, config.direction);
        if gap {
            self.window = Window::EMPTY;
        }
        let angle = self.window.filtered(angle, config.filter, config.samples);
        self.motion.take(angle, config.range, self.measured, gap);
    }

    /// The last value as the sensor said it, and its rate, if it is *ok* at `now`.
    pub fn sound(&self, now: Instant) -> Option<(Angle, i32)> {
        (self.status == Status::Ok && !self.is_stale(now)).then_some((self.raw, self.motion.rate))
    }

    /// Whether there was no good value for so long that the last one is stale.
    pub fn is_stale(&self, now: Instant) -> bool {
        self.measured().is_none_or(|at| now > at + self.config.stale_after())
    }

    /// The lowest and the highest angle.
    pub fn extremes(&self) -> Extremes {
        self.extremes
    }

    /// Forgets the lowest and the highest angle.
    pub fn clear_extremes(&mut self) {
        self.extremes = Extremes::NONE;
    }

    /// Time passes: returns whether the alarm *no_value* is raised.
    pub fn watch(&mut self, now: Instant) -> bool {
        self.is_stale(now) && self.alarm.miss(&self.config.alarm, self.measured(), now)
    }

    /// Acknowledges all alarms that wait for it. Returns whether one did.
    pub fn acknowledge(&mut self) -> bool {
        self.alarm.acknowledge()
    }

    /// What is known of an alarm; `None` while it is quiet.
    pub fn alarm(&self, alarm: Alarm, now: Instant) -> Option<AlarmDetail> {
        self.alarm.detail(alarm, now)
    }

    /// When the last good value came.
    pub fn measured(&self) -> Option<Instant> {
        (self.measured != NEVER).then_some(self.measured)
    }

    pub fn is(&self, source: &Source) -> bool {
        self.config.enabled && self.config.source == *source
    }

    /// What the value is worth at `now`.
    pub fn status(&self, now: Instant) -> Status {
        if self.status == Status::Ok && self.is_stale(now) { Status::Stale } else { self.status }
    }

    /// The angle as it is published, if it is right and fresh at `now`.
    pub fn angle(&self, now: Instant) -> Option<Published> {
        (self.status(now) == Status::Ok).then(|| self.motion.published(self.config.range))
    }

    /// Time since the last good value was received, in milliseconds, if there was one.
    pub fn age_ms(&self, now: Instant) -> Option<u64> {
        self.measured().map(|at| now.millis_since(at))
    }

    /// What the slot declares at `now`.
    pub fn standing(&self, now: Instant) -> Standing {
        Standing {
            source: self.config.source,
            status: self.status(now),
            health: self.health,
            alarms: self.alarm.alarms(),
            age_ms: self.age_ms(now),
        }
    }

    /// What decides whether the slot is printed, as of `now`.
    pub fn brief(&self, now: Instant) -> ReadingBrief {
        ReadingBrief {
            status: self.status(now),
            sequence: self.sequence,
            alarms: self.alarm.alarms(),
            period: self.config.period,
            report_every: self.config.report_every,
        }
    }

    pub fn reading(&self, slot: u8) -> Reading {
        Reading {
            slot,
            source: self.config.source,
            enabled: self.config.enabled,
            sequence: self.sequence,
            health: self.health,
            alarms: self.alarm.alarms(),
            fresh: self.facts.has(Facts::FRESH),
            status: self.status,
            raw: self.raw,
            angle: self.motion.published(self.config.range),
            rate: self.motion.rate,
            turns: self.motion.turns,
            temperature: (self.temperature != NO_TEMPERATURE).then_some(self.temperature),
            measured: self.measured(),
            stale_after: self.config.stale_after(),
            period: self.config.period,
            report_every: self.config.report_every,
        }
    }
}

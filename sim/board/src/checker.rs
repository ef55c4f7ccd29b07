//! Compares the angles that the gateway prints with the true angles of the simulation.
//!
//! A reading line of age *a* whose first character is sent at *t* is right if the true angle comes within the
//! tolerance at some instant in [*t* − *a* − hold − margin, *t*]. The hold is how old the angle in a sensor's
//! answer may be; the margin is what a line may wait between being made and being sent. The comparison knows
//! that angles wrap. A reading that says "ok" although the sensor was away during the whole window repeats
//! an old angle as fresh, and is wrong.

mod reading;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fmt;

use crate::console::Line;
use crate::edges::HeardAngle;
use crate::scenario::{Kind, SensorIdentity, Truth};
use clino_sim::motion::{DEGREE, Motion, TURN, bidirectional};
use clino_sim::node::Ns;

pub use reading::{Reading, parse};

const MS: Ns = 1_000_000;
/// Longest wait of a line for the lines before it. The gateway makes a line when fewer than 16 characters are ahead of it, 1.4 ms
/// at 115200 bit/s. The rest is for the time between the reading and the line: levels above the main loop, which makes the
/// lines, may hold it off.
pub const MARGIN: Ns = 10 * MS;
/// Time in which a slot must have settled at the end of a run.
pub const SETTLE: Ns = 1_000 * MS;
/// Step in which the true angle is searched for its closest approach.
const STEP: Ns = MS / 10;
/// Wrong readings that are kept word for word, per slot.
const KEPT: usize = 3;

/// What the readings of one sensor came to.
#[derive(Clone, Debug)]
pub struct Slot {
    /// The truth it was compared with.
    pub truth: Truth,
    /// Reading lines.
    pub readings: u64,
    /// Those with status `ok`.
    pub ok: u64,
    /// Those with status `ok` and a wrong angle.
    pub wrong: u64,
    /// The first few of them.
    pub wrong_kept: Vec<String>,
    /// Largest distance of an `ok` reading from the truth, in micro-degrees.
    pub max_error: i64,
    /// Longest time between a reading being sent and the truth having last been within the tolerance of it.
    pub max_lag: Ns,
    /// When the first right `ok` line was complete.
    pub first_ok: Option<Ns>,
    /// When the last right `ok` line was begun.
    pub last_ok: Option<Ns>,
    /// Angles of a PWM input, to be compared with its edges.
    pub heard: Vec<HeardAngle>,
    /// The last reading.
    pub last: Option<(Ns, Reading)>,
    /// Numbers under which it was printed; one if all is well.
    pub numbers: BTreeSet<u32>,
}

/// The truth about a run and the readings so far.
#[derive(Debug)]
pub struct Checker {
    slots: Vec<Slot>,
    unparsable: u64,
    unparsable_kept: Vec<String>,
    stranger_ok: Vec<String>,
}

impl Checker {
    /// Nothing read yet.
    pub fn new(truths: Vec<Truth>) -> Self {
        let slot = |truth| Slot {
            truth,
            readings: 0,
            ok: 0,
            wrong: 0,
            wrong_kept: Vec::new(),
            max_error: 0,
            max_lag: 0,
            first_ok: None,
            last_ok: None,
            heard: Vec::new(),
            last: None,
            numbers: BTreeSet::new(),
        };
        let slots = truths.into_iter().map(slot).collect();
        Self { slots, unparsable: 0, unparsable_kept: Vec::new(), stranger_ok: Vec::new() }
    }

    /// Takes one line of the console. Objects that are no readings are let pass.
    pub fn line(&mut self, line: &Line) {
        match reading::parse(&line.text) {
            Ok(Some(reading)) => self.reading(line, reading),
            Ok(None) => {}
            Err(why) => {
                self.unparsable += 1;
                keep(&mut self.unparsable_kept, || format!("{why}: {}", line.text));
            }
        }
    }

    /// The sensors of the scenario and the results of their readings.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// Lines that were no JSON object, or no consistent reading.
    pub fn unparsable(&self) -> u64 {
        self.unparsable
    }

    /// When the first right T7 reading was complete.
    pub fn first_t7(&self) -> Option<Ns> {
        self.slots
            .iter()
            .filter(|slot| slot.truth.who.kind == Kind::T7)
            .filter_map(|slot| slot.first_ok)
            .min()
    }

    /// Everything that is wrong with the readings of a run that ended at `end`.
    pub fn faults(&self, end: Ns) -> Vec<String> {
        let mut faults = Vec::new();
        if self.unparsable > 0 {
            let examples = self.unparsable_kept.join("; ");
            faults.push(format!("{} unreadable console lines: {examples}", self.unparsable));
        }
        faults.extend(
            self.stranger_ok.iter().map(|text| format!("ok from a sensor that is not there: {text}")),
        );
        for slot in &self.slots {
            if slot.wrong > 0 {
                let (name, examples) = (&slot.truth.who, slot.wrong_kept.join("; "));
                faults
                    .push(format!("{name}: {} of {} ok readings are wrong: {examples}", slot.wrong, slot.ok));
            }
            if slot.numbers.len() > 1 {
                faults.push(format!("{}: printed as slots {:?}", slot.truth.who, slot.numbers));
            }
            faults.extend(slot.fault_at_end(end));
        }
        faults
    }

    fn reading(&mut self, line: &Line, reading: Reading) {
        match self.slots.iter_mut().find(|slot| slot.truth.who.is(&reading)) {
            Some(slot) => slot.reading(line, reading),
            None if reading.status == "ok" => keep(&mut self.stranger_ok, || line.text.clone()),
            None => {}
        }
    }
}

impl Slot {
    fn reading(&mut self, line: &Line, reading: Reading) {
        self.readings += 1;
        self.numbers.insert(reading.slot);
        if let (Some(angle), Some(age)) = (reading.angle_deg, reading.age_ms) {
            self.ok += 1;
            let angle = (angle * DEGREE as f64).round() as i64;
            if self.truth.who.kind == Kind::Pwm {
                self.heard.push(HeardAngle { began: line.began, at: line.at, angle });
            }
            // The age is rounded to a millisecond, either way.
            let measured = line.began.saturating_sub(age.saturating_add(1).saturating_mul(MS) + MARGIN);
            let from = measured.saturating_sub(self.truth.hold);
            let Match { error, lag } =
                compare(&self.truth.motion, angle, self.truth.tolerance, from, line.began);
            let away = self.truth.away.iter().any(|&(gone, back)| gone <= measured && back > line.began);
            self.max_error = self.max_error.max(error);
            self.max_lag = self.max_lag.max(lag.unwrap_or(0));
            if error > self.truth.tolerance || away {
                self.wrong += 1;
                keep(&mut self.wrong_kept, || {
                    let why = if away { "while away".into() } else { format!("off by {}", degrees(error)) };
                    format!("at {:.3} s, {why}: {}", line.began as f64 / 1e9, line.text)
                });
            } else {
                self.first_ok = self.first_ok.or(Some(line.at));
                self.last_ok = Some(line.began);
            }
        }
        self.last = Some((line.began, reading));
    }

    /// What this slot should have come to at the end, and has not.
    fn fault_at_end(&self, end: Ns) -> Option<String> {
        let name = &self.truth.who;
        let settling = end.saturating_sub(SETTLE);
        let overlaps = |&&(from, until): &&(Ns, Ns)| from < end && until > settling;
        let Some((at, last)) = &self.last else {
            return Some(format!("{name}: no reading"));
        };
        let last_words = format!("last reading {} at {:.3} s", last.status, *at as f64 / 1e9);
        if let Some(&(from, until)) = self.truth.away.iter().find(overlaps) {
            let gone = from <= settling && until >= end;
            return (gone && last.status == "ok").then(|| format!("{name}: away, but {last_words}"));
        }
        if self.truth.disturbed.iter().any(|interval| overlaps(&interval)) {
            return None;
        }
        let recent = self.last_ok.is_some_and(|at| at >= settling);
        let well = if self.truth.unreliable { recent } else { recent && last.status == "ok" };
        (!well).then(|| format!("{name}: {last_words}, expected a right angle within the last second"))
    }
}

impl SensorIdentity {
    fn is(&self, reading: &Reading) -> bool {
        self.kind.name() == reading.kind && self.bus == reading.bus && self.address == reading.address
    }
}

impl Kind {
    /// As the console names it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::T7 => "t7",
            Kind::Isu => "isu",
            Kind::Pwm => "pwm",
        }
    }
}

impl fmt::Display for SensorIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            Kind::Pwm => write!(f, "{}", self.bus),
            kind => write!(f, "{} {}", kind.name(), self.address),
        }
    }
}

/// How a reading compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Match {
    /// Smallest distance within the window, in micro-degrees.
    error: i64,
    /// How long before the end of the window the truth was last within the tolerance.
    lag: Option<Ns>,
}

/// Searches the window from its end backwards, as far as the truth first agrees exactly.
fn compare(motion: &Motion, angle: i64, tolerance: i64, from: Ns, until: Ns) -> Match {
    let distance = |at: Ns| bidirectional(angle - motion.at(at));
    let mut after = distance(until);
    let mut error = after.abs();
    let mut lag = (error <= tolerance).then_some(0);
    let mut at = until;
    while at > from && error > 0 {
        at = at.saturating_sub(STEP).max(from);
        let now = distance(at);
        // A change of sign near zero: the truth passed through the angle. Near half a turn it only wrapped.
        let passed = now.signum() != after.signum() && now.abs().max(after.abs()) < TURN / 4;
        error = if passed { 0 } else { error.min(now.abs()) };
        if error <= tolerance {
            lag = lag.or(Some(until - at));
        }
        after = now;
    }
    Match { error, lag }
}

fn degrees(microdegrees: i64) -> String {
    format!("{:.4} deg", microdegrees as f64 / DEGREE as f64)
}

fn keep(list: &mut Vec<String>, text: impl FnOnce() -> String) {
    if list.len() < KEPT {
        list.push(text());
    }
}

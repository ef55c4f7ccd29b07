//! Compares what the gateway prints with what the simulator knows to be true.
//!
//! A reading line of age *a* whose first character is sent at *t* is right if the true angle comes within the
//! tolerance at some instant in [*t* − *a* − hold − margin, *t*]. The hold is how old the angle in a sensor's
//! answer may be; the margin is what a line may wait between being made and being sent. The comparison knows
//! that angles wrap. A reading that says "ok" although the sensor was away during the whole window repeats
//! an old angle as fresh, and is wrong.

use std::fmt;

use clino_sim::motion::{DEGREE, Motion, bidirectional};
use clino_sim::node::Ns;
use serde::Deserialize;

use crate::console::Line;
use crate::scenario::{Identity, Kind, Truth};

const MS: Ns = 1_000_000;
/// Longest wait of a line for those before it: a console queue of 1 KiB at 115200 is 89 ms long.
pub const MARGIN: Ns = 100 * MS;
/// Time in which a slot must have settled at the end of a run.
pub const SETTLE: Ns = 1_000 * MS;
/// Step in which the true angle is searched for its closest approach.
const STEP: Ns = MS / 10;
/// Wrong readings that are kept word for word, per slot.
const KEPT: usize = 3;

/// A reading line as the gateway prints it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Reading {
    /// Number of the slot.
    pub slot: u32,
    /// `t7`, `isu` or `pwm`.
    pub kind: String,
    /// `t7`, `isu`, `pwm1` or `pwm2`.
    pub bus: String,
    /// Address on the bus, 0 for PWM.
    pub address: u8,
    /// `ok` or what is the matter.
    pub status: String,
    /// The angle in degrees when the status is `ok`.
    pub angle_deg: Option<f64>,
    /// Time since the angle was received, in ms; none if there never was one.
    pub age_ms: Option<u64>,
}

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
    /// When the first right `ok` line was complete.
    pub first_ok: Option<Ns>,
    /// When the last right `ok` line was begun.
    pub last_ok: Option<Ns>,
    /// The last reading.
    pub last: Option<(Ns, Reading)>,
}

/// The truth about a run and the readings so far.
#[derive(Debug)]
pub struct Oracle {
    slots: Vec<Slot>,
    unparsable: u64,
    unparsable_kept: Vec<String>,
    stranger_ok: Vec<String>,
}

/// What is wrong with a run, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault(pub String);

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Oracle {
    /// Nothing read yet.
    pub fn new(truths: Vec<Truth>) -> Self {
        let slot = |truth| Slot {
            truth,
            readings: 0,
            ok: 0,
            wrong: 0,
            wrong_kept: Vec::new(),
            max_error: 0,
            first_ok: None,
            last_ok: None,
            last: None,
        };
        let slots = truths.into_iter().map(slot).collect();
        Self { slots, unparsable: 0, unparsable_kept: Vec::new(), stranger_ok: Vec::new() }
    }

    /// Takes one line of the console. Objects that are no readings are let pass.
    pub fn line(&mut self, line: &Line) {
        match parse(&line.text) {
            Ok(Some(reading)) => self.reading(line, reading),
            Ok(None) => {}
            Err(why) => {
                self.unparsable += 1;
                keep(&mut self.unparsable_kept, || format!("{why}: {}", line.text));
            }
        }
    }

    /// The sensors of the scenario and what came of them.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// Lines that were no JSON object, or no consistent reading.
    pub fn unparsable(&self) -> u64 {
        self.unparsable
    }

    /// When the first right T7 reading was complete.
    pub fn first_t7(&self) -> Option<Ns> {
        self.slots.iter().filter(|slot| slot.truth.who.kind == Kind::T7).filter_map(|slot| slot.first_ok).min()
    }

    /// Everything that is wrong with the readings of a run that ended at `end`.
    pub fn faults(&self, end: Ns) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.unparsable > 0 {
            let examples = self.unparsable_kept.join("; ");
            faults.push(Fault(format!("{} unreadable console lines: {examples}", self.unparsable)));
        }
        faults.extend(self.stranger_ok.iter().map(|text| Fault(format!("ok from a sensor that is not there: {text}"))));
        for slot in &self.slots {
            if slot.wrong > 0 {
                let (name, examples) = (&slot.truth.who, slot.wrong_kept.join("; "));
                faults.push(Fault(format!("{name}: {} of {} ok readings are wrong: {examples}", slot.wrong, slot.ok)));
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
        if let (Some(angle), Some(age)) = (reading.angle_deg, reading.age_ms) {
            self.ok += 1;
            let angle = (angle * DEGREE as f64).round() as i64;
            // The age is rounded to a millisecond, either way.
            let measured = line.began.saturating_sub(age.saturating_add(1).saturating_mul(MS) + MARGIN);
            let from = measured.saturating_sub(self.truth.hold);
            let error = closest(&self.truth.motion, angle, from, line.began);
            let away = self.truth.away.iter().any(|&(gone, back)| gone <= measured && back > line.began);
            self.max_error = self.max_error.max(error);
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
    fn fault_at_end(&self, end: Ns) -> Option<Fault> {
        let name = &self.truth.who;
        let settling = end.saturating_sub(SETTLE);
        let overlaps = |&&(from, until): &&(Ns, Ns)| from < end && until > settling;
        let Some((at, last)) = &self.last else {
            return Some(Fault(format!("{name}: no reading")));
        };
        let last_words = format!("last reading {} at {:.3} s", last.status, *at as f64 / 1e9);
        if let Some(&(from, until)) = self.truth.away.iter().find(overlaps) {
            let gone = from <= settling && until >= end;
            return (gone && last.status == "ok").then(|| Fault(format!("{name}: away, but {last_words}")));
        }
        if self.truth.disturbed.iter().any(|interval| overlaps(&interval)) {
            return None;
        }
        let recent = self.last_ok.is_some_and(|at| at >= settling);
        let well = if self.truth.unreliable { recent } else { recent && last.status == "ok" };
        (!well).then(|| Fault(format!("{name}: {last_words}, expected a right angle within the last second")))
    }
}

impl Identity {
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

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            Kind::Pwm => write!(f, "{}", self.bus),
            kind => write!(f, "{} {}", kind.name(), self.address),
        }
    }
}

/// A reading, or nothing if it is another object.
fn parse(text: &str) -> Result<Option<Reading>, String> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let Some(object) = value.as_object() else { return Err("no JSON object".into()) };
    if !object.contains_key("slot") {
        return Ok(None);
    }
    let reading = Reading::deserialize(&value).map_err(|error| error.to_string())?;
    let ok = reading.status == "ok";
    if ok != reading.angle_deg.is_some() || ok && reading.age_ms.is_none() {
        return Err("an angle and an age exactly when the status is ok".into());
    }
    Ok(Some(reading))
}

/// Smallest distance between `angle` and the true angle within an interval, in micro-degrees.
fn closest(motion: &Motion, angle: i64, from: Ns, until: Ns) -> i64 {
    let distance = |at: Ns| bidirectional(angle - motion.at(at));
    let mut before = distance(from);
    let mut best = before.abs();
    let mut at = from;
    while at < until && best > 0 {
        at = until.min(at + STEP);
        let now = distance(at);
        // A change of sign near zero: the truth passed through the angle. Near half a turn it only wrapped.
        let passed = now.signum() != before.signum() && now.abs() < 90 * DEGREE && before.abs() < 90 * DEGREE;
        best = if passed { 0 } else { best.min(now.abs()) };
        before = now;
    }
    best
}

fn degrees(microdegrees: i64) -> String {
    format!("{:.4} deg", microdegrees as f64 / DEGREE as f64)
}

fn keep(list: &mut Vec<String>, text: impl FnOnce() -> String) {
    if list.len() < KEPT {
        list.push(text());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Ns = 1_000_000_000;

    fn truth(motion: Motion) -> Truth {
        Truth {
            who: Identity { kind: Kind::T7, bus: "t7", address: 1 },
            motion,
            hold: 5 * MS,
            tolerance: 2_000,
            away: vec![],
            disturbed: vec![],
            unreliable: false,
        }
    }

    fn line_at(began: Ns, text: &str) -> Line {
        Line { began, at: began + 9 * MS, text: text.into() }
    }

    fn ok(angle: f64, age: u64) -> String {
        format!(
            r#"{{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":{angle},"age_ms":{age}}}"#
        )
    }

    const NO_ANSWER: &str =
        r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"no_answer","angle_deg":null,"age_ms":40}"#;

    fn run(truth: Truth, lines: &[(Ns, &str)]) -> Oracle {
        let mut oracle = Oracle::new(vec![truth]);
        for &(at, text) in lines {
            oracle.line(&line_at(at, text));
        }
        oracle
    }

    #[test]
    fn a_constant_angle_is_right_within_the_tolerance_only() {
        for (angle, right) in [(12.0, true), (12.002, true), (11.998, true), (12.0021, false), (372.0, true), (-348.0, true)] {
            let oracle = run(truth(Motion::Constant(12_000_000)), &[(SECOND, &ok(angle, 3))]);
            assert_eq!(oracle.slots()[0].wrong == 0, right, "{angle}");
            assert_eq!(oracle.faults(SECOND).is_empty(), right, "{angle}");
        }
    }

    #[test]
    fn a_moving_angle_is_right_if_it_was_true_within_the_window() {
        // 10 deg/s: at 2 s it is at 20 deg; with age 50 ms the window reaches back 50 + 1 + 5 + 100 ms = 1.56 deg.
        let motion = Motion::Ramp { start: 0, rate: 10_000_000 };
        for (angle, right) in [(20.0, true), (19.3, true), (18.44, true), (18.43, false), (20.003, false)] {
            let oracle = run(truth(motion.clone()), &[(2 * SECOND, &ok(angle, 50))]);
            assert_eq!(oracle.slots()[0].wrong == 0, right, "{angle}");
        }
    }

    #[test]
    fn the_wrap_of_a_ramp_is_neither_a_passage_nor_an_error() {
        let motion = Motion::Ramp { start: 175_000_000, rate: 100_000_000 };
        // At 1 s: 275 deg = -85 deg.
        for (angle, right) in [(-85.0, true), (275.0, true), (95.0, false), (0.0, false)] {
            let oracle = run(truth(motion.clone()), &[(SECOND, &ok(angle, 0))]);
            assert_eq!(oracle.slots()[0].wrong == 0, right, "{angle}");
        }
    }

    #[test]
    fn a_fast_motion_between_two_steps_of_the_search_is_found() {
        // 360 deg/s is 0.036 deg per search step, far more than the tolerance.
        let motion = Motion::Ramp { start: 0, rate: 360_000_000 };
        let oracle = run(truth(motion), &[(SECOND, &ok(341.237, 0))]);
        assert_eq!((oracle.slots()[0].wrong, oracle.slots()[0].max_error), (0, 0));
    }

    #[test]
    fn lines_that_are_no_objects_or_contradict_themselves_are_counted() {
        for text in [
            "hello",
            "",
            "[1]",
            r#"{"slot":0,"kind":"t7"}"#,
            r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":null,"age_ms":1}"#,
            r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"stale","angle_deg":1.0,"age_ms":1}"#,
            r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":1.0,"age_ms":null}"#,
            r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":NaN,"age_ms":1}"#,
        ] {
            let oracle = run(truth(Motion::Constant(0)), &[(SECOND, text), (SECOND, &ok(0.0, 1))]);
            assert_eq!(oracle.unparsable(), 1, "{text}");
            assert_eq!(oracle.faults(SECOND).len(), 1, "{text}");
        }
        let oracle = run(truth(Motion::Constant(0)), &[(SECOND, r#"{"stats":"t7","polls":3}"#), (SECOND, &ok(0.0, 1))]);
        assert_eq!(oracle.faults(SECOND), []);
    }

    #[test]
    fn a_slot_without_a_reading_or_with_an_old_one_is_a_fault() {
        assert_eq!(run(truth(Motion::Constant(0)), &[]).faults(SECOND).len(), 1);
        let oracle = run(truth(Motion::Constant(0)), &[(SECOND, &ok(0.0, 1))]);
        assert!(oracle.faults(2 * SECOND).is_empty());
        assert_eq!(oracle.faults(2 * SECOND + 1).len(), 1);
        let oracle = run(truth(Motion::Constant(0)), &[(SECOND, &ok(0.0, 1)), (SECOND + MS, NO_ANSWER)]);
        assert_eq!(oracle.faults(SECOND + 2 * MS).len(), 1);
    }

    #[test]
    fn an_unreliable_slot_needs_one_right_reading_near_the_end() {
        let unreliable = Truth { unreliable: true, ..truth(Motion::Constant(0)) };
        let oracle = run(unreliable, &[(SECOND, &ok(0.0, 1)), (SECOND + MS, NO_ANSWER)]);
        assert!(oracle.faults(2 * SECOND).is_empty());
        assert_eq!(oracle.faults(3 * SECOND).len(), 1);
    }

    #[test]
    fn a_sensor_that_is_away_must_not_read_ok() {
        let away = Truth { away: vec![(SECOND, 4 * SECOND)], ..truth(Motion::Constant(0)) };
        let oracle = run(away.clone(), &[(2 * SECOND, &ok(0.0, 1))]);
        assert_eq!(oracle.slots()[0].wrong, 1, "an old angle sold as fresh");
        // The same reading with its true age is right, but after a second it must have been given up.
        let oracle = run(away.clone(), &[(2 * SECOND, &ok(0.0, 1_000))]);
        assert_eq!(oracle.slots()[0].wrong, 0);
        assert_eq!(oracle.faults(3 * SECOND).len(), 1);
        let oracle = run(away.clone(), &[(2 * SECOND, NO_ANSWER)]);
        assert_eq!(oracle.faults(3 * SECOND), []);
        // Back since half a second: nothing is demanded yet.
        assert_eq!(oracle.faults(4 * SECOND + SECOND / 2), []);
        assert_eq!(oracle.faults(5 * SECOND).len(), 1);
    }

    #[test]
    fn a_sensor_that_is_not_in_the_scenario_must_not_read_ok() {
        let stranger = ok(0.0, 1).replace(r#""address":1"#, r#""address":9"#);
        let oracle = run(truth(Motion::Constant(0)), &[(SECOND, &stranger), (SECOND, &ok(0.0, 1))]);
        assert_eq!(oracle.faults(SECOND).len(), 1);
    }

    #[test]
    fn the_first_right_t7_reading_is_timed_at_its_end() {
        let oracle = run(truth(Motion::Constant(0)), &[(MS, NO_ANSWER), (50 * MS, &ok(1.0, 0)), (60 * MS, &ok(0.0, 0))]);
        assert_eq!(oracle.first_t7(), Some(69 * MS));
    }
}

//! Readings and truths made by hand.

use super::*;

const SECOND: Ns = 1_000_000_000;

fn truth(motion: Motion) -> Truth {
    Truth {
        who: SensorIdentity { kind: Kind::T7, bus: "t7", address: 1 },
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

fn run(truth: Truth, lines: &[(Ns, &str)]) -> Checker {
    let mut checker = Checker::new(vec![truth]);
    for &(at, text) in lines {
        checker.line(&line_at(at, text));
    }
    checker
}

#[test]
fn a_constant_angle_is_right_within_the_tolerance_only() {
    for (angle, right) in
        [(12.0, true), (12.002, true), (11.998, true), (12.0021, false), (372.0, true), (-348.0, true)]
    {
        let checker = run(truth(Motion::Constant(12_000_000)), &[(SECOND, &ok(angle, 3))]);
        assert_eq!(checker.slots()[0].wrong == 0, right, "{angle}");
        assert_eq!(checker.faults(SECOND).is_empty(), right, "{angle}");
    }
}

#[test]
fn a_moving_angle_is_right_if_it_was_true_within_the_window() {
    // 10 deg/s: at 2 s it is at 20 deg; with age 50 ms the window reaches back 50 + 1 + 5 + 10 ms = 0.66 deg.
    let motion = Motion::Ramp { start: 0, rate: 10_000_000 };
    for (angle, right) in [(20.0, true), (19.5, true), (19.34, true), (19.33, false), (20.003, false)] {
        let checker = run(truth(motion.clone()), &[(2 * SECOND, &ok(angle, 50))]);
        assert_eq!(checker.slots()[0].wrong == 0, right, "{angle}");
    }
}

#[test]
fn the_wrap_of_a_ramp_is_neither_a_passage_nor_an_error() {
    let motion = Motion::Ramp { start: 175_000_000, rate: 100_000_000 };
    // At 1 s: 275 deg = -85 deg.
    for (angle, right) in [(-85.0, true), (275.0, true), (95.0, false), (0.0, false)] {
        let checker = run(truth(motion.clone()), &[(SECOND, &ok(angle, 0))]);
        assert_eq!(checker.slots()[0].wrong == 0, right, "{angle}");
    }
}

#[test]
fn a_fast_motion_between_two_steps_of_the_search_is_found() {
    // 360 deg/s is 0.036 deg per search step, far more than the tolerance.
    let motion = Motion::Ramp { start: 0, rate: 360_000_000 };
    let checker = run(truth(motion), &[(SECOND, &ok(355.237, 0))]);
    assert_eq!((checker.slots()[0].wrong, checker.slots()[0].max_error), (0, 0));
}

#[test]
fn the_lag_is_how_long_ago_the_reading_was_true() {
    // At 10 deg/s 19.5 deg was true 50 ms before 2 s, and within 0.002 deg until 0.2 ms later.
    let motion = Motion::Ramp { start: 0, rate: 10_000_000 };
    let checker = run(truth(motion), &[(2 * SECOND, &ok(19.5, 50))]);
    let lag = checker.slots()[0].max_lag;
    assert!((49_700_000..=50_000_000).contains(&lag), "{lag}");
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
        let checker = run(truth(Motion::Constant(0)), &[(SECOND, text), (SECOND, &ok(0.0, 1))]);
        assert_eq!(checker.unparsable(), 1, "{text}");
        assert_eq!(checker.faults(SECOND).len(), 1, "{text}");
    }
    let checker =
        run(truth(Motion::Constant(0)), &[(SECOND, r#"{"stats":"t7","polls":3}"#), (SECOND, &ok(0.0, 1))]);
    assert!(checker.faults(SECOND).is_empty());
}

#[test]
fn a_slot_without_a_reading_or_with_an_old_one_is_a_fault() {
    assert_eq!(run(truth(Motion::Constant(0)), &[]).faults(SECOND).len(), 1);
    let checker = run(truth(Motion::Constant(0)), &[(SECOND, &ok(0.0, 1))]);
    assert!(checker.faults(2 * SECOND).is_empty());
    assert_eq!(checker.faults(2 * SECOND + 1).len(), 1);
    let checker = run(truth(Motion::Constant(0)), &[(SECOND, &ok(0.0, 1)), (SECOND + MS, NO_ANSWER)]);
    assert_eq!(checker.faults(SECOND + 2 * MS).len(), 1);
}

#[test]
fn an_unreliable_slot_needs_one_right_reading_near_the_end() {
    let unreliable = Truth { unreliable: true, ..truth(Motion::Constant(0)) };
    let checker = run(unreliable, &[(SECOND, &ok(0.0, 1)), (SECOND + MS, NO_ANSWER)]);
    assert!(checker.faults(2 * SECOND).is_empty());
    assert_eq!(checker.faults(3 * SECOND).len(), 1);
}

#[test]
fn a_sensor_that_is_away_must_not_read_ok() {
    let away = Truth { away: vec![(SECOND, 4 * SECOND)], ..truth(Motion::Constant(0)) };
    let checker = run(away.clone(), &[(2 * SECOND, &ok(0.0, 1))]);
    assert_eq!(checker.slots()[0].wrong, 1, "an old angle sold as fresh");
    // The same reading with its true age is right, but after a second it must have been given up.
    let checker = run(away.clone(), &[(2 * SECOND, &ok(0.0, 1_000))]);
    assert_eq!(checker.slots()[0].wrong, 0);
    assert_eq!(checker.faults(3 * SECOND).len(), 1);
    let checker = run(away.clone(), &[(2 * SECOND, NO_ANSWER)]);
    assert!(checker.faults(3 * SECOND).is_empty());
    // Back since half a second: nothing is demanded yet.
    assert!(checker.faults(4 * SECOND + SECOND / 2).is_empty());
    assert_eq!(checker.faults(5 * SECOND).len(), 1);
}

#[test]
fn a_sensor_that_is_not_in_the_scenario_must_not_read_ok() {
    let stranger = ok(0.0, 1).replace(r#""address":1"#, r#""address":9"#);
    let checker = run(truth(Motion::Constant(0)), &[(SECOND, &stranger), (SECOND, &ok(0.0, 1))]);
    assert_eq!(checker.faults(SECOND).len(), 1);
}

#[test]
fn a_sensor_has_one_slot() {
    let other = ok(0.0, 1).replace(r#""slot":0"#, r#""slot":255"#);
    let checker = run(truth(Motion::Constant(0)), &[(SECOND, &other), (SECOND, &ok(0.0, 1))]);
    assert_eq!(checker.faults(SECOND), ["t7 1: printed as slots {0, 255}"]);
}

#[test]
fn the_first_right_t7_reading_is_timed_at_its_end() {
    let checker =
        run(truth(Motion::Constant(0)), &[(MS, NO_ANSWER), (50 * MS, &ok(1.0, 0)), (60 * MS, &ok(0.0, 0))]);
    assert_eq!(checker.first_t7(), Some(69 * MS));
}

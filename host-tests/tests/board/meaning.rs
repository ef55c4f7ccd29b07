//! Zero, direction and null position changed on the running image: no *ok* angle between the old meaning and the new.
//! Settings, motions and faults by chance are in `crates/testkit/tests/meaning.rs`.

use clino_host_tests::{Ran, Spoken, run};

const MS: u64 = 1_000_000;

/// An ISU at 100°, its PWM output, and T7s at rest, and these lines typed.
fn typed(duration: &str, lines: &[(u64, &str)]) -> Ran {
    let mut scenario = format!(
        r#"
        seed = 1
        duration = "{duration}"
        t7 = [
            {{ address = 1, motion.constant = 170.0 }},
            {{ address = 2, motion.constant = 179.5 }},
            {{ address = 3, motion.constant = 0.5 }},
        ]
        isu = [{{ address = 1, motion.constant = 100.0 }}]
        "#
    );
    for (at, line) in lines {
        scenario += &format!("[[typed]]\nat = \"{at}ms\"\nline = {line:?}\n");
    }
    run(&scenario)
}

/// What a slot said: every ok angle is one of these two, the first before the second, and it has said something else than
/// *ok* between them.
fn changed(ran: &Ran, slot: u32, from: f64, to: f64) {
    let near = |angle: f64, other: f64| (angle - other).abs() <= 0.01 || (angle - other).abs() >= 359.99;
    let spoken: Vec<&Spoken> = ran.slot(slot).collect();
    let is = |spoken: &&Spoken, angle| spoken.reading.angle_deg.is_some_and(|said| near(said, angle));
    for spoken in spoken.iter().filter(|spoken| spoken.is_ok()) {
        assert!(is(spoken, from) || is(spoken, to), "{spoken:?}");
    }
    let last_before = spoken.iter().rposition(|spoken| is(spoken, from)).expect("it was read before");
    let first_after = spoken.iter().position(|spoken| is(spoken, to)).expect("it is read afterwards");
    assert!(last_before < first_after, "slot {slot}: {from} again after {to}");
    let between = &spoken[last_before + 1..first_after];
    assert!(between.iter().any(|spoken| spoken.reading.status == "never_read"), "{between:?}");
}

/// The issue's example: it published 74.998, 59.999, … 12.500 as *ok* for 4.2 s.
#[test]
fn an_isu_zeroed_under_a_mean_of_eight_says_nothing_in_between() {
    let ran = typed("12s", &[(100, "set 3 filter mean 8"), (4_000, "isu zero 1 --yes"), (11_000, "read 3")]);
    let done = ran
        .lines
        .iter()
        .find(|line| line.text.contains(r#""what":"nulled""#))
        .or_else(|| ran.lines.iter().find(|line| line.text.contains(r#""writes":1"#)));
    assert!(done.is_some(), "{}", ran.summary);
    changed(&ran, 3, 99.998, 0.0);
    let last = ran.lines.iter().rfind(|line| line.text.contains(r#""turns""#)).expect("read 3 is answered");
    assert!(last.text.contains(r#""turns":0,"#), "{}", last.text);
}

#[test]
fn a_reversed_t7_does_not_pass_through_half_a_turn() {
    let ran = typed(
        "4s",
        &[(100, "set 0 filter mean 8"), (1_500, "t7 direction 1 reversed --yes"), (3_500, "read 0")],
    );
    changed(&ran, 0, 170.0, -170.0);
    let last = ran.lines.iter().rfind(|line| line.text.contains(r#""turns""#)).expect("read 0 is answered");
    assert!(last.text.contains(r#""turns":0,"#), "{}", last.text);
}

#[test]
fn a_t7_zeroed_at_rest_has_not_turned() {
    let ran = typed("6s", &[(1_500, "t7 zero 2 --yes"), (5_500, "read 1")]);
    changed(&ran, 1, 179.5, 0.0);
    let last = ran.lines.iter().rfind(|line| line.text.contains(r#""turns""#)).expect("read 1 is answered");
    assert!(last.text.contains(r#""turns":0,"#), "{}", last.text);
    // The others on the bus have gone on.
    for slot in [0, 2] {
        let spoken = ran.slot(slot).filter(|spoken| spoken.began > 200 * MS);
        assert!(spoken.into_iter().all(|spoken| spoken.is_ok()), "slot {slot}");
    }
}

/// Zero is no limit: at 300°/s, where a limit of 180°/s has every value suspect.
#[test]
fn a_slot_without_a_limit_reads_a_sensor_that_turns_fast() {
    let ran = run(r#"
        seed = 1
        duration = "3s"
        t7 = [{ address = 1, motion.ramp = { start = 0.0, rate = 300.0 } }]
        typed = [
            { at = "20ms", line = "slot 1 off" },
            { at = "30ms", line = "slot 2 off" },
            { at = "500ms", line = "set 0 rate 0" },
            { at = "2s", line = "set 0 rate 400" },
        ]
    "#);
    let counts = |from: u64, until: u64| {
        let spoken = ran.slot(0).filter(move |spoken| (from * MS..until * MS).contains(&spoken.began));
        spoken.fold(
            (0, 0),
            |(ok, other), spoken| if spoken.is_ok() { (ok + 1, other) } else { (ok, other + 1) },
        )
    };
    let (without, with) = (counts(700, 2_000), counts(2_200, 3_000));
    assert!(without.0 >= 10 && without.1 == 0, "without a limit: {without:?} ok and not");
    assert!(with.0 >= 6 && with.1 == 0, "with a wide one: {with:?}");
}

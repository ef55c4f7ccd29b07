//! PWM inputs against their true edges.

use clino_board::pwm::Pulse;
use clino_host_tests::{Ran, Spoken, run};

const MS: u64 = 1_000_000;
/// A line of 100 characters at 115200 bit/s.
const LINE: u64 = 9 * MS;

/// The document's law, in floating point (AN #201 section 5).
fn angle(pulse: &Pulse) -> f64 {
    let high = (pulse.falling - pulse.rising) as f64;
    let period = (pulse.next_rising - pulse.rising) as f64;
    6.749 * 100.0 * high / period - 157.45
}

fn circular_distance(a: f64, b: f64) -> f64 {
    let distance = (a - b).rem_euclid(360.0);
    distance.min(360.0 - distance)
}

fn ok(ran: &Ran, slot: u32) -> Vec<&Spoken> {
    ran.slot(slot).filter(|spoken| spoken.is_ok()).collect()
}

#[test]
fn the_whole_turn_is_right_to_a_hundredth_of_a_degree() {
    // 30 degrees a second is one degree a period; the second input goes the other way.
    let ran = run(r#"
        duration = "13s"
        pwm = [
            { channel = 1, resolution = "ideal", motion.ramp = { start = 0.0, rate = 30.0 } },
            { channel = 2, resolution = "ideal", motion.ramp = { start = 359.5, rate = -30.0 } },
        ]
        "#);
    for (input, slot) in [(0, 4), (1, 5)] {
        let mut seen = [false; 36];
        let mut worst: f64 = 0.0;
        for spoken in ok(&ran, slot) {
            let said = spoken.reading.angle_deg.expect("ok has an angle");
            // The cycle it tells of ended within the two periods before the line began.
            let recent = ran.pulses[input].iter().filter(|pulse| {
                (spoken.began.saturating_sub(67 * MS)..=spoken.began).contains(&pulse.next_rising)
            });
            let error = recent.map(|pulse| circular_distance(angle(pulse), said)).fold(f64::MAX, f64::min);
            assert!(error <= 0.01, "input {input}: {said} is {error} off at {} ms", spoken.began / MS);
            worst = worst.max(error);
            seen[(said / 10.0) as usize % 36] = true;
        }
        assert!(seen.iter().all(|&seen| seen), "input {input}: some of the turn was not seen: {seen:?}");
        println!("input {input}: {} readings, at most {worst:.5} degrees off", ok(&ran, slot).len());
    }
}

#[test]
fn a_change_is_reported_within_two_periods_under_full_load() {
    // Both inputs jump by 30 degrees every 130 ms, while the T7s and the ISU keep the console busy.
    let jumps = |phase: u32| -> String {
        let jump = |n: u32| {
            let (at, angle) = (500 + phase + 130 * n, (n * 30) % 360);
            format!(
                "{{ at = \"{at}ms\", angle = {angle}.0 }}, {{ at = \"{at}ms\", angle = {}.0 }}",
                (angle + 30) % 360
            )
        };
        (0..30).map(jump).collect::<Vec<_>>().join(", ")
    };
    let ran = run(&format!(
        r#"
        duration = "5s"
        t7 = [
            {{ address = 1, motion.ramp.rate = 20.0 }},
            {{ address = 2, motion.ramp.rate = 20.0 }},
            {{ address = 3, motion.ramp.rate = 20.0 }},
        ]
        isu = [{{ address = 1, motion.constant = 1.0 }}]
        pwm = [
            {{ channel = 1, motion.table = [{}] }},
            {{ channel = 2, motion.table = [{}] }},
        ]
        "#,
        jumps(0),
        jumps(57)
    ));
    let mut worst = 0;
    for (input, slot) in [(0, 4), (1, 5)] {
        let jumped = ran.pulses[input]
            .windows(2)
            .filter(|pair| circular_distance(angle(&pair[0]), angle(&pair[1])) > 20.0);
        let mut jumps = 0;
        for pair in jumped {
            let (from, angle) = (pair[1].rising, angle(&pair[1]));
            let right = |spoken: &&Spoken| {
                spoken.at > from
                    && spoken.reading.angle_deg.is_some_and(|said| circular_distance(said, angle) < 0.2)
            };
            let said = ran.slot(slot).find(right).expect("the new angle is said");
            worst = worst.max(said.at - from);
            jumps += 1;
        }
        assert!(jumps >= 20, "input {input}: {jumps} jumps");
    }
    assert!(worst <= 2 * 33_333_333, "{worst} ns from the first new edge to the end of the line");
    println!("at most {worst} ns from the first new edge to the end of the line");
}

#[test]
fn an_input_that_stands_still_is_stuck_at_its_level() {
    let ran = run(r#"
        duration = "2s"
        pwm = [
            { channel = 1, motion.constant = 90.0, stuck = [{ from = "500ms", until = "1s", level = "low" }] },
            { channel = 2, motion.constant = 90.0, stuck = [{ from = "500ms", until = "1s", level = "high" }] },
        ]
        "#);
    for (slot, stuck) in [(4, "stuck_low"), (5, "stuck_high")] {
        let during = |spoken: &&Spoken| (650 * MS..1_000 * MS).contains(&spoken.began);
        let said: Vec<&Spoken> = ran.slot(slot).filter(during).collect();
        assert!(said.len() >= 3, "slot {slot}: {said:?}");
        assert!(said.iter().all(|spoken| spoken.reading.status == stuck), "slot {slot}: {said:?}");
        // Two and a half periods without an edge, after the pulse in which it stopped.
        let first = ran.slot(slot).find(|spoken| spoken.reading.status == stuck).expect("seen above");
        assert!(first.at <= 500 * MS + 34 * MS + 84 * MS + 2 * LINE, "slot {slot}: {} ms", first.at / MS);
        assert!(ok(&ran, slot).iter().any(|spoken| spoken.began > 1_100 * MS), "slot {slot} comes back");
    }
}

#[test]
fn an_input_that_never_had_a_signal_is_stuck_low() {
    let ran = run("duration = \"1s\"");
    for slot in [4, 5] {
        assert!(ran.slot(slot).count() >= 5);
        assert!(ran.slot(slot).all(|spoken| spoken.reading.status == "stuck_low"));
    }
}

#[test]
fn a_sensor_whose_clock_is_two_percent_off_is_read_just_as_well() {
    let ran = run(r#"
        duration = "2s"
        pwm = [
            { channel = 1, resolution = "ideal", frequency = 29.4, motion.constant = 123.4 },
            { channel = 2, resolution = "ideal", frequency = 30.6, motion.constant = 321.0 },
        ]
        "#);
    for (slot, truth) in [(4, 123.4), (5, 321.0)] {
        let said = ok(&ran, slot);
        assert!(said.len() >= 50, "slot {slot}: {}", said.len());
        assert_eq!(said.len(), ran.slot(slot).count(), "slot {slot} is always ok");
        for spoken in said {
            let angle = spoken.reading.angle_deg.expect("ok has an angle");
            assert!((angle - truth).abs() <= 0.01, "slot {slot}: {angle}");
        }
    }
}

#[test]
fn a_signal_that_is_no_isu_is_not_taken_for_one() {
    let ran = run(r#"
        duration = "1s"
        pwm = [
            { channel = 1, frequency = 50.0, motion.constant = 90.0 },
            { channel = 2, frequency = 25.0, motion.constant = 90.0 },
        ]
        "#);
    for slot in [4, 5] {
        assert!(ran.slot(slot).count() >= 5);
        assert!(ran.slot(slot).all(|spoken| spoken.reading.status == "bad_period"), "slot {slot}");
    }
}

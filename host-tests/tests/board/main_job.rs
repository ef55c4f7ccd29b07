//! Three T7s, one ISU, two PWM inputs: all read, all right, from the first 100 ms on.

use clino_host_tests::{Spoken, run, run_file};

const MS: u64 = 1_000_000;

/// Everything at rest, so that the truth needs no time: T7s at address 1 to 3, the ISU at 1, both PWM inputs.
const AT_REST: &str = r#"
seed = 7
duration = "2s"
t7 = [
    { address = 1, motion.constant = 12.345 },
    { address = 2, motion.constant = -179.999 },
    { address = 3, motion.constant = 0.001 },
]
isu = [{ address = 1, motion.constant = 271.25 }]
pwm = [
    { channel = 1, motion.constant = 89.56, resolution = "ideal" },
    { channel = 2, motion.constant = 333.3, resolution = "ideal" },
]
"#;

/// Slot, true angle in degrees, tolerance: a T7 speaks in 0.001°, an ISU in 360/65536°, a PWM input to 0.01°.
const TRUTHS: [(u32, f64, f64); 6] = [
    (0, 12.345, 1e-9),
    (1, -179.999, 1e-9),
    (2, 0.001, 1e-9),
    (3, 271.25, 360.0 / 65_536.0),
    (4, 89.56, 0.01),
    (5, 333.3, 0.01),
];

#[test]
fn every_slot_tells_the_truth() {
    let ran = run(AT_REST);
    assert!(ran.all_well, "{}", ran.summary);
    for (slot, truth, tolerance) in TRUTHS {
        let angles: Vec<f64> = ran.slot(slot).filter_map(|spoken| spoken.reading.angle_deg).collect();
        // The ISU is the slowest: 7 readings in 2 s.
        assert!(angles.len() >= 6, "slot {slot}: {} readings", angles.len());
        for angle in angles {
            assert!((angle - truth).abs() <= tolerance, "slot {slot}: {angle} instead of {truth}");
        }
    }
}

#[test]
fn nothing_but_ok_is_said_when_nothing_is_wrong() {
    let ran = run(AT_REST);
    // A PWM input has no cycle to show in its first period.
    let not_ok: Vec<&Spoken> = ran.spoken.iter().filter(|spoken| !spoken.is_ok()).collect();
    assert!(not_ok.is_empty(), "{not_ok:?}");
    let ages = ran.spoken.iter().filter_map(|spoken| spoken.reading.age_ms);
    // Half the ISU's refresh is the longest time between two readings.
    assert!(ages.max() <= Some(266), "{:?}", ran.spoken.iter().max_by_key(|spoken| spoken.reading.age_ms));
}

#[test]
fn the_first_t7_angle_is_on_the_console_within_100_ms_of_reset() {
    let ran = run(AT_REST);
    let first = ran.slot(0).find(|spoken| spoken.is_ok()).expect("slot 0 was read");
    assert!(first.at <= 100 * MS, "{} ms", first.at / MS);
}

#[test]
fn the_log_begins_with_version_and_clock() {
    let ran = run(AT_REST);
    let version = env!("CARGO_PKG_VERSION");
    let first = format!("clino {version}, start 1 after power_on, 0 crashes, mode normal, clock crystal");
    assert_eq!(ran.log, [first.as_str(), "configuration as delivered"]);
}

#[test]
fn the_scenarios_that_come_with_the_project_are_well() {
    for name in ["default.toml", "unplug.toml", "noise.toml"] {
        let ran = run_file(name);
        assert!(ran.all_well, "{name}\n{}", ran.summary);
    }
}

#[test]
fn the_same_scenario_gives_the_same_run_byte_for_byte() {
    let scenario = AT_REST.replace("duration", "segments.t7.noise.bit_error_rate = 1e-4\nduration");
    let (first, second) = (run(&scenario), run(&scenario));
    assert_eq!(first.lines, second.lines);
    assert!(first.bus_log == second.bus_log);
    let other = run(&scenario.replace("seed = 7", "seed = 8"));
    assert!(other.bus_log != first.bus_log, "another seed must make another run");
}

#[test]
fn the_gateway_counts_what_the_wire_shows() {
    let ran = run(&AT_REST.replace("2s", "3.5s"));
    let third_line = |topic: &str| {
        let start = format!(r#"{{"{topic}":"t7""#);
        let lines: Vec<_> = ran.lines.iter().filter(|line| line.text.starts_with(&start)).collect();
        assert_eq!(lines.len(), 3, "one line a second: {lines:?}");
        lines[2]
    };
    let third = |topic: &str| -> &str { &third_line(topic).text };
    let number = |topic: &str, name: &str| -> u64 {
        let (_, rest) = third(topic).split_once(&format!(r#""{name}":"#)).expect("the counter is there");
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        digits.parse().expect("a number")
    };
    // The line is made while the one before it goes out, 10 ms before it begins at most: two requests.
    let (requests, good) = (number("stats", "requests"), number("stats", "good"));
    let began = third_line("stats").began;
    let on_the_wire = ran.t7.polls.iter().filter(|poll| poll.de_high < began).count() as u64;
    assert!(
        on_the_wire > 440 && (on_the_wire - 2..=on_the_wire).contains(&requests),
        "{requests} {on_the_wire}"
    );
    assert!(requests - good <= 1, "{}", third("stats"));
    for counter in ["no_answer", "bad_answer", "late"] {
        assert_eq!(number("stats", counter), 0, "{}", third("stats"));
    }
    for counter in ["forced", "busy", "junk", "framing", "noise", "overrun"] {
        assert_eq!(number("line", counter), 0, "{}", third("line"));
    }
    // 2 ms of latency and a character of 86.8 µs less half a stop bit.
    assert!((2_075..=2_095).contains(&number("times", "response_us")), "{}", third("times"));
    // The gateway's own figure starts at the first character and may be one bit (8.7 µs) too large; here the
    // start bit follows at once, so that it agrees with the wire to a microsecond.
    let wire = ran.t7.tail.expect("frames were sent").max.cast_unsigned();
    let own = number("times", "de_release_max_ns");
    assert!(own.abs_diff(wire) <= 1_000, "wire {wire} ns, gateway {own} ns");
}

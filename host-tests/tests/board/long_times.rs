//! The image's clock set forward: past 35.8 and 71.6 min, at which counts of 32 bits turn, past 49.7 days, and a year.
//!
//! No test waits that long for a virtual board: a bit of the clock's count of rounds (65.536 ms each, `src/clock.rs`) is
//! turned while the image runs. What that cannot show, ages of every limit in between, is in the core's own tests
//! (`crates/gateway`, `stamp/tests.rs`, `gate/tests.rs`, `maths/tests.rs`, `phase/tests.rs`).

use clino_host_tests::{Ran, image, run};

/// Microseconds in a round of the clock.
const ROUND: u64 = 1 << 16;

/// Bits of the count of rounds, and what they are worth: 35.8 min, 71.6 min, 50.9 d, 407 d.
const JUMPS: [u32; 4] = [15, 16, 26, 29];

/// Where the count of rounds is.
fn rounds() -> u32 {
    let image = image();
    let found: Vec<u32> =
        image.symbols().filter(|(name, _)| name.contains("5clock6ROUNDS")).map(|(_, at)| at).collect();
    let [address] = found[..] else { panic!("one count of rounds: {found:x?}") };
    address
}

/// A T7 that turns slowly and an ISU at rest, asked as seldom as can be set, and a jump of the clock every two seconds.
fn jumps() -> Ran {
    let mut scenario = String::from(
        r#"
        seed = 1
        duration = "10s"
        t7 = [{ address = 1, motion.ramp = { start = 0.0, rate = 0.05 } }]
        isu = [{ address = 1, motion.constant = 90.0 }]
        typed = [
            { at = "20ms", line = "slot 1 off" },
            { at = "30ms", line = "slot 2 off" },
            { at = "40ms", line = "slot 0 t7 1 -p 1200000 -s 3600000" },
            { at = "50ms", line = "slot 3 isu 1 -p 1200000 -s 3600000" },
            { at = "1900ms", line = "read 0" },
            { at = "3900ms", line = "read 0" },
            { at = "3920ms", line = "read 3" },
            { at = "5900ms", line = "read 0" },
            { at = "5920ms", line = "read 3" },
            { at = "7900ms", line = "read 0" },
            { at = "7920ms", line = "read 3" },
            { at = "9900ms", line = "read 0" },
            { at = "9920ms", line = "read 3" },
            { at = "9940ms", line = "version" },
        ]
        "#,
    );
    let address = rounds();
    for (n, bit) in (1..).zip(JUMPS) {
        let (address, bit) = (address + bit / 8, bit % 8);
        scenario += &format!(
            "[[plant]]\nat = \"{}ms\"\nwhat.flip = {{ address = {address}, bit = {bit} }}\nlevel = \"main\"\n",
            2_000 * n
        );
    }
    run(&scenario)
}

/// The number behind a name in a line.
fn number(line: &str, name: &str) -> f64 {
    let (_, rest) = line.split_once(&format!("\"{name}\":")).unwrap_or_else(|| panic!("{name} in {line}"));
    let end = rest.find([',', '}']).expect("an end");
    rest[..end].parse().unwrap_or_else(|_| panic!("{name} in {line}"))
}

#[test]
fn values_of_long_ago_are_not_taken_for_new_ones() {
    let ran = jumps();
    let answers = |slot: u32| {
        let begin = format!(r#"{{"slot":{slot},"#);
        let mut lines = ran.lines.iter().map(|line| line.text.as_str());
        let read: Vec<&str> =
            lines.by_ref().filter(|text| text.starts_with(&begin) && text.contains(r#""turns""#)).collect();
        read
    };
    let (t7, isu) = (answers(0), answers(3));
    assert_eq!((t7.len(), isu.len()), (5, 4), "{}", ran.summary);
    for line in t7.iter().chain(&isu) {
        assert!(line.contains(r#""status":"ok""#), "neither suspect nor stale: {line}");
        // 0.1° in half an hour is no rate. The old stamps made 100 000°/s of it.
        assert!(number(line, "rate_deg_s").abs() <= 0.1, "{line}");
        assert!(number(line, "age_ms") < 2_500.0, "asked again after each jump: {line}");
    }
    for line in &isu {
        assert!(line.contains(r#""fresh":true"#), "its angle is new after half an hour: {line}");
    }
    let version = ran
        .lines
        .iter()
        .find(|line| line.text.starts_with("{\"what\":\"clino\""))
        .expect("version is answered");
    let jumped: u64 = JUMPS.iter().map(|bit| (1 << bit) * ROUND / 1_000).sum();
    let uptime = number(&version.text, "uptime_ms") as u64;
    assert!((jumped + 9_000..jumped + 11_000).contains(&uptime), "{uptime}");
    assert!(ran.incidents.len() <= JUMPS.len(), "no reset: {:?}", ran.incidents);
}

//! The virtual board's fast path changes nothing but the time that a run takes: a run with it and a run in which every
//! instruction is left to the emulator are the same, to the last edge and instruction.

use std::path::Path;

use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::image;

/// Both buses, both PWM inputs, the console, the Modbus port and a save to flash.
const BUSY: &str = r#"
seed = 5
duration = "1s"
segments.t7.noise = { bit_error_rate = 1e-5, drop_rate = 1e-4 }
t7 = [
    { address = 1, motion.sine = { amplitude = 30.0, period = "4s" } },
    { address = 2, motion.constant = 1.0, fault = { every = 3, what = "bad_checksum" } },
]
isu = [{ address = 1, motion.constant = 271.25 }]
pwm = [{ channel = 1, motion.constant = 89.56 }, { channel = 2, motion.constant = 333.3 }]
typed = [{ at = "150ms", line = "load" }, { at = "600ms", line = "save" }]
[[modbus.request]]
at = "400ms"
bytes = "01 04 00 00 00 02 71 cb"
"#;

/// All that can be seen of a run.
fn seen(with_fast_path: bool) -> (Vec<String>, String, String, String) {
    let scenario = Scenario::parse(Path::new("fast path"), BUSY).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"));
    if !with_fast_path {
        run.board().without_fast_path();
    }
    let mut lines = Vec::new();
    run.finish(|line| lines.push(format!("{line:?}")));
    let mut bus_log = Vec::new();
    run.write_bus_log(&mut bus_log).expect("memory does not fail");
    let bus_log = String::from_utf8(bus_log).expect("text");
    let stats = format!("{:?}", run.board().stats());
    (lines, bus_log, stats, run.summary().0)
}

#[test]
fn it_changes_nothing() {
    let (fast, slow) = (seen(true), seen(false));
    assert_eq!(fast.2, slow.2);
    assert_eq!(fast.0, slow.0);
    assert!(fast.1 == slow.1, "the bus logs differ");
    assert_eq!(fast.3, slow.3);
    let (lines, events) = (fast.0.len(), fast.1.lines().count());
    assert!(lines > 20 && events > 500, "{lines} lines, {events} events");
}

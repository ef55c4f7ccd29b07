//! Three fast crashes in a row: the console and the Modbus port are served, the buses are left alone.

use clino_host_tests::{Ran, modbus, run};

use crate::{MS, SECOND, resets, said, typed};

/// Three crashes of the bus level, each soon after the start before.
const CRASHES: &str =
    "[[plant]]\nat = \"300ms\"\nwhat = \"data_fault\"\nlevel = \"bus\"\ntimes = 3\nagain = \"300ms\"\n";
const SENSORS: &str =
    "t7 = [{ address = 1, motion.constant = 1.0 }]\nisu = [{ address = 1, motion.constant = 2.0 }]\n";

fn scenario(duration_ms: u64, more: &str) -> Ran {
    run(&format!("duration = \"{duration_ms}ms\"\n{SENSORS}{CRASHES}{more}"))
}

#[test]
fn after_three_fast_crashes_only_the_console_and_modbus_are_served_until_a_restart() {
    let lines = [(2_500, "reset-cause"), (2_600, "t7 scan"), (2_900, "reboot --yes"), (4_000, "reset-cause")];
    let lines: String = lines.into_iter().map(|(at, line)| typed(at, line)).collect();
    let requests = [
        ([4, 0x09, 0x80, 0, 8], 2_700),
        ([4, 0x00, 0x20, 0, 2], 2_750),
        ([4, 0x01, 0x00, 0, 1], 2_800),
        ([4, 0x02, 0x20, 0, 1], 2_850),
    ];
    let more: String = requests.iter().map(|(request, at)| modbus::request(request, *at)).collect();
    let ran = scenario(4_500, &(lines + &more));

    let resets = resets(&ran);
    assert_eq!(resets.len(), 4, "three crashes and the restart: {resets:?}");
    let starts = said(&ran, "start");
    assert!(starts[0].contains(r#""cause":"bus_fault","boots":4,"crashes":3,"mode":"safe""#), "{starts:?}");
    assert!(starts[1].contains(r#""cause":"software","boots":5,"crashes":3,"mode":"normal""#), "{starts:?}");

    // No request in safe mode, and a task is refused.
    let quiet = resets[2].0 + 10 * MS..resets[3].0;
    let polls = ran.t7.polls.iter().chain(&ran.isu.polls);
    assert_eq!(polls.filter(|poll| quiet.contains(&poll.de_high)).count(), 0);
    let refused = ran.lines.iter().find(|line| quiet.contains(&line.began) && line.text.contains("error"));
    assert!(refused.is_some(), "the scan is refused");
    // No angle is available there, at either port.
    assert_eq!(ran.spoken.iter().filter(|spoken| quiet.contains(&spoken.began) && spoken.is_ok()).count(), 0);
    let exchanges = modbus::exchanges(&ran.bus_log);
    let registers: Vec<_> =
        exchanges.iter().map(|exchange| exchange.registers().expect("an answer")).collect();
    assert_eq!(
        registers[0],
        [12, 1, 0, 12, 0, 4, 0, 3],
        "bus fault, safe, crystal; four starts, three crashes"
    );
    assert_eq!(registers[1], [0x8000, 0], "no angle");
    assert_eq!(
        (&registers[2][..], &registers[3][..]),
        (&[0][..], &[13][..]),
        "set and never read; not in use"
    );

    assert!(ran.slot(0).last().is_some_and(|spoken| spoken.is_ok() && spoken.at > 4_000 * MS));
}

#[test]
fn safe_mode_ends_by_itself_after_ten_minutes() {
    // No request meanwhile.
    let ran = scenario(604_000, &typed(603_500, "reset-cause"));
    let resets = resets(&ran);
    assert_eq!(resets.len(), 4, "{resets:?}");
    let lasted = resets[3].0 - resets[2].0;
    println!("safe mode lasts {:.1} s", lasted as f64 / 1e9);
    assert!((600 * SECOND..600 * SECOND + 200 * MS).contains(&lasted), "{lasted}");
    assert!(said(&ran, "start")[0].contains(r#""mode":"normal""#));
    assert!(ran.slot(0).last().is_some_and(|spoken| spoken.is_ok() && spoken.at > 603 * SECOND));
}

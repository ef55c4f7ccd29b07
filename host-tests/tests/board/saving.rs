//! What is saved is there after a reset, and storing it costs what it is said to cost.

use std::fmt::Write as _;

use clino_host_tests::{Ran, modbus, run};

const MS: u64 = 1_000_000;

/// A sector erases in at most 0.5 s (DS8626 table 40); a record of a few hundred bytes is written in a few milliseconds.
const LONGEST_GAP: u64 = 530 * MS;

fn scenario(duration_ms: u64, lines: &[(u64, &str)], more: &str) -> Ran {
    let mut text = format!(
        "duration = \"{duration_ms}ms\"\n\
         t7 = [{{ address = 7, motion.constant = 70.5 }}, {{ address = 2, motion.constant = 20.0 }}]\n"
    );
    for (at, line) in lines {
        write!(text, "[[typed]]\nat = \"{at}ms\"\nline = \"{line}\"\n").expect("text");
    }
    run(&(text + more))
}

fn said(ran: &Ran) -> Vec<&str> {
    let answers = ran.lines.iter().map(|line| line.text.as_str());
    let noise =
        ["\"slot\"", "\"stats\"", "\"line\"", "\"times\"", "\"bus_fault\"", "\"summary\"", "\"stream\""];
    answers.filter(|line| !noise.iter().any(|noise| line.contains(noise))).collect()
}

/// The longest time without a request on the T7 bus between two instants, ns.
fn longest_gap(ran: &Ran, from: u64, until: u64) -> u64 {
    let times = ran.t7.polls.iter().map(|poll| poll.de_high).filter(|at| (from..until).contains(at));
    let times: Vec<u64> = times.collect();
    times.windows(2).map(|pair| pair[1] - pair[0]).max().expect("polls")
}

#[test]
fn what_is_saved_survives_a_reset_and_is_not_written_twice() {
    let lines = [
        (300, "slot 0 t7 7 -p 50"),
        (400, "save"),
        (1_500, "save"),
        (2_000, "reboot --yes"),
        (3_000, "reset-cause"),
    ];
    let ran = scenario(3_500, &lines, "");
    assert_eq!(
        said(&ran),
        [
            r#"{"done":true}"#,
            r#"{"what":"saved","stored":"written"}"#,
            r#"{"what":"saved","stored":"unchanged"}"#,
            r#"{"done":true}"#,
            r#"{"what":"start","cause":"software","boots":2,"crashes":0,"mode":"normal","clock":"crystal"}"#,
        ]
    );
    let last = ran.slot(0).last().expect("a reading");
    assert!(last.at > 3_000 * MS && last.is_ok());
    assert_eq!((last.reading.address, last.reading.angle_deg), (7, Some(70.5)));
    let gap = longest_gap(&ran, 350 * MS, 1_400 * MS);
    println!("polls stop for {:.1} ms while a sector is erased", gap as f64 / MS as f64);
    assert!(gap <= LONGEST_GAP, "{gap}");
    // What is stored already costs one look at the flash.
    assert!(longest_gap(&ran, 1_450 * MS, 1_950 * MS) < 40 * MS);
}

#[test]
fn time_goes_on_while_a_sector_is_erased() {
    // An angle that turns by 20 degrees in the erase: told with an age that leaves the erase out, it is wrong.
    let ran = run("duration = \"3s\"\nt7 = [{ address = 1, motion.ramp.rate = 40.0 }]\n\
         isu = [{ address = 1, motion.ramp.rate = 40.0 }]\n\
         typed = [{ at = \"400ms\", line = \"save\" }, { at = \"2500ms\", line = \"version\" }]");
    assert!(ran.lines.iter().any(|line| line.text.contains(r#""stored":"written""#)));
    assert!(ran.all_well, "{}", ran.summary);
    let version =
        ran.lines.iter().find(|line| line.text.starts_with("{\"what\":\"clino\"")).expect("an answer");
    let uptime: u64 = version
        .text
        .split("uptime_ms\":")
        .nth(1)
        .and_then(|rest| rest.split(['}', ',']).next())
        .expect("a field")
        .parse()
        .expect("a number");
    // Typed at 2.5 s; the clock starts some milliseconds after the power.
    assert!((2_470..=2_505).contains(&uptime), "{}", version.text);
}

#[test]
fn what_is_not_saved_is_gone_and_a_factory_reset_forgets() {
    let lines = [
        (300, "slot 0 t7 7 -p 50"),
        (400, "save"),
        (1_300, "slot 1 off"),
        (1_500, "reboot --yes"),
        (2_500, "factory-reset --yes"),
        (3_500, "reboot --yes"),
    ];
    let ran = scenario(4_500, &lines, "");
    let ok = |slot, from: u64, until: u64| {
        let within = ran.slot(slot).filter(|spoken| (from * MS..until * MS).contains(&spoken.began));
        within.filter(|spoken| spoken.is_ok()).count()
    };
    assert!(ok(1, 1_600, 2_400) > 5, "slot 1 was only switched off, not saved");
    assert!(ok(0, 1_600, 2_400) > 5, "slot 0 was saved");
    assert_eq!(ok(0, 3_700, 4_500), 0, "slot 0 reads address 1 again, which is not there");
    assert!(ok(1, 3_700, 4_500) > 5);
}

#[test]
fn a_modbus_master_saves() {
    // Slot 0: kind T7, address 7, axis 2; then the command "save"; then what has become of it.
    let requests = [
        modbus::request(&[16, 0x10, 0x01, 0, 3, 6, 0, 1, 0, 7, 0, 2], 300),
        modbus::request(&[6, 0x1F, 0x00, 0, 1], 400),
        modbus::request(&[3, 0x1F, 0x08, 0, 3], 1_300),
    ];
    let ran = scenario(3_000, &[(1_500, "reboot --yes")], &requests.concat());
    let exchanges = modbus::exchanges(&ran.bus_log);
    assert_eq!(exchanges.len(), 3);
    for exchange in &exchanges[..2] {
        let answer = exchange.answer.as_ref().expect("an answer");
        assert_eq!(answer.bytes[1], exchange.request.bytes[1], "not refused");
    }
    assert_eq!(exchanges[2].registers(), Some(vec![1, 2, 1]), "save, done, the first command");
    let last = ran.slot(0).last().expect("a reading");
    assert!(last.at > 2_500 * MS && last.is_ok());
    assert_eq!(last.reading.angle_deg, Some(70.5));
}

/// The answer is out whole before the gateway starts again; without the key it does not.
#[test]
fn a_modbus_master_starts_it_again() {
    let requests = [
        modbus::request(&[16, 0x1F, 0x00, 0, 5, 10, 0, 6, 0, 0, 0, 0, 0, 0, 0, 0], 400),
        modbus::request(&[16, 0x1F, 0x00, 0, 5, 10, 0, 6, 0, 0, 0, 0, 0, 0, 0x4E, 0x56], 600),
        // Starts since the power came.
        modbus::request(&[4, 0x09, 0x84, 0, 2], 900),
    ];
    let ran = scenario(1_500, &[(1_200, "reset-cause")], &requests.concat());
    let exchanges = modbus::exchanges(&ran.bus_log);
    let answers: Vec<&[u8]> =
        exchanges.iter().map(|exchange| &exchange.answer.as_ref().expect("an answer").bytes[1..]).collect();
    assert_eq!(answers[0][..2], [0x90, 3], "not without the key");
    assert_eq!(answers[1][..5], [16, 0x1F, 0x00, 0, 5]);
    let start = said(&ran).into_iter().find(|line| line.contains(r#""what":"start""#)).expect("an answer");
    assert!(start.contains(r#""cause":"software","boots":2,"crashes":0,"#), "{start}");
    assert!(ran.slot(0).last().is_some_and(|spoken| spoken.at > 1_300 * MS), "the stream goes on");
}

//! Settings through both doors of the shipped image: what is acknowledged is in force and reads back, whatever else is
//! changed with it, and in whichever order.

use clino_host_tests::modbus::{Exchange, exchanges, request};
use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;

fn said<'a>(ran: &'a Ran, begin: &str) -> Vec<&'a str> {
    let texts = ran.lines.iter().map(|line| line.text.as_str());
    texts.filter(|text| text.starts_with(begin)).collect()
}

/// Lines typed, 100 ms apart, from half a second on.
fn typed(lines: &[&str]) -> String {
    let at =
        |(place, line): (usize, &&str)| format!(r#"{{ at = "{}ms", line = "{line}" }},"#, 500 + place * 100);
    format!("typed = [{}]", lines.iter().enumerate().map(at).collect::<String>())
}

/// Requests, 100 ms apart, from half a second on.
fn requests(pdus: &[Vec<u8>]) -> String {
    let at = |(place, pdu): (usize, &Vec<u8>)| request(pdu, 500 + place as u64 * 100);
    format!("[modbus]\n{}", pdus.iter().enumerate().map(at).collect::<String>())
}

/// Function 6.
fn one(address: u16, word: u16) -> Vec<u8> {
    [&[6][..], &address.to_be_bytes(), &word.to_be_bytes()].concat()
}

/// Function 16.
fn many(first: u16, words: &[u16]) -> Vec<u8> {
    let head = [&[16][..], &first.to_be_bytes(), &(words.len() as u16).to_be_bytes()].concat();
    let bytes = words.iter().flat_map(|word| word.to_be_bytes());
    head.into_iter().chain([words.len() as u8 * 2]).chain(bytes).collect()
}

/// Function 3.
fn read(first: u16, quantity: u16) -> Vec<u8> {
    [&[3][..], &first.to_be_bytes(), &quantity.to_be_bytes()].concat()
}

/// Function of an answer, and its second byte: an exception's code.
fn code(exchange: &Exchange) -> (u8, u8) {
    let answer = exchange.answer.as_ref().expect("an answer");
    (answer.bytes[1], answer.bytes[2])
}

fn is_done(exchange: &Exchange) -> bool {
    matches!(code(exchange), (6 | 16, _))
}

/// Row 7 of issue 12: a stale limit that was not set follows its period, by each way to set the period; one that was set
/// and does not fit is refused with both numbers.
#[test]
fn a_stale_limit_goes_with_its_period() {
    for line in ["slot 0 t7 1 -p 1000", "set 0 period 1000"] {
        let ran = run(&format!(
            "seed = 1\nduration = \"12s\"\nt7 = [{{ address = 1, motion.constant = 12.5 }}]\n{}",
            typed(&["slot 1 off", "slot 2 off", line, "show 0", "load"])
        ));
        let shown = said(&ran, r#"{"config":0"#);
        assert!(shown[0].contains(r#""period_ms":1000,"#), "{shown:?}");
        assert!(shown[0].contains(r#""stale_ms":3000,"stale_auto":true,"#), "{shown:?}");
        let later: Vec<_> = ran.slot(0).filter(|spoken| spoken.began > 1_500 * MS).collect();
        assert!(later.len() > 8, "{}", later.len());
        assert!(later.iter().all(|spoken| spoken.is_ok()), "{line}: {later:?}");
        let unwise = said(&ran, r#"{"what":"unwise","why":"slot 0"#);
        assert_eq!(unwise, [""; 0]);
    }
    let ran = run(&format!(
        "seed = 1\nduration = \"2s\"\nt7 = [{{ address = 1, motion.constant = 12.5 }}]\n{}",
        typed(&[
            "set 0 stale 70",
            "set 0 period 1000",
            "show 0",
            "set 0 period 1000 stale 1500",
            "show 0",
            "load",
            "set 0 stale_auto on",
            "show 0",
            "set 4 stale 20",
        ])
    ));
    let refused = said(&ran, r#"{"error":"#);
    let why = r#"{"error":{"kind":"does_not_fit","what":"stale_ms","value":70,"least":1000,"why":"#;
    assert!(refused[0].starts_with(why), "{refused:?}");
    // A PWM cycle comes every 33.333 ms.
    assert!(refused[1].contains(r#""what":"stale_ms","value":20,"least":33.333,"#), "{refused:?}");
    assert_eq!(refused.len(), 2);
    let shown = said(&ran, r#"{"config":0"#);
    for (line, expected) in shown.iter().zip([
        r#""period_ms":20,"timeout_ms":0,"retries":1,"stale_ms":70,"stale_auto":false,"#,
        r#""period_ms":1000,"timeout_ms":0,"retries":1,"stale_ms":1500,"stale_auto":false,"#,
        r#""period_ms":1000,"timeout_ms":0,"retries":1,"stale_ms":3000,"stale_auto":true,"#,
    ]) {
        assert!(line.contains(expected), "{line}");
    }
    let unwise = said(&ran, r#"{"what":"unwise","why":"slot 0"#);
    assert_eq!(unwise.len(), 1, "1.5 s of a period of 1 s: {unwise:?}");
}

/// The table as delivered is not unwise.
#[test]
fn nothing_delivered_is_unwise() {
    let ran = run(&format!("seed = 1\nduration = \"800ms\"\n{}", typed(&["load"])));
    assert_eq!(said(&ran, r#"{"load""#).len(), 2);
    assert_eq!(said(&ran, r#"{"what":"unwise""#), [""; 0]);
}

/// Row 18: enabled, kind and address of an unused slot, and no axis: a single-axis T7 says its angle, as it does for a slot
/// that the console makes.
#[test]
fn a_slot_by_modbus_is_the_slot_of_the_console() {
    let ran = run(&format!(
        "seed = 1\nduration = \"3s\"\nt7 = [{{ address = 9, motion.constant = 33.333 }}]\n{}\n{}",
        r#"typed = [
            { at = "500ms", line = "slot 11 t7 9" }, { at = "600ms", line = "slot 12 isu 3" },
            { at = "700ms", line = "slot 13 pwm 2" }, { at = "2s", line = "show 11" }, { at = "2050ms", line = "show 12" },
            { at = "2100ms", line = "show 13" }, { at = "2150ms", line = "show 21" }, { at = "2200ms", line = "show 22" },
            { at = "2250ms", line = "show 23" },
        ]"#,
        requests(&[
            many(0x1000 + 0x20 * 21, &[1, 1, 9]),
            many(0x1000 + 0x20 * 22, &[1, 2, 3]),
            many(0x1000 + 0x20 * 23, &[1, 3, 2]),
        ])
    ));
    assert!(exchanges(&ran.bus_log).iter().all(is_done));
    for (console, modbus) in [(11, 21), (12, 22), (13, 23)] {
        let settings = |slot: u32| {
            let lines = said(&ran, &format!(r#"{{"config":{slot},"#));
            lines[0].split_once(',').expect("settings").1.to_owned()
        };
        assert_eq!(settings(console), settings(modbus), "slot {modbus}");
    }
    for slot in [11, 21] {
        let angles: Vec<_> = ran.slot(slot).filter(|spoken| spoken.is_ok()).collect();
        assert!(angles.len() > 5, "slot {slot}");
        assert!(angles.iter().all(|spoken| spoken.reading.angle_deg == Some(33.333)), "{:?}", angles[0]);
    }
}

/// Row 19: values that equal the old ones, in the same request as another kind, are what is read afterwards.
#[test]
fn what_is_named_is_kept_even_if_it_was_so() {
    // Enabled, kind, address, axis, period 0, stale 1000, timeout 0, retries 0, zero 0, …, confirm 0.
    let block = [1, 1, 9, 2, 0, 0, 0, 1_000, 0, 0, 0, 0, 0, 0, 0, 1, 0];
    let first = 0x1000 + 0x20 * 30;
    let ran = run(&format!(
        "seed = 1\nduration = \"2s\"\nt7 = [{{ address = 9, motion.constant = 33.333 }}]\n{}",
        requests(&[
            read(first, 17),
            many(first, &block),
            read(first, 17),
            many(first, &block),
            read(first, 17)
        ])
    ));
    let exchanges = exchanges(&ran.bus_log);
    let unused = exchanges[0].registers().expect("the block");
    assert_eq!(unused[4..17], block[4..17], "as in an unused slot");
    assert!(is_done(&exchanges[1]) && is_done(&exchanges[3]));
    assert_eq!(exchanges[2].registers().expect("the block"), block);
    assert_eq!(exchanges[4].registers().expect("the block"), block);
    assert!(ran.slot(30).any(|spoken| spoken.reading.angle_deg == Some(33.333)));
}

/// Row 20: one register at a time, in either order, for each kind; nothing is asked of a bus before its address is known.
#[test]
fn one_register_at_a_time() {
    for (slot, kind, address) in [(30_u16, 1, 9), (31, 2, 3), (32, 3, 2)] {
        let first = 0x1000 + 0x20 * slot;
        for order in [[1, 2], [2, 1]] {
            let word = |offset| if offset == 1 { kind } else { address };
            let value = |offset| one(first + offset, word(offset));
            let ran = run(&format!(
                "seed = 1\nduration = \"2500ms\"\nt7 = [{{ address = 9, motion.constant = 33.333 }}]\n\
                 isu = [{{ address = 3, motion.constant = 90.0 }}]\n\
                 pwm = [{{ channel = 2, motion.constant = 45.0 }}]\n{}",
                requests(&[
                    value(order[0]),
                    read(first, 3),
                    read(0x00B0 + slot, 1),
                    value(order[1]),
                    read(first, 25),
                ])
            ));
            let exchanges = exchanges(&ran.bus_log);
            assert!(is_done(&exchanges[0]) && is_done(&exchanges[3]), "kind {kind}, {order:?}");
            let between = exchanges[1].registers().expect("the block");
            assert_eq!(between[usize::from(order[0])], word(order[0]), "it is kept");
            // Without an address: a fault of the configuration; without a kind: not in use.
            let status = exchanges[2].registers().expect("the status")[0];
            assert_eq!(status, if order[0] == 1 { 14 } else { 13 }, "kind {kind}");
            let block = exchanges[4].registers().expect("the block");
            assert_eq!(block[..4], [1, kind, address, 2]);
            assert!(ran.slot(slot.into()).any(|spoken| spoken.is_ok()), "kind {kind}, {order:?}");
        }
    }
}

/// Writing a setting's present value does not make the settings unsaved, nor interrupt a value; the error for a wrong number
/// lists the right ones.
#[test]
fn small_lies() {
    let ran = run(&format!(
        "seed = 1\nduration = \"2s\"\nt7 = [{{ address = 1, motion.constant = 12.5 }}]\n{}\n{}",
        r#"typed = [
            { at = "500ms", line = "slot 6 t7 110" },
            { at = "550ms", line = "slot 6 isu 1 -a 2" },
            { at = "600ms", line = "slot 6 pwm 1 -r 2" },
            { at = "650ms", line = "set 4 ask everything" },
        ]"#,
        requests(&[
            one(0x1009, 1),
            read(0x000A, 1),
            many(0x1800, &[1, 0xC200, 87]),
            read(0x000A, 1),
            one(0x1009, 2),
            read(0x000A, 1),
            many(0x1009, &[1]),
            read(0x000A, 1),
        ])
    ));
    let errors = said(&ran, r#"{"error":"#);
    for (error, expected) in errors.iter().zip([
        r#"{"error":{"kind":"out_of_range","what":"address","value":110,"allowed":"1 to 100 or 127"}}"#,
        r#"{"error":{"kind":"no_effect","what":"axis","why":"axis has no effect on kind isu"}}"#,
        r#"{"error":{"kind":"no_effect","what":"retries","why":"retries has no effect on kind pwm"}}"#,
        r#"{"error":{"kind":"no_effect","what":"ask","why":"ask has no effect on kind pwm"}}"#,
    ]) {
        assert_eq!(*error, expected);
    }
    assert_eq!(errors.len(), 4, "{errors:?}");
    let unsaved = exchanges(&ran.bus_log);
    let unsaved: Vec<bool> =
        unsaved.iter().filter_map(Exchange::registers).map(|words| words[0] & 8 != 0).collect();
    assert_eq!(unsaved, [false, false, true, false], "as it was again is saved, too");
}

/// Row 29: a guard that is named in the same request as a bit rate is kept, even if it was so before.
#[test]
fn a_guard_that_is_named_is_kept() {
    let ran = run(&format!(
        "seed = 1\nduration = \"2s\"\nt7 = [{{ address = 1, baud = 57600, motion.constant = 12.5 }}]\n{}",
        requests(&[
            many(0x1800, &[0, 57_600, 87]),
            read(0x1800, 3),
            many(0x1800, &[1, 0xC200]),
            read(0x1800, 3)
        ])
    ));
    let exchanges = exchanges(&ran.bus_log);
    assert_eq!(exchanges[1].registers(), Some(vec![0, 57_600, 87]));
    assert_eq!(exchanges[3].registers(), Some(vec![1, 0xC200, 87]));
}

/// Row 33: what breaks a bus is refused with its limit, or `load` names it.
#[test]
fn what_breaks_a_bus_is_refused_or_named() {
    let ran = run(&format!(
        "seed = 1\nduration = \"2500ms\"\nt7 = [{{ address = 1, motion.constant = 12.5 }}]\n{}",
        typed(&[
            "bus t7 --post 5000",
            "bus isu --post 1001",
            "set 0 timeout 0.1",
            "set 3 timeout 0.9",
            "load",
            "bus t7 -g 0 --post 500",
            "set 0 timeout 400",
            "set 1 filter mean 1",
            "set 1 stale 25",
            "load",
        ])
    ));
    let errors = said(&ran, r#"{"error":"#);
    for (error, expected) in errors.iter().zip([
        r#"{"error":{"kind":"out_of_range","what":"post_us","value":5000,"least":0,"most":2000}}"#,
        r#"{"error":{"kind":"out_of_range","what":"post_us","value":1001,"least":0,"most":1000}}"#,
        r#"{"error":{"kind":"does_not_fit","what":"timeout_ms","value":0.100,"least":2,"#,
        r#"{"error":{"kind":"does_not_fit","what":"timeout_ms","value":0.900,"least":1,"#,
    ]) {
        assert!(error.starts_with(expected), "{error}");
    }
    assert_eq!(errors.len(), 4, "{errors:?}");
    let unwise = said(&ran, r#"{"what":"unwise""#).join("\n");
    for part in [
        "bus t7: guard 0 us is shorter than one character, 87 us",
        "bus t7: post 500 us",
        "slot 0: timeout 400 ms is longer than period 20 ms",
        "slot 1: a filter over 1 sample does nothing",
        "slot 1: stale 25 ms, period 20 ms",
    ] {
        assert_eq!(unwise.matches(part).count(), 1, "{part}: {unwise}");
    }
}

/// A single-axis T7 says 0° for axes 0 and 1. It is found out before that is published, however the axis was set.
#[test]
fn a_single_axis_t7_is_found_out() {
    let ran = run(&format!(
        "seed = 1\nduration = \"3s\"\nt7 = [{{ address = 1, motion.constant = 33.333 }}]\n{}\n{}",
        r#"typed = [
            { at = "300ms", line = "slot 1 off" },
            { at = "320ms", line = "slot 2 off" },
            { at = "500ms", line = "slot 6 t7 1 -a 0" },
        ]"#,
        requests(&[
            many(0x1000 + 0x20 * 7, &[1, 1, 1, 1]),
            one(0x1003, 1),
            read(0x00B0, 8),
            read(0x00B0, 8),
            one(0x1003, 2),
        ])
    ));
    for slot in [6, 7] {
        let said: Vec<_> = ran.slot(slot).map(|spoken| spoken.reading.status.as_str()).collect();
        assert!(said.contains(&"config_fault") && !said.contains(&"ok"), "slot {slot}: {said:?}");
    }
    // Slot 0 while its axis was 1, from the write on.
    let during = ran.slot(0).filter(|spoken| (700 * MS..900 * MS).contains(&spoken.began));
    let during: Vec<_> =
        during.map(|spoken| (spoken.reading.status.as_str(), spoken.reading.angle_deg)).collect();
    assert!(during.iter().any(|(status, _)| *status == "config_fault"), "{during:?}");
    assert!(!during.iter().any(|(_, angle)| *angle == Some(0.0)), "{during:?}");
    let status = exchanges(&ran.bus_log)[3].registers().expect("the status of eight slots");
    assert_eq!((status[0], status[6], status[7]), (14, 14, 14));
    assert!(ran.slot(0).any(|spoken| spoken.began > 1_200 * MS && spoken.is_ok()), "and back");
    assert!(said(&ran, r#"{"slot""#).iter().all(|line| !line.contains(r#""angle_deg":0.000"#)));
}

/// The text of a gateway makes the same gateway.
#[test]
fn an_export_makes_the_same_gateway() {
    let exported = |ran: &Ran| -> Vec<String> {
        let line = |line: &&str| {
            serde_json::from_str::<serde_json::Value>(line).expect("an object")["export"].clone()
        };
        let lines = said(ran, r#"{"export":"#);
        lines.iter().map(line).map(|line| line.as_str().expect("text").to_owned()).collect()
    };
    let one = run(&format!(
        "seed = 1\nduration = \"4s\"\n{}",
        typed(&[
            "slot 7 t7 9 -a 1 -p 1000",
            "set 7 stale 1500 retries 5 filter median 5 timeout 123.456",
            "set 7 zero 12.345678 direction reversed tolerance 0.25",
            r#"set 7 name \"Boom left\""#,
            "slot 8 isu 0",
            "slot 9 pwm 2",
            "set 9 partner 8 enabled off",
            "slot 1 off",
            "bus t7 -g 300 --post 20 -e detect",
            "modbus address 17",
            "set console idle 3600",
            "export",
        ])
    ));
    let lines = exported(&one);
    assert!(lines.len() > 48 && lines.iter().all(|line| line.len() <= 80), "{lines:#?}");
    let export = "export".to_owned();
    let typed = lines.iter().chain([&export]).enumerate().map(|(place, line)| {
        format!(r#"{{ at = "{}ms", line = {} }},"#, 500 + place * 40, serde_json::Value::from(line.as_str()))
    });
    let other = run(&format!("seed = 1\nduration = \"6s\"\ntyped = [{}]", typed.collect::<String>()));
    assert_eq!(exported(&other), lines);
    assert_eq!(said(&other, r#"{"error"#), [""; 0]);
}

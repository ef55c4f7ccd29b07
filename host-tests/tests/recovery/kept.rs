//! What is kept in flash, on the shipped image: rot, what differs from the next start, what a save replaces.

use std::path::Path;

use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::{image, modbus};

use crate::typed;

/// FC 04 at 0x000A: *gateway status*; bit 3 is *unsaved*.
const STATUS: [u8; 5] = [4, 0x00, 0x0a, 0, 1];
const UNSAVED: u16 = 1 << 3;
/// FC 16 at 0x1F00: *save* without and with the arm key, `NV`.
const SAVE: [u8; 16] = [16, 0x1f, 0x00, 0, 5, 10, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0];
const SAVE_ARMED: [u8; 16] = [16, 0x1f, 0x00, 0, 5, 10, 0, 1, 0, 0, 0, 0, 0, 0, b'N', b'V'];
/// Six fast crashes in a row.
const CRASHES: &str =
    "[[plant]]\nat = \"100ms\"\nwhat = \"bus_fault\"\nlevel = \"main\"\ntimes = 6\nagain = \"100ms\"\n";
/// They are over by then, and bare mode has begun, ms.
const BARE: u64 = 900;

/// What one life of the board came to.
struct Life {
    lines: Vec<String>,
    exchanges: Vec<modbus::Exchange>,
    stored: Vec<u8>,
}

impl Life {
    /// *Unsaved*, at each request.
    fn unsaved(&self) -> Vec<bool> {
        let registers = self.exchanges.iter().filter_map(|exchange| exchange.registers());
        registers.map(|registers| registers[0] & UNSAVED != 0).collect()
    }

    /// Answers that begin like this.
    fn said(&self, begin: &str) -> Vec<&str> {
        self.lines.iter().map(String::as_str).filter(|line| line.starts_with(begin)).collect()
    }
}

/// Starts with this in the sectors.
fn live(stored: &[u8], duration_ms: u64, text: &str) -> Life {
    let text = format!("duration = \"{duration_ms}ms\"\n{text}");
    let scenario = Scenario::parse(Path::new("kept"), &text).unwrap_or_else(|error| panic!("{error}"));
    let image = image().clone().with_stored(stored).expect("it fits");
    let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
    let mut lines = Vec::new();
    run.finish(|line| lines.push(line.text.clone()));
    let mut log = Vec::new();
    run.write_bus_log(&mut log).expect("memory does not fail");
    Life { lines, exchanges: modbus::exchanges(&log), stored: run.board().stored() }
}

/// A board on which slot 0 is kept with a period of 77 ms.
fn kept() -> Vec<u8> {
    let life = live(&[], 900, &(typed(100, "set 0 period 77") + &typed(150, "save")));
    assert_eq!(life.said("{\"what\":\"saved\"").len(), 1, "{:?}", life.lines);
    life.stored
}

/// The period that slot 0 has after a start, in ms.
fn period(stored: &[u8]) -> String {
    let life = live(stored, 300, &typed(100, "show 0"));
    let config = life.said("{\"config\"").into_iter().next().expect("a slot").to_owned();
    let rest = config.split("\"period_ms\":").nth(1).expect("a period");
    rest.split([',', '}']).next().expect("a number").to_owned()
}

#[test]
fn a_save_goes_behind_flash_that_has_rotted() {
    let before = kept();
    // The first free word behind the record.
    let used = before[..16 * 1024].iter().rposition(|&byte| byte != 0xff).expect("a record") / 4 * 4 + 4;
    for (offset, rotten) in [(0, 4), (8, 4), (16, 1), (40, 64)] {
        let mut stored = before.clone();
        stored[used + offset..][..rotten].fill(0);
        let life = live(&stored, 700, &(typed(100, "set 0 period 88") + &typed(150, "save")));
        assert_eq!(
            life.said("{\"what\":\"saved\""),
            [r#"{"what":"saved","stored":"written"}"#],
            "{offset}: {:?}",
            life.said("{\"error\"")
        );
        assert_eq!(period(&life.stored), "88", "{offset}");
    }
}

#[test]
fn what_differs_from_the_next_start_is_told_after_a_factory_reset() {
    let asked = |at_ms| modbus::request(&STATUS, at_ms);
    // (Typed before the factory reset, typed after it, unsaved at each question.)
    for (before, after, expected) in [
        // What runs is what is kept; then the next start is as delivered.
        ("set 0 period 77", "set 0 period 20", [true, true, false]),
        // It runs as delivered anyway.
        ("version", "version", [false, false, false]),
        ("version", "set 0 period 30", [false, false, true]),
    ] {
        let lines = [(100, before), (300, "factory-reset --yes"), (2_200, after)];
        let lines: String = lines.into_iter().map(|(at, line)| typed(at, line)).collect();
        let life = live(&[], 2_600, &(lines + &asked(200) + &asked(2_000) + &asked(2_400)));
        assert_eq!(life.unsaved(), expected, "{before}, {after}");
    }
    // What was kept runs on until the next start.
    let life = live(&kept(), 2_400, &(typed(300, "factory-reset --yes") + &asked(200) + &asked(2_200)));
    assert_eq!(life.unsaved(), [false, true]);
    assert_eq!(period(&life.stored), "20");
}

#[test]
fn what_is_set_back_is_not_unsaved() {
    let asked = |at_ms| modbus::request(&STATUS, at_ms);
    let lines = typed(100, "set 0 period 30") + &typed(300, "set 0 period 77");
    let life = live(&kept(), 600, &(lines + &asked(200) + &asked(400)));
    assert_eq!(life.unsaved(), [true, false]);
}

#[test]
fn bare_mode_says_that_the_next_start_differs_and_asks_before_it_replaces_it() {
    let at = |ms: u64, line: &str| typed(BARE + ms, line);
    let asked = |ms: u64| modbus::request(&STATUS, BARE + ms);
    let stored = kept();
    // A program has to confirm, a person is asked; declining changes nothing.
    let text = at(0, "reset-cause")
        + &asked(50)
        + &at(100, "save")
        + &at(200, "json off")
        + &at(300, "save")
        + &at(400, "n");
    let life = live(&stored, BARE + 700, &(CRASHES.to_owned() + &text));
    assert!(life.said("{\"what\":\"start\"")[0].contains(r#""mode":"bare""#), "{:?}", life.lines);
    assert_eq!(life.unsaved(), [true]);
    let refused = life.said("{\"error\"");
    assert!(refused.len() == 1 && refused[0].contains("unconfirmed"), "{refused:?}");
    assert!(life.lines.iter().any(|line| line.contains("this replaces saved settings")), "{:?}", life.lines);
    assert_eq!(life.stored, stored);

    // Confirmed, it is done, at once and for good.
    let text = asked(50) + &at(100, "save --yes") + &asked(900) + &at(1_000, "save");
    let life = live(&stored, BARE + 1_300, &(CRASHES.to_owned() + &text));
    let saved = [r#"{"what":"saved","stored":"written"}"#, r#"{"what":"saved","stored":"unchanged"}"#];
    assert_eq!((life.said("{\"what\":\"saved\""), life.unsaved()), (saved.to_vec(), vec![true, false]));
    assert_eq!(period(&life.stored), "20");
}

#[test]
fn bare_mode_takes_a_save_over_modbus_with_the_key_only() {
    let stored = kept();
    for (pdu, answer, expected) in [(&SAVE, &[1, 0x90, 3][..], "77"), (&SAVE_ARMED, &[1, 16], "20")] {
        let request = modbus::request(pdu, BARE + 100);
        let life = live(&stored, BARE + 1_000, &(CRASHES.to_owned() + &request));
        let [exchange] = &life.exchanges[..] else { panic!("one request: {:?}", life.exchanges) };
        let bytes = &exchange.answer.as_ref().expect("an answer").bytes;
        assert_eq!(bytes.get(..answer.len()), Some(answer));
        assert_eq!(period(&life.stored), expected);
    }
}

#[test]
fn bare_mode_on_a_board_that_keeps_nothing_asks_nothing() {
    let text = modbus::request(&STATUS, BARE + 50) + &typed(BARE + 100, "save");
    let life = live(&[], BARE + 900, &(CRASHES.to_owned() + &text));
    assert_eq!(life.unsaved(), [false]);
    assert_eq!(life.said("{\"what\":\"saved\""), [r#"{"what":"saved","stored":"written"}"#]);
}

#[test]
fn a_save_without_the_key_is_taken_where_nothing_unseen_is_replaced() {
    let life = live(&kept(), 1_000, &(typed(100, "set 0 period 88") + &modbus::request(&SAVE, 200)));
    assert!(life.exchanges[0].answer.as_ref().is_some_and(|answer| answer.bytes[1] == 16));
    assert_eq!(period(&life.stored), "88");
}

#[test]
fn settings_that_a_newer_firmware_has_kept_are_not_replaced_unasked() {
    let stored = newer(&kept());
    let text = modbus::request(&STATUS, 100)
        + &modbus::request(&SAVE, 150)
        + &typed(200, "save")
        + &modbus::request(&STATUS, 300);
    let life = live(&stored, 500, &text);
    // The next start does not take them either.
    assert_eq!(life.unsaved(), [false, false]);
    assert!(life.exchanges[1].answer.as_ref().is_some_and(|answer| answer.bytes[1..3] == [0x90, 3]));
    assert!(life.said("{\"error\"")[0].contains("unconfirmed"), "{:?}", life.lines);
    assert_eq!(life.stored, stored);
    let life = live(&stored, 900, &typed(200, "save --yes"));
    assert_eq!(life.said("{\"what\":\"saved\"").len(), 1);
    assert_ne!(life.stored, stored);
}

/// The same as a firmware would keep it whose records have a version that is not known yet.
fn newer(stored: &[u8]) -> Vec<u8> {
    let mut stored = stored.to_vec();
    // An item: checksum, length, check of the length, the record (`sequential-storage` 8). The record: version, kind, content,
    // checksum.
    let half = |at: usize| usize::from(u16::from_le_bytes([stored[at], stored[at + 1]]));
    let word = |at: usize| u32::from_le_bytes([stored[at], stored[at + 1], stored[at + 2], stored[at + 3]]);
    let is_item = |at: &usize| {
        let record = at + 8..at + 8 + half(at + 4);
        half(at + 4) > 6 && record.end < stored.len() && item_check(&stored[record]) == word(*at)
    };
    let at = (8..1_024).step_by(4).find(is_item).expect("an item");
    let (begin, end) = (at + 8, at + 8 + half(at + 4));
    stored[begin] += 1;
    let check = !crc(&stored[begin..end - 4], 0xedb8_8320, u32::MAX);
    stored[end - 4..end].copy_from_slice(&check.to_le_bytes());
    let check = item_check(&stored[begin..end]);
    stored[at..at + 4].copy_from_slice(&check.to_le_bytes());
    stored
}

/// CRC-32C from another start, so that ones alone have another one.
fn item_check(record: &[u8]) -> u32 {
    !crc(record, 0x82f6_3b78, 0xeeee_eeee)
}

fn crc(bytes: &[u8], polynomial: u32, start: u32) -> u32 {
    bytes.iter().fold(start, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { polynomial } else { 0 })
    })
}

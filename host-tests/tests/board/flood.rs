//! Whatever arrives at the console or the Modbus port, and however much: the gateway goes on polling the buses.

use std::fmt::Write as _;

use clino_board::analysis::PollVerdict;
use clino_host_tests::{Ran, modbus, run};

const MS: u64 = 1_000_000;
const NODES: u8 = 8;

/// What a poll may come later than without the flood, ns.
const DELAY: i64 = 100_000;

/// `NODES` T7s, asked as often as the bus can; from 1 s to 3 s, what `flood` writes.
fn scenario(flood: impl Fn(&mut String)) -> Ran {
    let mut text = String::from("seed = 9\nduration = \"4500ms\"\n");
    for address in 1..=NODES {
        let node = format!("address = {address}\nmotion.constant = {address}.0\nlatency = \"1ms\"\n");
        write!(text, "[[t7]]\n{node}").expect("text");
    }
    text += "[[isu]]\naddress = 1\nmotion.constant = 90.0\n";
    for slot in 0..NODES {
        let at = 10 + 10 * u64::from(slot);
        let line = format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1);
        write!(text, "[[typed]]\nat = \"{at}ms\"\nline = \"{line}\"\n").expect("text");
    }
    text += "[[typed]]\nat = \"120ms\"\nline = \"slot 8 isu 1\"\n";
    text += "[[typed]]\nat = \"200ms\"\nline = \"json off\"\n";
    flood(&mut text);
    // What was taken of the flood is answered first; what was taken of its last line is ended.
    text += "[[typed]]\nat = \"4100ms\"\nline = \"\"\n";
    text +=
        "[[typed]]\nat = \"4200ms\"\nline = \"json on\"\n[[typed]]\nat = \"4300ms\"\nline = \"version\"\n";
    run(&text)
}

/// The longest time from the end of an answer to the next request, ns, in a part of the run.
fn longest_turnaround(ran: &Ran, from: u64, until: u64) -> i64 {
    let polls = ran.t7.polls.iter().filter(|poll| (from..until).contains(&poll.de_high));
    polls.filter_map(|poll| poll.turnaround()).max().expect("polls")
}

fn assert_undisturbed(ran: &Ran, what: &str) {
    let calm = longest_turnaround(ran, 500 * MS, 1_000 * MS);
    let flooded = longest_turnaround(ran, 1_000 * MS, 3_000 * MS);
    println!("{what}: from answer to request {} us at most, {} us before", flooded / 1_000, calm / 1_000);
    assert!(flooded - calm <= DELAY, "{} us later", (flooded - calm) / 1_000);
    let polls = ran.t7.polls.iter().filter(|poll| (500 * MS..4_400 * MS).contains(&poll.de_high));
    let bad = polls.filter(|poll| poll.verdict != PollVerdict::Good).count();
    assert_eq!(bad, 0, "polls that were not answered");
    // It is the same gateway that answers in the end: no reset.
    let version = ran.lines.iter().rfind(|line| line.text.contains("uptime_ms")).expect("it still answers");
    let uptime = version.text.split("uptime_ms\":").nth(1).and_then(|rest| rest.split(['}', ',']).next());
    let uptime: u64 = uptime.expect("an uptime").parse().expect("a number");
    assert!((4_250..4_400).contains(&uptime), "{uptime} ms");
}

#[test]
fn a_flood_at_the_console_delays_no_poll() {
    // 78 characters take 6.8 ms: the line is never idle. Words of the language, wrong ones, control characters.
    let lines = [
        "slot 0 t7 200 -p 99999999 -r 77 -x -y -z slot slot slot slot slot slot slot slot",
        "list list list list list list list list list list list list list list list list1",
        "help",
        "counters",
        "\\u0003\\u001b[A\\u001b[B\\u001b[C\\u001b[D\\u007f\\u007f\\u0008\\u0000\\u0001\\u001bOP~~~~",
        "list",
    ];
    let ran = scenario(|text| {
        for number in 0..290_u64 {
            let line = lines[number as usize % lines.len()];
            let at = 1_000_000 + 6_900 * number;
            write!(text, "[[typed]]\nat = \"{at}us\"\nline = \"{line}\"\n").expect("text");
        }
    });
    assert_undisturbed(&ran, "console");
    for slot in 0..NODES.into() {
        let last = ran.slot(slot).last().expect("a reading");
        assert_eq!(last.reading.address, slot as u8 + 1, "slot {slot} reads what it was told to");
    }
}

#[test]
fn a_flood_at_the_modbus_port_delays_no_poll() {
    let ran = scenario(|text| {
        // As much as can be asked for, again and again: 8 characters, the silence, 255 characters, the silence.
        for number in 0..12_u64 {
            *text += &modbus::request(&[3, 0x01, 0x00, 0x00, 125], 1_000 + 160 * number);
        }
    });
    assert_undisturbed(&ran, "Modbus");
    let exchanges = modbus::exchanges(&ran.bus_log);
    assert_eq!(exchanges.iter().filter_map(modbus::Exchange::registers).count(), 12);
}

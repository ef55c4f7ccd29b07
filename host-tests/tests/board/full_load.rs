//! Everything at once: 32 T7 that take the 2 ms they may and are asked as often as the bus can, 14 ISU, 2 PWM inputs, and
//! a Modbus master that reads 32 angles and 32 ages without a pause.

use std::fmt::Write as _;

use clino_board::analysis::{Poll, PollVerdict, Protocol};
use clino_host_tests::modbus::{self, Exchange};
use clino_host_tests::{Ran, elf, run};
use clino_inspect::annotations::Annotations;
use clino_inspect::report::Report;
use clino_inspect::stack;

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;

/// Three characters of request, 2 ms, eight of answer, at 115200 bit/s, ten bits each, in seconds.
const POLL: f64 = 0.002 + 110.0 / 115_200.0;

/// 3.5 characters of eleven bits at 19200 bit/s, ns.
const T3_5: u64 = 2_005_208;

/// How fast the ISUs turn, °/s, and how far from one refresh (8/15 s) to the next.
const RATE: f64 = 3.0;
const STEP: f64 = RATE * 8.0 / 15.0;

/// From the beginning of one Modbus request to the next: 8 characters, t3.5 and 0.5 ms, 197 characters, t3.5.
const ROUND_MS: u64 = 123;

const SETUP_MS: u64 = 1_000;
const UNTIL_MS: u64 = 5_000;

fn scenario(t7_alive: impl Fn(u8) -> bool) -> String {
    let mut text = format!("seed = 5\nduration = \"{UNTIL_MS}ms\"\n");
    for address in (1..=32).filter(|&address| t7_alive(address)) {
        let node = format!("address = {address}\nmotion.constant = {address}.25\nlatency = \"2ms\"\n");
        write!(text, "[[t7]]\n{node}").expect("text");
    }
    for address in 1..=14 {
        write!(text, "[[isu]]\naddress = {address}\nmotion.ramp.rate = {RATE}\n").expect("text");
    }
    text += "[[pwm]]\nchannel = 1\nmotion.constant = 90.0\n[[pwm]]\nchannel = 2\nmotion.constant = 180.0\n";
    let t7 = (0..32).map(|slot| format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1));
    let isu = (32..46).map(|slot| format!("slot {slot} isu {}", slot - 31));
    let pwm = (46..48).map(|slot| format!("slot {slot} pwm {}", slot - 45));
    for (number, line) in t7.chain(isu).chain(pwm).enumerate() {
        write!(text, "[[typed]]\nat = \"{}ms\"\nline = \"{line}\"\n", 20 + 10 * number).expect("text");
    }
    for at in (SETUP_MS..UNTIL_MS - ROUND_MS).step_by(ROUND_MS as usize) {
        text += &modbus::request(&[4, 0x00, 0x20, 0x00, 0x60], at);
    }
    text
}

fn polls(ran: &Ran) -> impl Iterator<Item = &Poll> {
    ran.t7.polls.iter().filter(|poll| (2 * SECOND..UNTIL_MS * MS).contains(&poll.de_high))
}

const SECONDS: f64 = 3.0;

#[test]
fn every_duty_is_done() {
    let ran = run(&scenario(|_| true));
    let t7 = polls(&ran).count() as f64 / SECONDS;
    println!("T7: {t7:.1} polls/s, {:.2} % of {:.1}", 100.0 * t7 * POLL, 1.0 / POLL);
    assert!(t7 >= 0.94 / POLL, "{t7} polls a second");
    let bad = polls(&ran).find(|poll| poll.verdict != PollVerdict::Good && !poll.is_open(UNTIL_MS * MS));
    assert!(bad.is_none(), "{bad:?}");

    no_refresh_is_missed(&ran);
    let exchanges = modbus::exchanges(&ran.bus_log);
    the_master_gets_what_is_true(&exchanges);

    let waits: Vec<u64> = exchanges.iter().filter_map(Exchange::wait).map(|wait| wait - T3_5).collect();
    let longest = waits.iter().max().expect("answers");
    println!("Modbus: {} answers, first bit at most {} us after t3.5", waits.len(), longest / 1_000);
    assert!(*longest <= 500_000, "{longest} ns after t3.5");

    let load = load(&ran.summary, UNTIL_MS);
    println!("core: {load:.2} % of the instructions at 168 MHz");
    assert!(load <= 10.0, "{load} %");
    assert!(ran.slot(46).last().is_some_and(|spoken| spoken.is_ok()));
    the_stack_is_no_deeper_than_computed(&ran);
}

/// What was seen of the stack against what `cargo xtask check stack` says.
fn the_stack_is_no_deeper_than_computed(ran: &Ran) {
    let table = include_str!("../../../xtask/inspect/stack.toml");
    let annotations = Annotations::parse(table).expect("the table of what is known");
    let image = std::fs::read(elf()).expect("the image");
    let report = Report::of(&image, &annotations).unwrap_or_else(|error| panic!("{error}"));
    let top = report.image.vectors.first().expect("the initial stack pointer");
    let (seen, computed) = (top - ran.lowest_sp, stack::total(&report.levels));
    println!("stack: {seen} bytes seen, {computed} computed");
    assert!(seen > 0 && seen <= computed, "{seen} bytes seen, {computed} computed");
}

#[test]
fn half_of_the_t7s_dead_cost_the_others_five_percent_at_most() {
    // Sixteen alone go round sixteen times as often as one in sixteen of the limit.
    let ran = run(&scenario(|address| address % 2 == 0));
    let alive = polls(&ran).filter(|poll| poll.verdict == PollVerdict::Good).count() as f64 / SECONDS;
    let alone = alone();
    println!("16 of 32 dead: {alive:.1} good polls/s, alone {alone:.1}: {:.2} %", 100.0 * alive / alone);
    assert!(alive >= 0.95 * alone, "{alive} of {alone}");
}

/// Good polls a second of the sixteen nodes when only nodes that exist are configured.
fn alone() -> f64 {
    let scenario = scenario(|address| address % 2 == 0);
    let lines = scenario.lines().map(|line| {
        let odd = line.strip_prefix("line = \"slot ").and_then(|rest| rest.split_once(" t7 "));
        match odd.and_then(|(slot, _)| slot.parse::<u8>().ok()) {
            Some(slot) if slot % 2 == 0 => format!("line = \"slot {slot} off\""),
            _ => line.to_owned(),
        }
    });
    let ran = run(&lines.collect::<Vec<_>>().join("\n"));
    polls(&ran).filter(|poll| poll.verdict == PollVerdict::Good).count() as f64 / SECONDS
}

/// Every angle that an ISU has had was read: one is a step from the one before.
fn no_refresh_is_missed(ran: &Ran) {
    for address in 1..=14 {
        let mine = ran.isu.polls.iter().filter(|poll| {
            poll.address(Protocol::Isu) == Some(address)
                && poll.verdict == PollVerdict::Good
                && poll.de_high > 2 * SECOND
        });
        // Start, address and function, length, code high and low, checksum.
        let mut codes: Vec<u16> =
            mine.map(|poll| u16::from_be_bytes([poll.answer[3], poll.answer[4]])).collect();
        codes.dedup();
        assert!(codes.len() >= 5, "ISU {address}: {codes:?}");
        for pair in codes.windows(2) {
            let moved = f64::from(pair[1].wrapping_sub(pair[0])) * 360.0 / 65_536.0;
            assert!((moved - STEP).abs() < 0.02, "ISU {address} moved by {moved} degrees: {codes:?}");
        }
    }
}

fn the_master_gets_what_is_true(exchanges: &[Exchange]) {
    assert!(exchanges.len() >= 30, "{}", exchanges.len());
    for exchange in exchanges {
        let registers = exchange.registers().unwrap_or_else(|| panic!("{exchange:?}"));
        assert_eq!(registers.len(), 96);
        for slot in 0..32 {
            let angle = u32::from(registers[2 * slot]) << 16 | u32::from(registers[2 * slot + 1]);
            assert_eq!(angle, 1_000 * (slot as u32 + 1) + 250, "slot {slot}");
            // Stale after a second; asked ten times in it.
            assert!(registers[64 + slot] < 200, "slot {slot} is {} ms old", registers[64 + slot]);
        }
    }
}

/// Instructions in the whole run, as a part of what the core could do in this time, in percent.
fn load(summary: &str, ms: u64) -> f64 {
    let line = summary.lines().find(|line| line.contains("core awake")).expect("a figure");
    let instructions = line.split(['(', ' ']).filter_map(|word| word.parse::<f64>().ok()).next_back();
    let possible = 168_000.0 * ms as f64;
    100.0 * instructions.expect("a number") / possible
}

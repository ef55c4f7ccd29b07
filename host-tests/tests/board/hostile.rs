//! A faulty bus: the name the gateway gives the fault, its effect on the rest, and the time until all nodes are read again.
//!
//! Eight T7s, three ISUs, both PWM inputs and a Modbus master. One bus is out of order from 1 s to 3 s; all figures are
//! compared with those of the same time in a run in which nothing is.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::OnceLock;

use clino_board::analysis::{Analysis, PollVerdict, Protocol};
use clino_host_tests::modbus::{self, Exchange};
use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;
const FROM: u64 = SECOND;
const UNTIL: u64 = 3 * SECOND;
const END_MS: u64 = 4_800;
/// When the console asks for the state of the buses.
const ASKED_MS: u64 = 2_500;

const T7S: u8 = 8;
const ISUS: u8 = 3;
/// Slots of the gateway's own table: T7 1 to 3, ISU 1, PWM 1 and 2. The others are set by hand, from this one on.
const NEXT_SLOT: u8 = 6;

/// The same request is not asked again before a late answer to it is out of the question: 3 characters and the guard, 2 ms, a
/// character and its margin, 25 ms. Then all are asked: the guard, 3 characters, 2 ms, 8 characters each.
const T7_CYCLE: u64 = 27_600_000 + T7S as u64 * 3_050_000;
/// The same for ISUs: 5 characters and the guard, 51 ms, a character and its margin, 400 ms. Then 12 characters and 6 ms each.
const ISU_CYCLE: u64 = 460 * MS + ISUS as u64 * 19 * MS;
/// What a sensor may have taken for the beginning of a message it gives up after this, if it hears nothing: T7 guide section
/// 1, AN #201 section 4; and 4 %, in case our clock is fast.
const T7_DEAF: u64 = 520 * MS;
const ISU_DEAF: u64 = 416 * MS;
/// A T7 that has taken something for the beginning of a message may have to hear this many characters before it hears us
/// again, unless the line is silent for that long; and there are three in each request.
const T7_LONGEST: u64 = 257;
const T7_SWALLOWS: u64 = T7_LONGEST.div_ceil(3 * T7S as u64) * T7_CYCLE;
/// Longest exchange that may be under way when the fault ends: one that waits for silence on the line, for
/// 68 or 257 characters.
const T7_EXCHANGE: u64 = 6 * MS;
const ISU_EXCHANGE: u64 = 270 * MS;

/// 3.5 characters of eleven bits at 19200 bit/s, ns.
const T3_5: u64 = 2_005_208;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bus {
    T7,
    Isu,
}

/// Something that is wrong with a bus.
struct Case {
    bus: Bus,
    /// Of the segment.
    segment: &'static str,
    /// The receiver of the gateway is always on at the T7 bus, and it is set accordingly.
    hears_itself: bool,
    /// Of the last sensor.
    sensor: &'static str,
    /// What is typed at the console, and when, in ms.
    typed: &'static [(u64, &'static str)],
    /// What the gateway may call it: names, and their codes in the register map.
    called: &'static [(&'static str, u16)],
    /// The sensors hear what is no message.
    deafens: bool,
}

const WELL: Case = Case {
    bus: Bus::T7,
    segment: "",
    hears_itself: false,
    sensor: "",
    typed: &[],
    called: &[],
    deafens: false,
};

fn scenario(case: &Case) -> String {
    let mut text = format!("seed = 5\nduration = \"{END_MS}ms\"\n");
    let echo = if case.hears_itself { "echo = true\n" } else { "" };
    let segment = |bus| if case.bus == bus { [echo, case.segment].concat() } else { String::new() };
    let sensor = |bus, last: bool| if case.bus == bus && last { case.sensor } else { "" };
    write!(text, "[segments.t7]\n{}\n[segments.isu]\n{}\n", segment(Bus::T7), segment(Bus::Isu))
        .expect("text");
    for address in 1..=T7S {
        let more = sensor(Bus::T7, address == T7S);
        write!(text, "[[t7]]\naddress = {address}\nmotion.ramp.rate = {address}\n{more}\n").expect("text");
    }
    for address in 1..=ISUS {
        let more = sensor(Bus::Isu, address == ISUS);
        write!(text, "[[isu]]\naddress = {address}\nmotion.ramp.rate = {address}\n{more}\n").expect("text");
    }
    text += "[[pwm]]\nchannel = 1\nmotion.constant = 90.0\n[[pwm]]\nchannel = 2\nmotion.constant = 180.0\n";
    let t7 = (4..=T7S).map(|address| format!("t7 {address}"));
    let slots = t7.chain((2..=ISUS).map(|address| format!("isu {address}")));
    let slots = (NEXT_SLOT..).zip(slots).map(|(slot, what)| format!("slot {slot} {what}"));
    let set_up = (1..).zip(slots).map(|(n, line)| (20 * n, line));
    let told = case.hears_itself.then(|| (400, "bus t7 -e expected".to_owned()));
    let case_s = told.into_iter().chain(case.typed.iter().map(|&(at, line)| (at, line.to_owned())));
    let shown =
        [ASKED_MS, 4_600].into_iter().flat_map(|at| [(at, "bus t7".into()), (at + 20, "bus isu".into())]);
    for (at, line) in set_up.chain(case_s).chain(shown) {
        write!(text, "[[typed]]\nat = \"{at}ms\"\nline = {line:?}\n").expect("text");
    }
    // By turns: the angles of eight slots, what is said of both buses, how long the gateway has been running.
    for (n, at) in (500..END_MS - 100).step_by(50).enumerate() {
        let [high, low] = [ANGLES, T7_FAULT, ISU_FAULT, UPTIME][n % 4].to_be_bytes();
        let count = [0x10, 6, 6, 2][n % 4];
        text += &modbus::request(&[4, high, low, 0, count], at);
    }
    text
}

/// Registers: the first angle; a bus's *fault*, *faults*, *in_vain*; *uptime*.
const ANGLES: u16 = 0x0020;
const T7_FAULT: u16 = 0x0936;
const ISU_FAULT: u16 = 0x0976;
const UPTIME: u16 = 0x0008;

fn quiet() -> &'static Ran {
    static QUIET: OnceLock<Ran> = OnceLock::new();
    QUIET.get_or_init(|| run(&scenario(&WELL)))
}

fn bus(ran: &Ran, bus: Bus) -> (&Analysis, Protocol) {
    match bus {
        Bus::T7 => (&ran.t7, Protocol::T7),
        Bus::Isu => (&ran.isu, Protocol::Isu),
    }
}

/// Good answers on a bus while the fault lasts.
fn good(ran: &Ran, which: Bus) -> u64 {
    let polls = bus(ran, which).0.polls.iter();
    polls.filter(|poll| (FROM..UNTIL).contains(&poll.de_high) && poll.verdict == PollVerdict::Good).count()
        as u64
}

/// Lines of the slots that are not on this bus, while the fault lasts.
fn others(ran: &Ran, which: Bus) -> impl Iterator<Item = &clino_host_tests::Spoken> {
    let name = if which == Bus::T7 { "t7" } else { "isu" };
    let meanwhile = ran.spoken.iter().filter(|spoken| (FROM..UNTIL).contains(&spoken.began));
    meanwhile.filter(move |spoken| spoken.reading.kind != name)
}

/// What the register *fault* of a bus said, and when it was asked.
fn told(exchanges: &[Exchange], which: Bus) -> Vec<(u64, u16, u32)> {
    let address = if which == Bus::T7 { T7_FAULT } else { ISU_FAULT };
    let asked = exchanges.iter().filter(|exchange| exchange.request.bytes[2..4] == address.to_be_bytes());
    asked
        .map(|exchange| {
            let registers = exchange.registers().unwrap_or_else(|| panic!("{exchange:?}"));
            let [0, fault, high, low, ..] = registers[..] else { panic!("{registers:?}") };
            (exchange.request.end, fault, u32::from(high) << 16 | u32::from(low))
        })
        .collect()
}

/// What `bus …` said, and when.
fn shown(ran: &Ran, which: Bus) -> Vec<(u64, String)> {
    let begin = if which == Bus::T7 { "{\"bus\":\"t7\"" } else { "{\"bus\":\"isu\"" };
    let lines = ran.lines.iter().filter(|line| line.text.starts_with(begin));
    lines
        .filter_map(|line| {
            let (_, rest) = line.text.split_once("\"fault\":")?;
            Some((line.at, rest.trim_end_matches('}').trim_matches('"').to_owned()))
        })
        .collect()
}

fn check(case: &Case) {
    let (ran, quiet) = (run(&scenario(case)), quiet());
    // The truth: never a wrong angle, and every slot right again at the end.
    assert!(ran.all_well, "{}", ran.summary);
    let exchanges = modbus::exchanges(&ran.bus_log);
    let back = back(&ran, case);
    the_fault_is_told(&ran, &exchanges, case);
    others_do_not_notice(&ran, quiet, case);
    the_uplinks_run_on(&ran, quiet, &exchanges);
    let (cycle, deaf) = match case.bus {
        Bus::T7 => (T7_CYCLE, T7_EXCHANGE + T7_SWALLOWS + T7_DEAF),
        Bus::Isu => (ISU_CYCLE, ISU_EXCHANGE + ISU_DEAF),
    };
    // A node that has heard a part of a request may be deaf, too.
    let polls = &bus(&ran, case.bus).0.polls;
    let cut = polls.iter().any(|poll| (poll.de_high..poll.last_stop).contains(&UNTIL));
    // It takes a cycle to see which nodes are deaf.
    let most = cycle + if case.deafens || cut { deaf + cycle } else { 0 };
    assert!(back <= most, "the last one was back after {} us, {} at most", back / 1_000, most / 1_000);
}

/// From the end of the fault to the end of the first good answer of the node that was the last to give one, ns.
fn back(ran: &Ran, case: &Case) -> u64 {
    let (analysis, protocol) = bus(ran, case.bus);
    let nodes = if case.bus == Bus::T7 { T7S } else { ISUS };
    let mut back: BTreeMap<u8, u64> = BTreeMap::new();
    for poll in
        analysis.polls.iter().filter(|poll| poll.de_high >= UNTIL && poll.verdict == PollVerdict::Good)
    {
        let (Some(address), Some(end)) = (poll.address(protocol), poll.answer_end) else { continue };
        back.entry(address).or_insert(end - UNTIL);
    }
    assert_eq!(back.len(), usize::from(nodes), "{back:?}");
    let us: Vec<u64> = back.values().map(|ns| ns / 1_000).collect();
    println!("{:?} {}{}: back after {us:?} us", case.bus, case.segment, case.sensor);
    back.into_values().max().expect("nodes")
}

fn the_fault_is_told(ran: &Ran, exchanges: &[Exchange], case: &Case) {
    let told_us = told(exchanges, case.bus);
    let first = told_us.iter().find(|(at, fault, _)| *at > FROM && *fault != 0).expect("it is reported");
    println!("told over Modbus {} ms after the beginning", (first.0 - FROM) / MS);
    // Half a second and a cycle; an ISU that answered the last time is waited for longer, and Modbus asks every 200 ms.
    // After a change of the bit rate the bus is silent first, until its nodes hear.
    let silent = if case.typed.is_empty() { 0 } else { T7_DEAF / MS };
    let by = silent + if case.bus == Bus::T7 { 550 } else { 1_100 };
    assert!(first.0 <= FROM + (by + 210) * MS, "{first:?}");
    // Good answers on the bus since the fault was told: into a pause of what babbles one may fit, and ends the fault.
    let answered = |until: u64| {
        let polls = &bus(ran, case.bus).0.polls;
        polls
            .iter()
            .any(|poll| poll.verdict == PollVerdict::Good && (FROM + MS..until).contains(&poll.de_high))
    };
    for (at, fault, faults) in told_us {
        let during = (FROM + (by + 210) * MS..UNTIL).contains(&at);
        if during {
            let named = case.called.iter().any(|&(_, code)| code == fault);
            assert!(named || fault == 0 && answered(at), "{fault} at {at}");
        }
        if !(FROM..=UNTIL + SECOND).contains(&at) {
            assert_eq!(fault, 0, "at {at}");
        }
        if at > FROM + (by + 210) * MS {
            assert!(faults == 1 || faults > 1 && answered(at), "{faults} at {at}");
        }
    }
    let shown = shown(ran, case.bus);
    println!("shown: {shown:?}");
    let [(at, during), (_, after)] = &shown[..] else { panic!("{shown:?}") };
    let named = case.called.iter().any(|&(name, _)| name == during);
    assert!(named || during == "null" && answered(*at), "{during}");
    assert_eq!(after, "null");
    // All slots of the bus say so, and none has an angle once its last one is stale.
    let name = if case.bus == Bus::T7 { "t7" } else { "isu" };
    let stale = FROM + (by + 500) * MS..UNTIL;
    let mut mine =
        ran.spoken.iter().filter(|spoken| spoken.reading.bus == name && stale.contains(&spoken.began));
    assert!(mine.all(|spoken| !spoken.is_ok() || answered(spoken.began)));
}

fn others_do_not_notice(ran: &Ran, quiet: &Ran, case: &Case) {
    let other = if case.bus == Bus::T7 { Bus::Isu } else { Bus::T7 };
    let (with, without) = (good(ran, other), good(quiet, other));
    println!("{other:?} bus: {with} good answers, {without} in a quiet run");
    assert!(with.abs_diff(without) * 100 <= without, "{with} and {without}");
    assert!(others(ran, case.bus).all(|spoken| spoken.is_ok()));
    let exchanges = modbus::exchanges(&ran.bus_log);
    assert!(told(&exchanges, other).iter().all(|&(_, fault, faults)| fault == 0 && faults == 0));
}

fn the_uplinks_run_on(ran: &Ran, quiet: &Ran, exchanges: &[Exchange]) {
    let waits: Vec<u64> =
        exchanges.iter().map(|exchange| exchange.wait().expect("an answer") - T3_5).collect();
    let longest = waits.iter().max().expect("answers") / 1_000;
    // A bus full of characters takes its part of the core: half a millisecond is promised for a full load of good ones.
    assert!(longest <= 1_000, "{longest} us");
    // The stream of readings fills the console, fault or not; the answer to a command comes next but one.
    let answered = |ran| {
        let shown = [shown(ran, Bus::T7), shown(ran, Bus::Isu)];
        let at = shown.map(|shown| shown.first().expect("an answer").0);
        [at[0] - ASKED_MS * MS, at[1] - (ASKED_MS + 20) * MS].map(|ns| ns / MS)
    };
    let console = [answered(ran), answered(quiet)];
    println!("Modbus: {} answers, at most {longest} us after t3.5; console: {console:?} ms", waits.len());
    assert!(console[0].iter().all(|&ms| ms <= 30), "{console:?}");
    // It has run since power-up.
    let uptime = exchanges.iter().rev().find(|exchange| exchange.request.bytes[2..4] == UPTIME.to_be_bytes());
    let registers = uptime.and_then(Exchange::registers).expect("an answer");
    assert!(registers[1] >= 4, "{registers:?}");
}

const MUTE: (&str, u16) = ("mute", 1);
const BREAK: (&str, u16) = ("break", 2);
const BABBLE: (&str, u16) = ("babble", 3);
const GARBAGE: (&str, u16) = ("garbage", 4);
const CONTENTION: (&str, u16) = ("contention", 5);

const BABBLING: &str = r#"babble = [{ from = "1s", until = "3s" }]"#;
const PAUSING: &str = r#"babble = [{ from = "1s", until = "3s", gap = "1ms" }]"#;
const STUCK_LOW: &str = r#"stuck = [{ from = "1s", until = "3s", level = "low" }]"#;
const STUCK_HIGH: &str = r#"stuck = [{ from = "1s", until = "3s", level = "high" }]"#;
const DE_SHORTED: &str = r#"de_shorted = [{ from = "1s", until = "3s" }]"#;

#[test]
fn a_babbling_t7() {
    check(&Case { sensor: BABBLING, called: &[BABBLE], deafens: true, ..WELL });
}

#[test]
fn a_t7_that_babbles_with_pauses() {
    // What it says into an answer is garbage, what it sends without a request is babble: the last second decides.
    check(&Case { sensor: PAUSING, called: &[BABBLE, GARBAGE], deafens: true, ..WELL });
}

#[test]
fn a_t7_bus_in_a_continuous_break() {
    check(&Case { segment: STUCK_LOW, called: &[BREAK], ..WELL });
}

#[test]
fn a_t7_bus_stuck_at_its_idle_level() {
    check(&Case { segment: STUCK_HIGH, called: &[MUTE], ..WELL });
}

#[test]
fn a_t7_bus_at_the_wrong_bit_rate() {
    let typed = &[(1_000, "bus t7 -b 57600"), (2_998, "bus t7 -b 115200")];
    check(&Case { typed, called: &[MUTE, GARBAGE], deafens: true, ..WELL });
}

#[test]
fn a_t7_bus_that_the_gateway_never_lets_go_of() {
    check(&Case { segment: DE_SHORTED, called: &[MUTE], deafens: true, ..WELL });
}

#[test]
fn a_t7_bus_at_its_idle_level_where_the_gateway_hears_itself() {
    check(&Case { segment: STUCK_HIGH, hears_itself: true, called: &[CONTENTION], ..WELL });
}

#[test]
fn a_t7_bus_that_the_gateway_never_lets_go_of_where_it_hears_itself() {
    // Its driver fights the answers: what is left of them is garbage. A node that hears that may become deaf and be mute, or speak at
    // the wrong time, into a request.
    let called = &[GARBAGE, MUTE, CONTENTION];
    check(&Case { segment: DE_SHORTED, hears_itself: true, called, deafens: true, ..WELL });
}

#[test]
fn a_babbling_isu() {
    check(&Case { bus: Bus::Isu, sensor: BABBLING, called: &[BABBLE], deafens: true, ..WELL });
}

#[test]
fn an_isu_bus_in_a_continuous_break() {
    check(&Case { bus: Bus::Isu, segment: STUCK_LOW, called: &[BREAK], ..WELL });
}

#[test]
fn an_isu_bus_stuck_at_its_idle_level() {
    check(&Case { bus: Bus::Isu, segment: STUCK_HIGH, called: &[MUTE], ..WELL });
}

#[test]
fn an_isu_bus_that_the_gateway_never_lets_go_of() {
    check(&Case { bus: Bus::Isu, segment: DE_SHORTED, called: &[MUTE], deafens: true, ..WELL });
}

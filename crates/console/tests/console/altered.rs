//! *Altered input*: scripts of valid commands, damaged at random; what is carried out was sent whole.
//!
//! The oracle knows where the damage is, the console does not. *Visible* damage is what a receiver can know of: characters
//! lost in a queue or an overrun, characters with error flags, control characters, bytes that are not ASCII, lines that are too
//! long, pauses. Of it nothing may be carried out that was not sent whole, and everything that was. *Invisible* damage turns
//! printable characters and line ends into others without a trace: what it does is counted without line checks, and must be
//! nothing with them.
//!
//! The daily form is short. `cargo xtask campaign altered` runs a million scripts.

use std::collections::HashMap;
use std::env;
use std::fmt::Write as _;

use clino_bus::{Duration, Instant};
use clino_console::{BusState, BusWork, Host, LONGEST_LINE, Received, Saved, Shell, StorageError};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::Entry;
use clino_gateway::{Bus, Consequence, Detail, Reading, SlotConfig};
use clino_recovery::Start;

use crate::desk::{Desk, Port, Rest};

/// Scripts of each kind in a daily run; `CLINO_SCRIPTS` says how many in a campaign.
const DAILY: u64 = 400;

/// Every command, and every one that writes to a sensor or cannot be undone.
const SCRIPT: [&str; 42] = [
    "list",
    "read 1",
    "show 0",
    "set 0 period 20",
    "set 0 direction reversed",
    "set 1 zero 12.5",
    "set 0 filter mean 5",
    "slot 2 t7 7",
    "slot 3 isu 4 -p 2000",
    "slot 4 pwm 1",
    "slot 5 off",
    "bus t7",
    "bus t7 -b 57600",
    "bus isu --pre 200 --post 100",
    "t7 scan all",
    "t7 info 15",
    "t7 zero 13 --yes",
    "t7 offset 3 --yes -- -500",
    "t7 offset 4 2000 --yes",
    "t7 direction 5 reversed --yes",
    "t7 damping 5 500 --yes",
    "t7 range 5 unidirectional --yes",
    "t7 address 5 61 --yes",
    "t7 baud 5 9600 --yes",
    "isu info 3",
    "isu zero 11 --yes",
    "isu null 3 1000 --yes",
    "isu address 3 14 --yes",
    "isu reset 12",
    "isu repair 10 --yes",
    "cancel",
    "counters 1",
    "help trace",
    "load",
    "modbus address 17",
    "modbus parity none",
    "modbus",
    "save",
    "factory-reset --yes",
    "reboot --yes",
    "reset-cause",
    "help zero",
];

/// A gateway that notes what is asked of it, and changes nothing.
struct Notes {
    rest: Rest,
    noted: String,
    now: Instant,
}

impl Host for Notes {
    fn now(&self) -> Instant {
        self.now
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        self.rest.reading(slot)
    }

    fn config(&self, slot: usize) -> Option<SlotConfig> {
        self.rest.config(slot)
    }

    fn detail(&self, slot: usize) -> Option<Detail> {
        self.rest.detail(slot)
    }

    fn summary(&self) -> clino_gateway::summary::Summary {
        self.rest.summary()
    }

    fn alarm(&self, slot: usize, alarm: clino_gateway::Alarm) -> Option<clino_gateway::AlarmDetail> {
        self.rest.alarm(slot, alarm)
    }

    fn trace(&self, _: usize) -> Option<Entry> {
        None
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        self.rest.bus(bus)
    }

    fn bus_work(&self, bus: Bus) -> Option<BusWork> {
        self.rest.bus_work(bus)
    }

    fn consequence(&self, order: &Order) -> Consequence {
        self.rest.consequence(order)
    }

    fn task_event(&mut self) -> Option<TaskEvent> {
        None
    }

    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal> {
        let named: Vec<_> = (0..=u8::MAX).filter_map(|id| Some((id, named(id)?))).collect();
        write!(self.noted, "{slot}: {named:?} ").expect("memory");
        Ok(())
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        write!(self.noted, "{order:?} ").expect("memory");
        // A person would wait for the end of a task.
        if matches!(order, Order::T7(_) | Order::Isu(_)) { Err(Refusal::Busy) } else { Ok(()) }
    }

    fn flush(&mut self) {}

    fn received(&mut self) -> Option<Received> {
        None
    }

    fn lost_characters(&self) -> u32 {
        0
    }

    fn version(&self) -> &'static str {
        "1.2.3"
    }

    fn start(&self) -> Start {
        self.rest.start()
    }

    fn save(&mut self) -> Result<Saved, StorageError> {
        self.noted += "save ";
        Ok(Saved::Written)
    }

    fn factory_reset(&mut self) -> Result<(), StorageError> {
        self.noted += "factory reset ";
        Ok(())
    }

    fn reboot(&mut self) {
        self.noted += "reboot ";
    }

    fn modbus(&self) -> Option<clino_modbus::Settings> {
        self.rest.modbus()
    }

    fn console(&self) -> ConsoleSettings {
        self.rest.console()
    }

    fn modbus_counters(&self) -> Option<clino_modbus::Counters> {
        None
    }

    fn set_modbus(&mut self, settings: clino_modbus::Settings) {
        write!(self.noted, "{settings:?} ").expect("memory");
    }
}

/// A console, and what each line of the script leads to when nothing is damaged.
struct Bench {
    shell: Shell<'static>,
    port: Port,
    host: Notes,
    is_person: bool,
    known: HashMap<String, usize>,
}

/// What the console has done at a line end.
#[derive(Debug, PartialEq)]
enum Done {
    Nothing,
    /// It has carried out this line of the script.
    Line(usize),
    /// It has said what is wrong, once.
    Error,
    /// It has carried out something else.
    Other(String),
}

impl Bench {
    fn new(person: bool, sent: &[String]) -> Bench {
        let port = Port::default();
        let host = Notes { rest: Desk::new().rest, noted: String::new(), now: Instant::from_millis(10) };
        let shell = Shell::new(Box::leak(Box::new(clino_console::Port::new(port.clone()))));
        let mut bench = Bench { shell, port, host, is_person: person, known: HashMap::new() };
        bench.type_in(if person { "\r" } else { "json on\r" });
        for (number, line) in sent.iter().enumerate() {
            bench.type_in(line);
            let done = bench.type_in("\r");
            assert_ne!(done, "", "{line}");
            // What says that it is refused stands here, too: as long as it is this line that is refused.
            let before = bench.known.insert(done.clone(), number);
            assert_eq!(before, None, "{line} and another lead to {done}");
        }
        bench
    }

    fn type_in(&mut self, text: &str) -> String {
        text.bytes().map(|byte| self.feed(Received::clean(byte))).last().unwrap_or_default()
    }

    /// What is printed and asked for when this character comes.
    fn feed(&mut self, received: Received) -> String {
        self.port.take();
        self.host.noted.clear();
        self.push(received);
        let printed = self.port.take();
        std::mem::take(&mut self.host.noted) + &printed
    }

    /// A character that ends no line: it is shown at most.
    fn push(&mut self, received: Received) {
        self.shell.input(received, &mut self.host);
        if received.is_interrupt() {
            // A bit of a `C` that turns makes Ctrl-C of it, which stops the tasks.
            self.host.noted.clear();
        }
    }

    fn line_end(&mut self, received: Received) -> Done {
        let (noted, printed) = (std::mem::take(&mut self.host.noted), self.port.take());
        if !noted.is_empty() || !self.is_person && !printed.is_empty() {
            return Done::Other(noted + &printed);
        }
        let done = self.feed(received);
        if let Some(&line) = self.known.get(&done) {
            return Done::Line(line);
        }
        let errors = done.matches("{\"error\":").count() + done.matches("error: ").count();
        let rest = done.trim_end_matches("clino> ").trim();
        match (rest.lines().count(), errors) {
            (0, _) => Done::Nothing,
            (1, 1) if rest.starts_with("{\"error\":") || rest.starts_with("error: ") => Done::Error,
            _ => Done::Other(done),
        }
    }
}

/// A character on its way: what is received in the end, and where in the script it was, if it is as it was.
#[derive(Clone, Copy, Debug)]
struct Way {
    received: Received,
    from: Option<(usize, usize)>,
    pause_ms: u32,
}

fn sent(lines: &[String], ends: &[u8]) -> Vec<Way> {
    let whole = |(number, line): (usize, &String)| {
        let bytes: Vec<u8> = line.bytes().chain(ends.iter().copied()).collect();
        let way = move |(place, byte)| Way {
            received: Received::clean(byte),
            from: Some((number, place)),
            pause_ms: 0,
        };
        bytes.into_iter().enumerate().map(way).collect::<Vec<_>>()
    };
    lines.iter().enumerate().flat_map(whole).collect()
}

/// xorshift64*: the same scripts for the same seed.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16
    }

    fn below(&mut self, most: usize) -> usize {
        (self.next() % most as u64) as usize
    }

    fn byte(&mut self, fits: impl Fn(u8) -> bool) -> u8 {
        loop {
            let byte = self.next() as u8;
            if fits(byte) {
                return byte;
            }
        }
    }
}

/// Editing keys of a person, line ends and Ctrl-C are keys, whoever presses them.
fn spoils(byte: u8, person: bool) -> bool {
    const EDITING: &[u8] = b"\x01\x02\x04\x05\x06\x08\t\x0b\x0c\x0e\x10\x15\x17\x1b\x7f";
    let is_key = matches!(byte, b'\r' | b'\n' | 0x03) || person && EDITING.contains(&byte);
    !matches!(byte, b' '..=b'~') && !is_key
}

fn inserted(byte: u8) -> Way {
    Way { received: Received::clean(byte), from: None, pause_ms: 0 }
}

impl Way {
    /// That many characters before it are lost.
    fn lose(&mut self, lost: usize) {
        let before = self.received;
        let lost = (lost + usize::from(before.lost())).min(255) as u8;
        self.received = Received::new(before.byte, before.is_flawed(), lost);
    }
}

/// Damages a script in a way that can be seen.
fn damage_visibly(way: &mut Vec<Way>, person: bool, chance: &mut Chance) {
    let at = chance.below(way.len() - 2);
    let few = 1 + if chance.below(3) == 0 { chance.below(120) } else { chance.below(4) };
    let end = (at + few).min(way.len() - 1);
    match chance.below(9) {
        // The queue was full.
        0 | 1 => {
            let lost: usize = way.drain(at..end).map(|way| 1 + usize::from(way.received.lost())).sum();
            way[at].lose(lost);
        }
        // The receiver has overrun: it knows of one.
        2 => {
            way.drain(at..end);
            if way[at].received.lost() == 0 {
                way[at].lose(1);
            }
        }
        // The receiver complains; what it has sampled may be right.
        3 | 4 => {
            for way in &mut way[at..end.min(at + 3)] {
                let byte = if chance.below(2) == 0 { way.received.byte } else { chance.next() as u8 };
                *way = Way { received: Received::new(byte, true, way.received.lost()), from: None, ..*way };
            }
        }
        // A control character, or one that is not ASCII, too many or instead of another.
        5 | 6 => {
            let byte = chance.byte(|byte| spoils(byte, person));
            if chance.below(2) == 0 {
                way.insert(at, inserted(byte));
            } else {
                way[at].received.byte = byte;
                way[at].from = None;
            }
        }
        // What documents have: a minus sign, quotation marks, a blank that does not break, a byte order mark.
        7 => {
            let text = ["\u{2212}", "\u{201c}", "\u{a0}", "\u{feff}", "\u{2013}"][chance.below(5)];
            way.remove(at);
            for byte in text.bytes().rev() {
                way.insert(at, inserted(byte));
            }
        }
        // Too long.
        _ => {
            for _ in 0..=LONGEST_LINE {
                way.insert(at, inserted(b' '));
            }
        }
    }
}

/// Damages a script so that no receiver notices.
fn damage_invisibly(way: &mut Vec<Way>, chance: &mut Chance) {
    let at = chance.below(way.len() - 2);
    let few = 1 + if chance.below(4) == 0 { chance.below(30) } else { 0 };
    let end = (at + few).min(way.len() - 1);
    match chance.below(6) {
        0 => _ = way.drain(at..end),
        1 => {
            let bit = 1 << chance.below(8);
            let byte = way[at].received.byte ^ bit;
            way[at] = inserted(byte);
        }
        2 => way.insert(at, inserted(way[at].received.byte)),
        3 => way.insert(at, inserted(chance.byte(|byte| matches!(byte, b' '..=b'~' | b'\r')))),
        4 => way.swap(at, at + 1),
        // A digit becomes another: it is what hurts most.
        _ => {
            let digit = way.iter().skip(at).position(|way| way.received.byte.is_ascii_digit());
            if let Some(digit) = digit {
                way[at + digit] = inserted(chance.byte(|byte| byte.is_ascii_digit()));
            }
        }
    }
}

/// What the script has led to.
#[derive(Default)]
struct Outcome {
    carried_out: usize,
    errors: usize,
    /// Carried out, but not sent whole.
    altered: Vec<String>,
    /// Sent whole, but not carried out.
    refused: Vec<String>,
    /// Neither carried out nor answered.
    silent: Vec<String>,
}

/// Sends a script, and compares what is done with what was sent whole.
fn run(bench: &mut Bench, way: &[Way], lines: &[String], (person, traceless): (bool, bool)) -> Outcome {
    let mut outcome = Outcome::default();
    let mut segment: Vec<Way> = Vec::new();
    // A person's session begins with a carriage return.
    let mut returned = person;
    for &way in way {
        bench.host.now = bench.host.now + Duration::from_millis(way.pause_ms);
        let (byte, flawed, lost) = (way.received.byte, way.received.is_flawed(), way.received.lost());
        let after_return = std::mem::take(&mut returned) && lost == 0 && !flawed;
        if flawed || !matches!(byte, b'\r' | b'\n') {
            bench.push(way.received);
            // NUL behind a carriage return belongs to it.
            if !(after_return && byte == 0) {
                segment.push(way);
            }
            continue;
        }
        returned = byte == b'\r';
        let number = segment.first().or(Some(&way)).and_then(|way| way.from).map(|(number, _)| number);
        let places = segment.iter().chain([&way]).map(|way| way.from);
        let is_whole = number
            .is_some_and(|number| places.eq((0..=lines[number].len()).map(|place| Some((number, place)))))
            && segment.iter().chain([&way]).all(|way| way.received.lost() == 0 && !way.received.is_flawed());
        let text = || segment.iter().map(|way| char::from(way.received.byte)).collect::<String>();
        match bench.line_end(way.received) {
            Done::Line(line) if is_whole && number == Some(line) => outcome.carried_out += 1,
            // Damage that leaves no trace may leave a line as it was, too; a check in small letters says the same.
            Done::Line(line) if traceless && same(&text(), &lines[line]) => outcome.carried_out += 1,
            Done::Line(_) | Done::Other(_) => outcome.altered.push(text()),
            Done::Error => {
                outcome.errors += 1;
                if is_whole {
                    outcome.refused.push(text());
                }
            }
            Done::Nothing => {
                let is_blank = segment.iter().all(|way| way.received == Received::clean(b' ')) && lost == 0;
                if !is_blank {
                    outcome.silent.push(text());
                }
            }
        }
        segment.clear();
    }
    // A new session, for the next script.
    bench.feed(Received::clean(0x03));
    if person {
        bench.feed(Received::clean(b'\r'));
    }
    outcome
}

/// Whether two lines say the same.
fn same(one: &str, other: &str) -> bool {
    let [one, other] = [one, other].map(|line| line.split_at(line.rfind('*').unwrap_or(line.len())));
    one.0 == other.0 && one.1.eq_ignore_ascii_case(other.1)
}

fn scripts() -> u64 {
    env::var("CLINO_SCRIPTS").ok().and_then(|number| number.parse().ok()).unwrap_or(DAILY)
}

fn plain() -> Vec<String> {
    SCRIPT.map(String::from).to_vec()
}

fn visibly(person: bool) {
    let lines = plain();
    let mut bench = Bench::new(person, &lines);
    let mut chance = Chance(0xC11_0001 + u64::from(person));
    let mut total = Outcome::default();
    for script in 0..scripts() {
        let ends: [&[u8]; 3] = [b"\r", b"\n", b"\r\n"];
        let mut way = sent(&lines, ends[chance.below(3)]);
        for _ in 0..=chance.below(4) {
            damage_visibly(&mut way, person, &mut chance);
        }
        let outcome = run(&mut bench, &way, &lines, (person, false));
        assert_eq!(outcome.altered, [""; 0], "script {script}: carried out, but not sent whole");
        assert_eq!(outcome.silent, [""; 0], "script {script}: neither carried out nor answered");
        assert_eq!(outcome.refused, [""; 0], "script {script}: sent whole, but refused");
        total.carried_out += outcome.carried_out;
        total.errors += outcome.errors;
    }
    println!(
        "{} scripts, person {person}: {} lines carried out, all of them sent whole; {} refused, one error each",
        scripts(),
        total.carried_out,
        total.errors
    );
    assert!(total.carried_out > 0 && total.errors > 0);
}

#[test]
fn of_a_program_whose_input_is_damaged_visibly_only_whole_lines_are_carried_out() {
    visibly(false);
}

#[test]
fn of_a_person_whose_input_is_damaged_visibly_only_whole_lines_are_carried_out() {
    visibly(true);
}

#[test]
fn a_line_that_is_left_for_long_is_not_gone_on_with() {
    let lines = plain();
    let mut bench = Bench::new(false, &lines);
    let mut chance = Chance(0xC11_0003);
    for script in 0..scripts() {
        let mut way = sent(&lines, b"\r");
        let at = chance.below(way.len());
        way[at].pause_ms = 60_000;
        let outcome = run(&mut bench, &way, &lines, (false, false));
        assert_eq!(outcome.altered, [""; 0], "script {script}");
        let (_, place) = way[at].from.expect("nothing is damaged");
        assert_eq!(outcome.refused.len(), usize::from(place > 0), "script {script}");
    }
}

fn xor(line: &str) -> String {
    format!("{line}*{:02X}", line.bytes().fold(0, |sum, byte| sum ^ byte))
}

/// CRC-16/MODBUS, one bit at a time.
fn crc(line: &str) -> String {
    let crc = line.bytes().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    });
    format!("{line}*{crc:04X}")
}

/// Damages scripts without a trace; how many lines are carried out that were not sent.
fn invisibly(lines: &[String], seed: u64) -> usize {
    let mut bench = Bench::new(false, lines);
    let mut chance = Chance(seed);
    let (mut altered, mut carried_out) = (0, 0);
    for _ in 0..scripts() {
        let mut way = sent(lines, b"\r");
        for _ in 0..=chance.below(4) {
            damage_invisibly(&mut way, &mut chance);
        }
        // The first line agrees on checks, if there are any.
        bench.type_in(&lines[0]);
        bench.type_in("\r");
        let outcome = run(&mut bench, &way, lines, (false, true));
        altered += outcome.altered.len();
        carried_out += outcome.carried_out;
    }
    println!("{} scripts: {carried_out} lines carried out as sent, {altered} altered", scripts());
    altered
}

/// What no receiver can see is carried out: this is why there are line checks.
#[test]
fn damage_that_cannot_be_seen_is_counted() {
    assert!(invisibly(&plain(), 0xC11_0004) > 0);
}

#[test]
fn with_a_line_check_as_nmea_has_it_single_errors_change_nothing() {
    let lines: Vec<String> = SCRIPT.iter().map(|line| xor(line)).collect();
    // Two characters that change places have the same sum, and one in 256 of what several errors make of a line.
    let altered = invisibly(&lines, 0xC11_0005);
    assert!(altered as u64 <= scripts() / 20, "{altered}");
}

#[test]
fn with_a_line_check_of_sixteen_bits_nothing_is_altered() {
    let lines: Vec<String> = SCRIPT.iter().map(|line| crc(line)).collect();
    assert_eq!(invisibly(&lines, 0xC11_0006), 0);
}

#[test]
fn every_single_change_of_a_checked_line_is_refused() {
    let lines: Vec<String> =
        [xor, crc].iter().flat_map(|check| SCRIPT.iter().map(move |line| check(line))).collect();
    let mut bench = Bench::new(false, &plain());
    for line in &lines {
        assert!(bench.feed_line(line), "{line} is right");
        for at in 0..line.len() {
            // Each bit, and what may end a word, a check or a quotation.
            for byte in (0..7).map(|bit| changed_bit(line, at, bit)).chain(*b" *\"-0") {
                let mut changed = line.clone().into_bytes();
                if changed[at] == byte {
                    continue;
                }
                changed[at] = byte;
                let changed = String::from_utf8(changed).expect("ASCII");
                // A check in small letters says the same.
                if !same(&changed, line) {
                    assert!(!bench.feed_line(&changed), "{changed} instead of {line}");
                }
            }
            let mut shorter = line.clone();
            shorter.remove(at);
            assert!(!bench.feed_line(&shorter), "{shorter} instead of {line}");
        }
        bench.feed(Received::clean(0x03));
    }
}

fn changed_bit(line: &str, at: usize, bit: u32) -> u8 {
    Some(line.as_bytes()[at] ^ 1 << bit).filter(|byte| matches!(byte, b' '..=b'~')).unwrap_or(b'x')
}

impl Bench {
    /// Whether a line is carried out.
    fn feed_line(&mut self, line: &str) -> bool {
        self.type_in(line);
        matches!(self.line_end(Received::clean(b'\r')), Done::Line(_) | Done::Other(_))
    }
}

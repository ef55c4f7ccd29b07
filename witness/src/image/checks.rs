//! What is checked: each check a run of the image, or a look at one.

use std::fmt::Display;
use std::path::Path;

use clino_sim::motion::Motion;
use clino_sim::node::Ns;

use super::core::{Order, register};
use super::gateway::{self, Judged};
use super::registers;
use super::run::{MS, Seen, Setting, World, run};

/// Degrees.
const DEGREE: i64 = 1_000_000;

/// What the emulator may complain of, by the beginning of the complaint, and why.
const EXPECTED_COMPLAINTS: [(&str, &str); 0] = [];

/// Bits of `RCC_CSR`: the causes of resets.
const FLAGS: u32 = 0xFE00_0000;

/// One check.
struct Check {
    name: &'static str,
    /// What was wrong.
    wrong: Vec<String>,
}

/// What the checks have shown.
#[derive(Default)]
pub struct Report {
    checks: Vec<Check>,
    figures: Vec<(String, String)>,
}

impl Report {
    fn check(&mut self, name: &'static str, wrong: impl IntoIterator<Item = String>) {
        let wrong: Vec<String> = wrong.into_iter().collect();
        match wrong.as_slice() {
            [] => println!("ok      {name}"),
            wrong => {
                println!("FAILED  {name}");
                wrong.iter().take(10).for_each(|what| println!("          {what}"));
            }
        }
        self.checks.push(Check { name, wrong });
    }

    fn figure(&mut self, name: &str, value: impl Display) {
        println!("figure  {name}: {value}");
        self.figures.push((name.to_owned(), value.to_string()));
    }

    /// The names of the checks that failed.
    pub fn failed(&self) -> Vec<&'static str> {
        self.checks.iter().filter(|check| !check.wrong.is_empty()).map(|check| check.name).collect()
    }

    /// How many checks there were.
    pub fn count(&self) -> usize {
        self.checks.len()
    }
}

/// The image, and what is made of it.
struct Image<'a> {
    elf: &'a Path,
    bytes: &'a [u8],
    /// The address of a branch to itself in it.
    loops: u32,
}

impl Image<'_> {
    fn run(&self, setting: &Setting, world: &World, wanted: &[u64]) -> Result<Seen, String> {
        run(self.elf, self.bytes, setting, world, wanted)
    }
}

/// All checks.
pub fn all(elf: &Path, bytes: &[u8], document: &str) -> Result<Report, String> {
    let loops = branch_to_itself(bytes)?;
    let image = Image { elf, bytes, loops };
    let mut report = Report::default();
    served(&image, document, &mut report)?;
    watchdog(&image, &mut report)?;
    faults(&image, &mut report)?;
    resets(&image, &mut report)?;
    crystal(&image, &mut report)?;
    Ok(report)
}

/// The address of a branch to itself in the code of the image.
fn branch_to_itself(bytes: &[u8]) -> Result<u32, String> {
    use object::read::elf::{ElfFile32, ProgramHeader};
    let file = ElfFile32::<object::Endianness>::parse(bytes).map_err(|error| error.to_string())?;
    let endian = object::Endianness::Little;
    let found = file.elf_program_headers().iter().find_map(|header| {
        let is_code = header.p_flags(endian).0 & object::elf::PF_X.0 != 0;
        let data = header.data(endian, bytes).ok().filter(|_| is_code)?;
        let at = data.chunks_exact(2).position(|half| half == [0xFE, 0xE7])?;
        Some(header.p_paddr(endian) + 2 * at as u32)
    });
    found.ok_or_else(|| "the image has no branch to itself to hang at".to_owned())
}

/// Two seconds with all sensors, some of them moving; a console script and a Modbus master.
fn served(image: &Image<'_>, document: &str, report: &mut Report) -> Result<(), String> {
    const UNTIL: Ns = 2_000 * MS;
    /// From when a person types.
    const TYPED: Ns = 1_300 * MS;
    let setting = Setting { until: UNTIL, motion: moving(), ..Setting::default() };
    let world = World::default();
    let requests: Vec<Ns> = (0..10).map(|number| 300 * MS + number * 160 * MS).collect();
    {
        let mut master = world.modbus.lock().expect("no panic");
        // Angles and ages; a test number first, and a register that does not exist last.
        master.frame(200 * MS, &gateway::request(12, 4));
        requests.iter().for_each(|at| master.frame(*at, &gateway::request(0x20, 96)));
        master.frame(1_950 * MS, &gateway::request(0x7000, 1));
        let mut person = world.console.lock().expect("no panic");
        for (number, line) in
            ["\r", "list\r", "read 0\r", "reset-cause\r", "nonsense\r"].into_iter().enumerate()
        {
            person.line(TYPED + number as u64 * 130 * MS, line);
        }
        // The core's own registers, when all is at rest.
        let mut orders = world.orders.lock().expect("no panic");
        orders.due.extend(registers::CORE.iter().map(|wanted| (1_000 * MS, Order::Look(wanted.address))));
    }
    let wanted: Vec<u64> = registers::wanted(document)?.iter().map(|wanted| wanted.address).collect();
    let seen = image.run(&setting, &world, &wanted)?;

    let unexpected = |complaint: &&String| {
        !EXPECTED_COMPLAINTS.iter().any(|(beginning, _)| complaint.starts_with(beginning))
    };
    report.check(
        "two seconds: nothing that the emulator complains of",
        seen.complaints.iter().filter(unexpected).cloned(),
    );
    report.check("two seconds: no reset", seen.restarts.iter().map(|restart| format!("{restart:?}")));

    let person = world.console.lock().expect("no panic");
    let stream = gateway::judge_stream(&person, &setting.motion, 0);
    report.check("stream: every angle is right", stream.wrong.iter().cloned());
    report.check("stream: angles of every slot", few(&stream, 2));
    for (slot, name) in ["T7", "T7 2", "T7 3", "ISU", "PWM 1", "PWM 2"].into_iter().enumerate() {
        if let (0 | 3 | 4, Some(at)) = (slot, stream.first[slot]) {
            report.figure(&format!("reset to the first angle, {name}"), ms(at));
        }
    }
    let text = person.text();
    let says = |what: &[&str]| {
        let missing = what.iter().filter(|what| !text.contains(**what));
        let mut wrong: Vec<String> = missing.map(|what| format!("no {what:?}")).collect();
        if !wrong.is_empty() {
            wrong.push(format!("it begins {:?}", text.chars().take(300).collect::<String>()));
        }
        wrong
    };
    report.check(
        "console: what a person types is answered",
        says(&[
            "slot  kind  addr",
            "raw_deg ",
            "start: cause power_on, boots 1, crashes 0, mode normal, clock crystal",
            "error: ",
        ]),
    );

    let master = world.modbus.lock().expect("no panic");
    let frames = gateway::frames(&master);
    let mut judged = Judged::default();
    let mut others = Vec::new();
    for (begun, _, frame) in &frames {
        match gateway::registers(frame) {
            Some(words) if words.len() == 96 => {
                gateway::judge_registers(&mut judged, *begun, &words, &setting.motion)
            }
            _ => others.push(frame.clone()),
        }
    }
    report.check("Modbus: every angle is right", judged.wrong.iter().cloned());
    report.check("Modbus: every request is answered", few(&judged, requests.len() as u64));
    // 0x12345678 and 123.456; then exception 02.
    let expected =
        [vec![1, 4, 8, 0x12, 0x34, 0x56, 0x78, 0x42, 0xF6, 0xE9, 0x79], vec![1, 0x84, 2]].map(|mut frame| {
            frame.extend(gateway::crc(&frame).to_le_bytes());
            frame
        });
    report.check(
        "Modbus: test numbers, and a register that does not exist",
        (others != expected).then(|| format!("{others:x?}")),
    );

    for (number, (name, character, reach)) in [
        ("T7", bits(10, 729, 84), 5_000),
        ("ISU", bits(10, 4_375, 42), 5_000),
        ("Modbus", bits(11, 4_375, 84), 5_000),
    ]
    .into_iter()
    .enumerate()
    {
        let line = seen.lines[number].lock().expect("no panic");
        let mut wrong = line.faults.clone();
        // Characters of one frame follow each other at once.
        let shortest = line.characters.iter().min().copied().unwrap_or_default();
        if shortest.abs_diff(character) > 1 {
            wrong.push(format!("a character lasts {shortest} ns, expected {character}"));
        }
        let longest = line.releases.iter().max().copied().unwrap_or(Ns::MAX);
        if longest > reach {
            wrong.push(format!("DE low {longest} ns after the last stop bit"));
        }
        let check =
            ["T7 bus: DE and bit times", "ISU bus: DE and bit times", "Modbus: DE and bit times"][number];
        report.check(check, wrong);
        report.figure(&format!("{name}: a character, ns"), shortest);
        report.figure(&format!("{name}: last stop bit to DE low, ns"), range(&line.releases));
        report.figure(
            &format!("{name}: end of a character to the look at the port, instructions"),
            instructions(&line.notices),
        );
    }

    let orders = world.orders.lock().expect("no panic");
    let wrong = registers::wrong(document, &seen.registers)?
        .into_iter()
        .chain(registers::wrong_of_core(&orders.seen));
    report.check("registers at rest are as docs/registers.md and the manual have them", wrong);
    report.figure("instructions in two seconds", seen.instructions);
    Ok(())
}

/// Motions, slow enough that half a second does not turn them round.
fn moving() -> [Motion; 6] {
    [
        Motion::Sine { centre: 0, amplitude: 30 * DEGREE, period: 4_000 * MS, phase: 0 },
        Motion::Ramp { start: -175 * DEGREE, rate: 20 * DEGREE },
        Motion::Constant(12_345_000),
        Motion::Ramp { start: 350 * DEGREE, rate: 5 * DEGREE },
        Motion::Sine { centre: 180 * DEGREE, amplitude: 45 * DEGREE, period: 3_000 * MS, phase: 0 },
        Motion::Constant(89_560_000),
    ]
}

/// Motions that stand still.
fn still() -> [Motion; 6] {
    [12_345, -45_500, 100_001, 90_000, 180_000, 45_000]
        .map(|thousandths| Motion::Constant(thousandths * 1_000))
}

/// Slots with fewer right readings than `least`.
fn few(judged: &Judged, least: u64) -> Vec<String> {
    let slots = judged.right.iter().enumerate();
    slots.filter(|(_, right)| **right < least).map(|(slot, right)| format!("slot {slot}: {right}")).collect()
}

/// How long `bits` bits of `brr` cycles last at `mhz`, ns.
const fn bits(bits: u64, brr: u64, mhz: u64) -> Ns {
    bits * brr * 1_000 / mhz
}

fn ms(at: Ns) -> String {
    format!("{}.{} ms", at / MS, at % MS / 100_000)
}

fn range(values: &[Ns]) -> String {
    match (values.iter().min(), values.iter().max()) {
        (Some(least), Some(most)) => format!("{least} to {most}"),
        _ => "none".to_owned(),
    }
}

fn instructions(values: &[Ns]) -> String {
    let each = 1_000_000_000 / super::part::INSTRUCTIONS_PER_SECOND;
    range(&values.iter().map(|ns| ns / each).collect::<Vec<_>>())
}

/// A hang: of everything, before and after the watchdog is set; of the main loop alone.
fn watchdog(image: &Image<'_>, report: &mut Report) -> Result<(), String> {
    let hang = |masked: u32| vec![(register::PC, image.loops), (register::PRIMASK, masked)];
    let mut wrong = Vec::new();
    // 1572 counts of 16 cycles from the last feed on, at the slowest, the nominal and the fastest oscillator (DS8626 table 41).
    for lsi_hz in [17_000, 32_000, 47_000] {
        let after = 1_572 * 16 * 1_000_000_000 / lsi_hz;
        let setting =
            Setting { until: 300 * MS + after + 400 * MS, lsi_hz, motion: still(), ..Setting::default() };
        let world = World::default();
        world.orders.lock().expect("no panic").due.push((300 * MS, Order::Set(hang(1))));
        ask(&world, setting.until);
        let seen = image.run(&setting, &world, &[])?;
        let text = world.console.lock().expect("no panic").text();
        if !text.contains("start: cause watchdog") {
            wrong.push(told(&text));
        }
        if lsi_hz == 32_000 {
            let flags =
                seen.causes.iter().find(|(at, _)| *at > 300 * MS).map_or(0, |(_, value)| value & FLAGS);
            report.figure("RCC_CSR after the watchdog", format!("{flags:#010x}"));
        }
        let fed =
            seen.feeds.iter().rev().find(|at| seen.restarts.first().is_some_and(|restart| **at < restart.at));
        match (seen.restarts.as_slice(), fed) {
            ([restart], Some(fed)) if restart.cause == "IWDG" => {
                let lasted = restart.at - fed;
                report
                    .figure(&format!("watchdog after the last feed, LSI {} kHz", lsi_hz / 1_000), ms(lasted));
                // A count and a half: when the oscillator ticks is not known.
                if lasted.abs_diff(after) > 24 * 1_000_000_000 / lsi_hz {
                    wrong.push(format!("LSI {lsi_hz} Hz: {lasted} ns, expected {after}"));
                }
            }
            (restarts, _) => wrong.push(format!("LSI {lsi_hz} Hz: {restarts:?}")),
        }
        let person = world.console.lock().expect("no panic");
        let after = gateway::judge_stream(&person, &setting.motion, 300 * MS + after + 20 * MS);
        wrong.extend(
            few(&after, 1)
                .into_iter()
                .filter(|slot| !slot.starts_with("slot 3"))
                .map(|slot| format!("after the reset {slot}")),
        );
        wrong.extend(after.wrong);
        if !seen.complaints.is_empty() {
            wrong.extend(seen.complaints.clone());
        }
    }
    report.check("watchdog: a hang of everything ends in its time, and angles follow", wrong);

    let mut wrong = Vec::new();
    // 4096 counts of 4 cycles.
    let (lsi_hz, after) = (32_000, 4_096 * 4 * 1_000_000_000 / 32_000);
    let setting = Setting { until: after + 300 * MS, lsi_hz, motion: still(), ..Setting::default() };
    let world = World::default();
    world.orders.lock().expect("no panic").due.push((2_000, Order::Set(hang(1))));
    let seen = image.run(&setting, &world, &[])?;
    match seen.restarts.as_slice() {
        [restart] if restart.cause == "IWDG" => {
            report.figure("watchdog before it is set, LSI 32 kHz", ms(restart.at));
            if restart.at.abs_diff(after) > MS {
                wrong.push(format!("{} ns, expected {after}", restart.at));
            }
        }
        restarts => wrong.push(format!("{restarts:?}")),
    }
    report.check("watchdog: a hang of the start itself ends, too", wrong);

    let mut wrong = Vec::new();
    let (seen, text) = planted(image, hang(0), 1_600 * MS)?;
    match seen.restarts.as_slice() {
        [restart] if restart.cause == "software" && restart.at < 300 * MS + 1_000 * MS => {
            report.figure("a hang of the main loop to the restart", ms(restart.at - 300 * MS));
        }
        restarts => wrong.push(format!("{restarts:?}")),
    }
    if !text.contains("start: cause stalled") {
        wrong.push(told(&text));
    }
    report.check("supervision: a hang of the main loop ends within a second, and is named", wrong);
    Ok(())
}

/// A run with registers set at 300 ms, and what the console says of the last start.
fn planted(image: &Image<'_>, registers: Vec<(usize, u32)>, until: Ns) -> Result<(Seen, String), String> {
    let setting = Setting { until, motion: still(), ..Setting::default() };
    let world = World::default();
    world.orders.lock().expect("no panic").due.push((300 * MS, Order::Set(registers)));
    ask(&world, until);
    let seen = image.run(&setting, &world, &[])?;
    let text = world.console.lock().expect("no panic").text();
    Ok((seen, text))
}

/// Asks for the cause of the start shortly before the end.
fn ask(world: &World, until: Ns) {
    let mut person = world.console.lock().expect("no panic");
    person.line(until - 150 * MS, "\r");
    person.line(until - 120 * MS, "reset-cause\r");
}

/// What the console said of the start.
fn told(text: &str) -> String {
    let lines: Vec<&str> =
        text.lines().filter(|line| line.starts_with("start:") || line.starts_with("crash:")).collect();
    lines.join(" | ")
}

/// Faults that a wild program counter and a ruined stack pointer lead to.
fn faults(image: &Image<'_>, report: &mut Report) -> Result<(), String> {
    // What is planted, and what the crash report says: the cause, CFSR (ARM DDI 0403 B3.2.15: IACCVIOL, IBUSERR, STKERR).
    let cases: [(&str, (usize, u32), [&str; 2]); 4] = [
        (
            "pc in the device region, 0xF0000000",
            (register::PC, 0xF000_0000),
            ["memory_fault", "cfsr 0x00000001"],
        ),
        ("pc in a hole, 0x30000000", (register::PC, 0x3000_0000), ["bus_fault", "cfsr 0x00000100"]),
        (
            "sp below the stack, 0x0FFFFFF0",
            (register::SP, 0x0FFF_FFF0),
            ["stack_overflow", "cfsr 0x00001000"],
        ),
        ("sp in a hole, 0x30000000", (register::SP, 0x3000_0000), ["stack_overflow", "cfsr 0x00001000"]),
    ];
    let mut wrong = Vec::new();
    for (name, register, expected) in cases {
        let (seen, text) = planted(image, vec![register], 500 * MS)?;
        let at_once = |at: Ns| at < 300 * MS + 40 * MS;
        match seen.restarts.as_slice() {
            [restart] if restart.cause == "software" && at_once(restart.at) => {}
            restarts => wrong.push(format!("{name}: {restarts:?}")),
        }
        if !text.contains("mode normal") || expected.iter().any(|what| !told(&text).contains(what)) {
            wrong.push(format!("{name}: {}", told(&text)));
        }
        report.figure(name, told(&text));
    }
    report.check("faults: a wild pc and a ruined sp end in a restart, and are named", wrong);
    Ok(())
}

/// The reset pin, and what the reset controller says of each cause.
fn resets(image: &Image<'_>, report: &mut Report) -> Result<(), String> {
    let mut wrong = Vec::new();
    let setting =
        Setting { until: 800 * MS, motion: still(), pin_resets: vec![300 * MS], ..Setting::default() };
    let world = World::default();
    ask(&world, setting.until);
    let seen = image.run(&setting, &world, &[])?;
    let text = world.console.lock().expect("no panic").text();
    let causes: Vec<u32> = seen.causes.iter().map(|(_, value)| value & FLAGS).collect();
    if seen.restarts.len() != 1 || !text.contains("start: cause pin") {
        wrong.push(format!("{:?} {}", seen.restarts, told(&text)));
    }
    let flags =
        |index: usize| causes.iter().filter(|flags| **flags != 0).nth(index).copied().unwrap_or_default();
    report.figure("RCC_CSR after power-up", format!("{:#010x}", flags(0)));
    let pin = seen.causes.iter().find(|(at, _)| *at > 300 * MS).map_or(0, |(_, value)| value & FLAGS);
    report.figure("RCC_CSR after the reset pin", format!("{pin:#010x}"));

    let setting = Setting { until: 800 * MS, motion: still(), ..Setting::default() };
    let world = World::default();
    world.console.lock().expect("no panic").line(280 * MS, "\r");
    world.console.lock().expect("no panic").line(300 * MS, "reboot --yes\r");
    ask(&world, setting.until);
    let seen = image.run(&setting, &world, &[])?;
    let text = world.console.lock().expect("no panic").text();
    if seen.restarts.len() != 1 || !told(&text).contains("start: cause ") {
        wrong.push(format!("{:?} {}", seen.restarts, told(&text)));
    }
    let software = seen.causes.iter().find(|(at, _)| *at > 300 * MS).map_or(0, |(_, value)| value & FLAGS);
    report.figure("RCC_CSR after a software reset", format!("{software:#010x}"));
    report.figure("the console after a software reset", told(&text));

    // RM0090 section 7.3.21: power-on with brown-out and pin, the pin, software (bit 28).
    for (name, seen, bits) in
        [("power-up", flags(0), 0x0E00_0000), ("pin", pin, 0x0400_0000), ("software", software, 0x1000_0000)]
    {
        if seen & bits != bits {
            wrong.push(format!("RCC_CSR after {name}: {seen:#010x}"));
        }
    }
    report.check("resets: the causes are told apart", wrong);
    Ok(())
}

/// A crystal that does not start, and one that stops.
fn crystal(image: &Image<'_>, report: &mut Report) -> Result<(), String> {
    let mut wrong = Vec::new();
    let setting = Setting { until: 700 * MS, motion: still(), ..Setting::default() };
    let world = World::default();
    world.orders.lock().expect("no panic").crystal_is_dead = true;
    ask(&world, setting.until);
    let seen = image.run(&setting, &world, &[])?;
    let person = world.console.lock().expect("no panic");
    let judged = gateway::judge_stream(&person, &setting.motion, 0);
    wrong.extend(few(&judged, 1));
    wrong.extend(judged.wrong);
    if !person.text().contains("\"clock\":\"internal\"") || !seen.restarts.is_empty() {
        wrong.push(format!("{:?} {}", seen.restarts, told(&person.text())));
    }
    if let Some(at) = judged.first[0] {
        report.figure("reset to the first angle, T7, without the crystal", ms(at));
    }
    drop(person);
    report.check("crystal: dead from the start, angles by the internal oscillator", wrong);

    let mut wrong = Vec::new();
    let setting =
        Setting { until: 1_000 * MS, motion: still(), crystal_stops: Some(400 * MS), ..Setting::default() };
    let world = World::default();
    ask(&world, setting.until);
    let seen = image.run(&setting, &world, &[])?;
    let person = world.console.lock().expect("no panic");
    let judged = gateway::judge_stream(&person, &setting.motion, 420 * MS);
    wrong.extend(few(&judged, 1).into_iter().filter(|slot| !slot.starts_with("slot 3")));
    wrong.extend(judged.wrong);
    match seen.restarts.as_slice() {
        [restart] if restart.cause == "software" && restart.at < 401 * MS => {}
        restarts => wrong.push(format!("{restarts:?}")),
    }
    if !person.text().contains("cause clock_failed") {
        wrong.push(told(&person.text()));
    }
    drop(person);
    report.check("crystal: it stops, and the next start is without it", wrong);
    Ok(())
}

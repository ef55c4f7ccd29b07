//! Power fails at every character time of every operation that writes an ISU's EEPROM: afterwards a repair brings every
//! module back, the manufacturer's bits are what they were, and the operation succeeds.

mod common;

use clino_bus::{Duration, Instant, Isu};
use clino_codec::isu::eeprom::{Change, ShutoffBit};
use clino_commissioning::SingleDevice;
use clino_commissioning::isu::{Module, Program, Repair, ResetNull};
use clino_segment::log::{LineEvent, Talker};
use clino_sim::isu::{Adoption, ChecksumScope, Eeprom, Mode, Options, Supervision};
use clino_sim::node::Ns;
use clino_testkit::rig::Bench;
use common::isu::{
    SCOPES, Shared, address, assert_upper_bits, bench, eeprom, module, options, unplugged, with, words,
};
use common::{MS, SECOND, idle_for, run};

/// Ten bits at 9600 bit/s.
const CHARACTER: Ns = 10 * SECOND / 9_600;

/// Without power for a moment: it comes back while the operation runs.
const SHORT: Ns = 20 * MS;

/// Without power until every operation has given up.
const LONG: Ns = 15 * SECOND;

/// A task for the module at an address, and whether an EEPROM shows that it is done.
struct Task {
    name: &'static str,
    /// Leads the operation to its end; whether it says that all is well, and whether it says that a repair is needed.
    lead: fn(&mut Bench<Isu>, Module) -> Result<(), bool>,
    repair: fn(Module) -> Repair,
    is_done: fn(&Eeprom) -> bool,
}

const FROM: u8 = 5;
const TO: u8 = 10;

fn program(bench: &mut Bench<Isu>, module: Module, change: Change) -> Result<(), bool> {
    let operation = Program::new(module, change).unwrap();
    run(bench, operation).result.map(|_| ()).map_err(|failure| failure.repair)
}

const TASKS: [Task; 4] = [
    Task {
        name: "address",
        lead: |bench, module| program(bench, module, Change::ModuleAddress(address(TO))),
        repair: |from| Repair::after_address_change(from, module(TO)),
        is_done: |eeprom| eeprom.address() == TO,
    },
    Task {
        name: "null position",
        lead: |bench, module| program(bench, module, Change::NullPosition(0x6C5A)),
        repair: Repair::new,
        is_done: |eeprom| eeprom.null() == 0x6C5A,
    },
    Task {
        name: "auto-shutoff",
        lead: |bench, module| {
            program(bench, module, Change::AutoShutoff { bit: ShutoffBit::Bit0, enabled: true })
        },
        repair: Repair::new,
        is_done: |eeprom| eeprom.data(0x50) & 1 == 1,
    },
    Task {
        name: "null reset",
        lead: |bench, module| {
            run(bench, ResetNull::new(module)).result.map(|_| ()).map_err(|failure| failure.repair)
        },
        repair: Repair::new,
        is_done: |eeprom| eeprom.null() != 0,
    },
];

#[derive(Debug, Default)]
struct Tally {
    cuts: u32,
    /// The operation recovered without help.
    done: u32,
    repaired: u32,
}

/// One cut, and everything that follows.
fn cut(task: &Task, scope: ChecksumScope, options: &Options, at: Ns, off: Ns, tally: &mut Tally) {
    let sensor = with(FROM, scope, options.clone());
    let before = words(&sensor);
    let mut bench = unplugged::<Isu>(&sensor, vec![(at, at + off)]);
    let result = (task.lead)(&mut bench, module(FROM));
    let how = || format!("{}, cut at {at} for {off}", task.name);
    tally.cuts += 1;
    assert_upper_bits(&before, &words(&sensor));
    if result.is_ok() {
        tally.done += 1;
        assert!((task.is_done)(&eeprom(&sensor)) && eeprom(&sensor).is_sound(), "{}", how());
    }
    // Power is back, and the module up.
    let back = Instant::from_micros((at + off) / 1_000 + 1_000_000);
    let now = bench.port.now();
    idle_for(&mut bench, back.since(now));
    if !eeprom(&sensor).is_sound() || sensor.lock().unwrap().mode() != Mode::Normal {
        assert!(eeprom(&sensor).is_sound() || result == Err(true), "{}: {result:?}", how());
        tally.repaired += 1;
        let repaired = run(&mut bench, (task.repair)(module(FROM)));
        repaired.result.unwrap_or_else(|failure| panic!("{}: {failure}", how()));
    }
    assert_well(&sensor, &how());
    assert_upper_bits(&before, &words(&sensor));
    // Where it is now, the operation succeeds.
    let stored = eeprom(&sensor).address();
    (task.lead)(&mut bench, module(stored)).unwrap_or_else(|_| panic!("{}", how()));
    assert!((task.is_done)(&eeprom(&sensor)), "{}", how());
    assert_well(&sensor, &how());
    assert_upper_bits(&before, &words(&sensor));
}

fn assert_well(sensor: &Shared, how: &str) {
    assert!(eeprom(sensor).is_sound(), "{how}");
    assert_eq!(sensor.lock().unwrap().mode(), Mode::Normal, "{how}");
}

/// When the operation begins to write, and when it ends, undisturbed.
fn times(task: &Task, scope: ChecksumScope, options: &Options) -> (Ns, Ns) {
    let sensor = with(FROM, scope, options.clone());
    let mut bench = bench::<Isu>(&[&sensor]);
    (task.lead)(&mut bench, module(FROM)).unwrap();
    (first_write(&bench), bench.port.now().as_micros() * 1_000)
}

/// Beginning of the first command that writes: Write EEPROM, function 5, or Reset Null Position, function 6.
fn first_write(bench: &Bench<Isu>) -> Ns {
    let log = bench.port.log();
    let log = log.lock().unwrap();
    let mut sent = log.events.iter().filter_map(|event| match event {
        LineEvent::Char { who: Talker::Gateway, start, word, .. } => Some((*start, *word)),
        _ => None,
    });
    // Length, address and function, the rest and a checksum.
    while let Some(((start, length), (_, head))) = sent.next().zip(sent.next()) {
        if matches!(head >> 1 & 7, 5 | 6) {
            return start;
        }
        assert!(sent.by_ref().take(usize::from(length)).count() == usize::from(length));
    }
    panic!("nothing was written")
}

/// How densely a campaign cuts, in characters.
#[derive(Clone, Copy)]
struct Density {
    /// Before the first write, where nothing can be torn.
    reading: usize,
    /// From there on.
    writing: usize,
    /// Every cut once for a moment and once for long, or in turn.
    both: bool,
}

/// Every exchange of the reading, 41 characters, is hit four times, and every character from the first write on.
const USUAL: Density = Density { reading: 10, writing: 1, both: false };

fn campaign(task: &Task, scope: ChecksumScope, options: &Options, density: Density) {
    let mut tally = Tally::default();
    let (write, end) = times(task, scope, options);
    let early = (0..write).step_by(CHARACTER as usize * density.reading);
    let late = (write..end).step_by(CHARACTER as usize * density.writing);
    for (number, at) in early.chain(late).enumerate() {
        if density.both || number % 2 == 0 {
            cut(task, scope, options, at, SHORT, &mut tally);
        }
        if density.both || number % 2 == 1 {
            cut(task, scope, options, at, LONG, &mut tally);
        }
    }
    println!("{}, {scope:?}, writes from {} to {} ms: {tally:?}", task.name, write / MS, end / MS);
    assert!(tally.repaired > 0, "no cut hit the writes");
}

#[test]
fn address_change() {
    for (scope, adoption) in SCOPES.into_iter().zip([Adoption::AtOnce, Adoption::AfterReset]) {
        campaign(&TASKS[0], scope, &Options { adoption, ..options() }, USUAL);
    }
}

#[test]
fn null_position() {
    campaign(&TASKS[1], SCOPES[0], &options(), USUAL);
}

#[test]
fn auto_shutoff() {
    campaign(&TASKS[2], SCOPES[1], &options(), USUAL);
}

#[test]
fn null_reset() {
    for scope in SCOPES {
        campaign(&TASKS[3], scope, &options(), USUAL);
    }
}

#[test]
fn a_module_that_watches_itself_all_the_time() {
    let watchful = Options { supervision: Supervision::Continuous, phase: 200 * MS, ..options() };
    for task in &TASKS[..3] {
        campaign(task, SCOPES[0], &watchful, Density { reading: 70, writing: 7, both: true });
    }
}

#[test]
#[ignore = "campaign of a minute or two: all operations, both checksums, both kinds of adoption, from the first character"]
fn every_character_of_every_operation() {
    for scope in SCOPES {
        for task in &TASKS {
            for adoption in [Adoption::AtOnce, Adoption::AfterReset] {
                campaign(
                    task,
                    scope,
                    &Options { adoption, ..options() },
                    Density { reading: 1, writing: 1, both: true },
                );
            }
        }
        for off in [SHORT, LONG] {
            repair_cut_everywhere(scope, off, 1);
        }
    }
}

/// The repair itself is cut.
#[test]
fn repair() {
    for (scope, off) in SCOPES.into_iter().zip([SHORT, LONG]) {
        repair_cut_everywhere(scope, off, 3);
    }
}

fn repair_cut_everywhere(scope: ChecksumScope, off: Ns, step: usize) {
    let make = || {
        let sensor = with(FROM, scope, options());
        // As an address change leaves it that was cut between its two writes.
        let mut node = sensor.lock().unwrap();
        for (word, mask) in [(0x48, 0b11), (0x49, 0b11)] {
            let old = node.eeprom.word(word);
            node.eeprom.set_word(word, old ^ mask);
        }
        drop(node);
        sensor
    };
    let cut_at = |at: Ns, off: Ns| {
        let sensor = make();
        let before = words(&sensor);
        // Off for the first 10 ms, so that it comes up in its Hard Error state.
        let mut bench = unplugged::<Isu>(&sensor, vec![(0, 10 * MS), (at, at + off)]);
        idle_for(&mut bench, Duration::from_micros(100_000));
        let repair = || Repair::after_address_change(module(FROM), module(TO));
        let first = run(&mut bench, repair());
        let back = Instant::from_micros((at + off) / 1_000 + 1_000_000);
        let now = bench.port.now();
        idle_for(&mut bench, back.since(now));
        let again = run(&mut bench, repair());
        assert!(again.result.is_ok(), "{at}, {off}: {:?}, then {:?}", first.result, again.result);
        assert_well(&sensor, "repaired");
        assert_upper_bits(&before, &words(&sensor));
        u64::from(first.took.as_micros()) * 1_000
    };
    let end = 100 * MS + cut_at(3_600 * SECOND, 0);
    let cuts: Vec<Ns> = (100 * MS..end).step_by(CHARACTER as usize * step).collect();
    for &at in &cuts {
        cut_at(at, off);
    }
    println!("repair, {scope:?}, {} ms, off for {} ms: {} cuts", end / MS, off / MS, cuts.len());
}

/// Cut between its two words, an address change can leave an address that only a lone module can be reached at.
#[test]
fn a_third_address_that_no_module_may_have() {
    // From 3 (0011) to 12 (1100): 1111. From 12 to 3: 0000.
    for (from, to, mixed) in [(3, 12, 15), (12, 3, 0)] {
        let change = |at: Module| Program::new(at, Change::ModuleAddress(address(to))).unwrap();
        // Eight characters of the command, then 10 ms for each of the two words: between them at about 23 ms.
        let mut undisturbed = bench::<Isu>(&[&with(from, SCOPES[0], options())]);
        run(&mut undisturbed, change(module(from))).result.unwrap();
        let write = first_write(&undisturbed);
        let mut reached = false;
        for at in (write..write + 40 * MS).step_by(MS as usize) {
            let sensor = with(from, SCOPES[0], options());
            let before = words(&sensor);
            let mut bench = unplugged::<Isu>(&sensor, vec![(at, at + LONG)]);
            let result = run(&mut bench, change(module(from))).result;
            if eeprom(&sensor).address() != mixed {
                continue;
            }
            reached = true;
            assert!(result.unwrap_err().repair);
            let back = Instant::from_micros((at + LONG) / 1_000 + 1_000_000);
            let now = bench.port.now();
            idle_for(&mut bench, back.since(now));
            let single = Module::single(SingleDevice::i_have_attached_one_sensor_only());
            let repaired = run(&mut bench, Repair::new(single)).result.unwrap();
            assert_eq!(repaired.stored_address.get(), mixed);
            run(&mut bench, change(single)).result.unwrap();
            assert_eq!(eeprom(&sensor).address(), to);
            assert_well(&sensor, "changed");
            assert_upper_bits(&before, &words(&sensor));
        }
        assert!(reached, "no cut hit between the words of {from} to {to}");
    }
}

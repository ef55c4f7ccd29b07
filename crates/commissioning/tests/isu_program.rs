//! Changing address, null position and auto-shutoff of an ISU; repairing one.

mod common;

use std::sync::Arc;

use clino_bus::{Instant, Isu};
use clino_codec::isu::Address;
use clino_codec::isu::eeprom::{Change as Eeprom, ChecksumReading, ShutoffBit};
use clino_commissioning::isu::{Cause, Module, Program, Repair, ResetNull};
use clino_commissioning::{SettingChange, SingleDevice};
use clino_segment::chance::Chance;
use clino_segment::{Faults, Noise, Probability, Station};
use clino_sim::isu::{Adoption, ChecksumScope, Mode, Options, Supervision};
use clino_sim::node::{Burst, Heard, Node, Ns};
use clino_testkit::rig::Bench;
use common::isu::{
    SCOPES, Shared, address, assert_upper_bits, at, bench, eeprom, module, options, spoilt, with, words,
};
use common::spoil::{Fault, Spoil};
use common::{MS, idle_for, run, run_and};

fn single() -> Module {
    Module::single(SingleDevice::i_have_attached_one_sensor_only())
}

fn to(number: u8) -> Eeprom {
    Eeprom::ModuleAddress(address(number))
}

fn change(from: u8, wanted: Eeprom) -> Program {
    Program::new(module(from), wanted).unwrap()
}

fn mode(sensor: &Shared) -> Mode {
    sensor.lock().unwrap().mode()
}

/// Spoils words and cycles the power.
fn spoil_words(sensor: &Shared, spoilt: &[(u8, u16)]) {
    let mut node = sensor.lock().unwrap();
    for &(word, mask) in spoilt {
        let old = node.eeprom.word(word);
        node.eeprom.set_word(word, old ^ mask);
    }
    node.power_off(0);
    node.power_on(0);
    let ready = node.next_event().unwrap();
    let _ = node.act(ready);
}

#[test]
fn an_address_change_whenever_it_acts_and_however_it_is_supervised() {
    for scope in SCOPES {
        for adoption in [Adoption::AtOnce, Adoption::AfterReset] {
            for supervision in [Supervision::AtReset, Supervision::Continuous] {
                for phase in [0, 100 * MS, 300 * MS, 500 * MS] {
                    let sensor = with(5, scope, Options { adoption, supervision, phase, ..options() });
                    let before = words(&sensor);
                    let mut bench = bench::<Isu>(&[&sensor]);
                    let report = run(&mut bench, change(5, to(10))).result.unwrap();
                    // One that noticed in the middle refused the second write once.
                    let refused = u8::from(supervision == Supervision::Continuous);
                    assert!((2..=2 + refused).contains(&report.writes), "{report:?}");
                    assert_eq!(report.change, SettingChange::Changed { from: to(5), to: to(10) });
                    let stored = eeprom(&sensor);
                    assert_eq!((stored.address(), stored.is_sound()), (10, true));
                    assert_upper_bits(&before, &words(&sensor));
                    assert_eq!((mode(&sensor), sensor.lock().unwrap().address()), (Mode::Normal, 10));
                    // Nothing but the address and the checksum has changed.
                    let changed = (0..=255_u8).filter(|&i| before[usize::from(i)] != stored.word(i));
                    assert!(changed.clone().all(|i| matches!(i, 0x48 | 0x49 | 0x78..=0x7F)), "{changed:?}");
                }
            }
        }
    }
}

/// From 3 to 9 one word grows by what the other shrinks: the sum stays.
#[test]
fn a_checksum_that_stays_right_is_not_written() {
    let sensor = at(3);
    let mut bench = bench::<Isu>(&[&sensor]);
    assert_eq!(run(&mut bench, change(3, to(9))).result.unwrap().writes, 1);
    assert_eq!((eeprom(&sensor).address(), eeprom(&sensor).is_sound()), (9, true));
}

#[test]
fn the_factory_address_is_left_only_alone() {
    let sensor = at(0);
    let mut bench = bench::<Isu>(&[&sensor]);
    let report = run(&mut bench, Program::new(single(), to(14)).unwrap()).result.unwrap();
    assert_eq!(report.change, SettingChange::Changed { from: to(0), to: to(14) });
    assert_eq!(eeprom(&sensor).address(), 14);
    // And back.
    run(&mut bench, Program::new(single(), to(0)).unwrap()).result.unwrap();
    assert_eq!(eeprom(&sensor).address(), 0);
    assert_eq!(Program::new(module(3), to(0)).unwrap_err(), Cause::ZeroOnSharedLine);
    let reserved = Eeprom::ModuleAddress(Address::RESERVED);
    assert_eq!(Program::new(single(), reserved).unwrap_err(), Cause::ReservedAddress);
}

#[test]
fn null_position_and_auto_shutoff() {
    for scope in SCOPES {
        let sensor = with(3, scope, options());
        let before = words(&sensor);
        let mut bench = bench::<Isu>(&[&sensor]);
        run(&mut bench, change(3, Eeprom::NullPosition(0x1234))).result.unwrap();
        assert_eq!(eeprom(&sensor).null(), 0x1234);
        for (bit, mask) in [(ShutoffBit::Bit0, 1), (ShutoffBit::Bit1, 2), (ShutoffBit::Bit7, 0x80)] {
            let data = eeprom(&sensor).data(0x50);
            let enabled = data & mask == 0;
            let wanted = Eeprom::AutoShutoff { bit, enabled };
            let report = run(&mut bench, change(3, wanted)).result.unwrap();
            assert_eq!(
                report.change,
                SettingChange::Changed { from: Eeprom::AutoShutoff { bit, enabled: !enabled }, to: wanted }
            );
            assert_eq!(eeprom(&sensor).data(0x50), data ^ mask);
        }
        assert!(eeprom(&sensor).is_sound());
        assert_upper_bits(&before, &words(&sensor));
    }
}

#[test]
fn what_is_so_already_is_not_written_and_the_module_not_reset() {
    let sensor = at(3);
    let mut bench = bench::<Isu>(&[&sensor]);
    for wanted in [to(3), Eeprom::NullPosition(0)] {
        let run = run(&mut bench, change(3, wanted));
        let report = run.result.unwrap();
        assert_eq!((report.change, report.writes), (SettingChange::Unchanged(wanted), 0));
        assert_eq!(run.requests, 16);
    }
}

#[test]
fn an_address_that_is_taken_is_refused() {
    let (one, other) = (at(5), at(10));
    let mut bench = bench::<Isu>(&[&one, &other]);
    let failure = run(&mut bench, change(5, to(10))).result.unwrap_err();
    assert_eq!((failure.cause, failure.writes), (Cause::AddressTaken { address: address(10) }, 0));
    assert_eq!((eeprom(&one).address(), eeprom(&other).address()), (5, 10));
}

#[test]
fn a_bad_image_is_refused_with_what_is_wrong_and_nothing_is_written() {
    for scope in SCOPES {
        let sensor = with(5, scope, options());
        spoil_words(&sensor, &[(0x10, 0x0100)]);
        let before = words(&sensor);
        let mut bench = bench::<Isu>(&[&sensor]);
        let failure = run(&mut bench, change(5, to(10))).result.unwrap_err();
        let Cause::Unsound(audit) = failure.cause else { panic!("{failure}") };
        assert_eq!(audit.stored, eeprom(&sensor).data(0x78));
        let computed = match scope {
            ChecksumScope::UpperBitsCounted => audit.upper_bits_counted,
            ChecksumScope::WordsLeftOut => audit.words_left_out,
        };
        assert_eq!(computed, eeprom(&sensor).computed_checksum());
        assert_eq!((failure.writes, words(&sensor)), (0, before));
    }
}

#[test]
fn two_modules_at_one_address_are_an_error_and_neither_is_written() {
    let one = at(5);
    let other = with(
        5,
        ChecksumScope::WordsLeftOut,
        Options { motion: clino_sim::motion::Motion::Constant(1), ..options() },
    );
    let before = (words(&one), words(&other));
    let mut bench = bench::<Isu>(&[&one, &other]);
    let failure = run(&mut bench, change(5, to(10))).result.unwrap_err();
    assert!(matches!(failure.cause, Cause::NoAnswer { .. } | Cause::Unsound(_)), "{failure}");
    assert_eq!((words(&one), words(&other)), before);
}

#[test]
fn any_fault_of_any_answer() {
    // Three silences at the new address, 16 chunks, two writes with readings before and after, reset, verification.
    let faults = [
        Fault::Lost,
        Fault::Twice,
        Fault::Late(30 * MS),
        Fault::Late(500 * MS),
        Fault::Cut(3),
        Fault::Byte { index: 0, mask: 0x01 },
        Fault::Byte { index: 1, mask: 0x20 },
        Fault::Byte { index: 4, mask: 0x01 },
        Fault::Byte { index: 9, mask: 0x80 },
    ];
    let (mut done, mut failed) = (0, 0);
    for answer in 0..26 {
        for fault in faults {
            for spoil in [Spoil::Answer(answer, fault), Spoil::AnswersFrom(answer, fault)] {
                let sensor = at(5);
                let before = words(&sensor);
                let mut bench = spoilt::<Isu>(&sensor, spoil);
                let result = run(&mut bench, change(5, to(10))).result;
                assert_upper_bits(&before, &words(&sensor));
                let stored = eeprom(&sensor);
                match result {
                    Ok(_) => {
                        done += 1;
                        assert_eq!((stored.address(), stored.is_sound()), (10, true), "{spoil:?}");
                    }
                    Err(failure) => {
                        failed += 1;
                        assert!(!matches!(spoil, Spoil::Answer(..)), "{spoil:?}: {failure}");
                        assert!(matches!(stored.address(), 5 | 10), "{spoil:?}");
                        // It does not leave a wrong checksum without saying so.
                        assert!(stored.is_sound() || failure.repair, "{spoil:?}: {failure}");
                    }
                }
            }
        }
    }
    println!("{done} done, {failed} failed with a typed error");
}

#[test]
fn any_damage_to_any_character_of_a_command() {
    // Probes and reading: 19 commands of 5 characters; then all of the rest.
    for heard in (0..95).step_by(7).chain(95..180) {
        for mask in [0x01, 0x80] {
            let sensor = at(5);
            let before = words(&sensor);
            let mut bench = spoilt::<Isu>(&sensor, Spoil::Heard(heard, mask));
            let result = run(&mut bench, change(5, to(10))).result;
            assert_upper_bits(&before, &words(&sensor));
            assert!(result.is_ok(), "{heard}, {mask:02X}: {result:?}");
            assert_eq!((eeprom(&sensor).address(), eeprom(&sensor).is_sound()), (10, true));
        }
    }
}

/// Noise on both receivers. What is damaged several times over can pass an 8-bit sum, in either direction; what was
/// written is read back, and what is to be written was read twice.
#[test]
fn noise_of_any_strength() {
    let (mut done, mut failed, mut repaired) = (0, 0, 0);
    for seed in 0..300_u32 {
        let errors = f64::from(seed) * 1e-5;
        let sensor = at(5);
        let before = words(&sensor);
        let mut settings = common::quiet();
        settings.chance = Chance::new(u64::from(seed));
        let within = Some((0, 40_000 * MS));
        settings.noise = Noise { bit_errors: Probability::new(errors).unwrap(), within, ..Noise::default() };
        let station = common::isu::station(&sensor, Spoil::Nothing, Vec::new());
        let mut bench = common::isu::on_line::<Isu>(settings, vec![station]);
        let result = run(&mut bench, change(5, to(10))).result;
        assert_upper_bits(&before, &words(&sensor));
        let stored = eeprom(&sensor);
        match result {
            Ok(_) => {
                done += 1;
                assert_eq!((stored.address(), stored.is_sound()), (10, true), "seed {seed}");
                continue;
            }
            Err(failure) => assert!(stored.is_sound() || failure.repair, "seed {seed}: {failure}"),
        }
        failed += 1;
        // On a quiet line a repair sets right what is wrong, if anything is.
        repaired += u32::from(!stored.is_sound());
        let now = bench.port.now();
        idle_for(&mut bench, Instant::from_micros(41_000_000).since(now));
        run(&mut bench, Repair::after_address_change(module(5), module(10))).result.unwrap();
        assert_eq!((eeprom(&sensor).is_sound(), mode(&sensor)), (true, Mode::Normal), "seed {seed}");
        assert_upper_bits(&before, &words(&sensor));
    }
    println!("{done} done, {failed} failed, {repaired} of them repaired");
    assert!(done > 100 && failed > 10);
}

#[test]
fn a_cancel_never_leaves_a_wrong_checksum() {
    let mut ends = [0; 2];
    for after in 0..28 {
        let sensor = at(5);
        let mut bench = bench::<Isu>(&[&sensor]);
        let run = run_and(&mut bench, change(5, to(10)), |runner, requests| {
            if requests == after {
                runner.cancel();
            }
        });
        let stored = eeprom(&sensor);
        assert!(stored.is_sound(), "after {after}");
        match run.result {
            Ok(_) => assert_eq!(stored.address(), 10),
            Err(failure) => {
                assert_eq!((failure.cause, failure.writes, failure.repair), (Cause::Cancelled, 0, false));
                assert_eq!(stored.address(), 5);
            }
        }
        ends[usize::from(stored.address() == 10)] += 1;
    }
    assert!(ends.iter().all(|&n| n > 3), "{ends:?}");
}

#[test]
fn repair_finds_out_what_the_checksum_covers() {
    for (scope, reading) in
        SCOPES.into_iter().zip([ChecksumReading::UpperBitsCounted, ChecksumReading::WordsLeftOut])
    {
        for knows in [false, true] {
            let sensor = with(3, scope, options());
            spoil_words(&sensor, &[(0xD1, 0b11)]);
            assert_eq!(mode(&sensor), Mode::HardError);
            let before = words(&sensor);
            let mut bench = bench::<Isu>(&[&sensor]);
            let repair = Repair::new(module(3));
            let repair = if knows { repair.knowing(reading) } else { repair };
            let repaired = run(&mut bench, repair).result.unwrap();
            assert_eq!(repaired.reading, Some(reading));
            assert_eq!(repaired.stored_address, address(3));
            let guesses = if knows || reading == ChecksumReading::UpperBitsCounted { 1 } else { 2 };
            assert_eq!(repaired.writes, guesses, "{scope:?}, knows {knows}");
            assert_eq!(mode(&sensor), Mode::Normal);
            assert_upper_bits(&before, &words(&sensor));
            // Nothing but the checksum.
            let same = |i: usize| before[i] == words(&sensor)[i];
            assert!((0..256).filter(|&i| !same(i)).all(|i| (0x78..0x80).contains(&i)));
        }
    }
}

#[test]
fn repair_of_a_healthy_module_writes_nothing() {
    let sensor = at(3);
    let before = words(&sensor);
    let mut bench = bench::<Isu>(&[&sensor]);
    let repaired = run(&mut bench, Repair::new(module(3))).result.unwrap();
    assert_eq!((repaired.reading, repaired.writes), (None, 0));
    assert_eq!((words(&sensor), mode(&sensor)), (before, Mode::Normal));
}

#[test]
fn repair_looks_at_the_third_address_of_an_interrupted_change() {
    // From 3 (0011) to 9 (1001), cut between the two words: 1011.
    let sensor = at(3);
    spoil_words(&sensor, &[(0x48, 0b10)]);
    assert_eq!(sensor.lock().unwrap().address(), 11);
    let healthy = at(9);
    let others = words(&healthy);
    let mut bench = bench::<Isu>(&[&sensor, &healthy]);
    let repaired = run(&mut bench, Repair::after_address_change(module(3), module(9))).result.unwrap();
    assert_eq!((repaired.at, repaired.stored_address), (address(11), address(11)));
    assert_eq!(mode(&sensor), Mode::Normal);
    assert_eq!(words(&healthy), others);
}

/// A null reset that the module noticed in the middle: its checksum is right in the end, a reset is all it takes.
#[test]
fn repair_of_a_module_that_only_needs_a_reset() {
    let watched = |phase: u64| {
        let watchful = Options { supervision: Supervision::Continuous, phase: phase * MS, ..options() };
        let sensor = with(3, ChecksumScope::default(), watchful);
        let mut bench = bench::<Isu>(&[&sensor]);
        let failure = run(&mut bench, ResetNull::new(module(3))).result.err()?;
        assert_eq!((failure.cause, failure.repair), (Cause::HardError, true));
        Some((sensor, bench))
    };
    let (sensor, mut bench) =
        (0..533).step_by(5).find_map(watched).expect("it looks in the middle of a write in some phase");
    assert!(eeprom(&sensor).is_sound());
    let repaired = run(&mut bench, Repair::new(module(3))).result.unwrap();
    assert_eq!((repaired.reading, repaired.writes), (None, 0));
    assert_eq!((mode(&sensor), eeprom(&sensor).null()), (Mode::Normal, 7_282));
}

/// In error although the checksum is right in the one reading: it may be the other; if not, it is put back.
#[test]
fn repair_that_does_not_help_leaves_the_checksum_as_it_was() {
    let sensor = at(3);
    let before = words(&sensor);
    // Answers everything but Go To Soft Error State, reading and writing of the EEPROM as if it were in error.
    let mut bench = always_in_error(&sensor);
    let failure = run(&mut bench, Repair::new(module(3))).result.unwrap_err();
    let Cause::NotTheChecksum(audit) = failure.cause else { panic!("{failure}") };
    assert_eq!(audit.only_reading(), Some(ChecksumReading::UpperBitsCounted));
    assert_eq!((failure.writes, failure.repair), (2, false));
    assert_eq!(words(&sensor), before);
}

/// A module whose sensor is broken: reading the angle is answered with the hardware error message.
fn always_in_error(sensor: &Shared) -> Bench<Isu> {
    let node = BrokenSensor { node: Arc::clone(sensor), heard: Vec::new() };
    let station = Station { name: "isu".to_owned(), node: Box::new(node), faults: Faults::default() };
    common::isu::on_line(common::quiet(), vec![station])
}

struct BrokenSensor {
    node: Shared,
    heard: Vec<u8>,
}

impl Node for BrokenSensor {
    fn baud(&self) -> u32 {
        self.node.baud()
    }

    fn hear(&mut self, heard: Heard) {
        self.heard.push(heard.byte);
        self.node.hear(heard);
    }

    fn next_event(&self) -> Option<Ns> {
        self.node.next_event()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        let mut burst = self.node.act(now)?;
        // Read RAM 58, 2 bytes, at address 3.
        if self.heard.ends_with(&[0x03, 0x34, 0x58, 0x02, 0x8E]) {
            burst.bytes = vec![0x02, 0xF1, 0x34, 0x25];
        }
        Some(burst)
    }

    fn power_off(&mut self, now: Ns) {
        self.node.power_off(now);
    }

    fn power_on(&mut self, now: Ns) {
        self.node.power_on(now);
    }
}

#[test]
fn repair_without_a_module_is_not_found() {
    let mut bench = bench::<Isu>(&[]);
    let failure = run(&mut bench, Repair::after_address_change(module(3), module(9))).result.unwrap_err();
    assert!(matches!(failure.cause, Cause::NotFound { .. }), "{failure}");
}

//! ISU operations that do not program the EEPROM.

mod common;

use clino_bus::{Duration, Isu};
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Data, EncodeError, Function, Request, Words};
use clino_commissioning::SingleDevice;
use clino_commissioning::isu::raw::{RawRefusal, RawWrite, UnprotectedIsu};
use clino_commissioning::isu::{Cause, Fault, GoToSoftError, Identify, Module, ReadAngle, Reset, ResetNull};
use clino_sim::isu::{Mode, Options};
use common::isu::{address, at, bench, eeprom, module, options, spoilt, with, words};
use common::spoil::{Fault as Spoilt, Spoil};
use common::{MS, run, run_and};

fn mode(sensor: &common::isu::Shared) -> Mode {
    sensor.lock().unwrap().mode()
}

/// A module in its Hard Error state, because a word that must not change has changed.
fn broken(number: u8) -> common::isu::Shared {
    let sensor = at(number);
    {
        let mut node = sensor.lock().unwrap();
        let word = node.eeprom.word(0x10);
        node.eeprom.set_word(0x10, !word);
        use clino_sim::node::Node;
        node.power_off(0);
        node.power_on(0);
        let ready = node.next_event().unwrap();
        let _ = node.act(ready);
        assert_eq!(node.mode(), Mode::HardError);
    }
    sensor
}

#[test]
fn the_angle_is_read() {
    let sensor = at(3);
    let mut bench = bench::<Isu>(&[&sensor]);
    let angle = run(&mut bench, ReadAngle::new(module(3))).result.unwrap();
    // 40° in steps of 360/65536°.
    assert!(angle.difference(Angle::from_udeg(40_000_000)).udeg().abs() < 2_747, "{angle:?}");
}

#[test]
fn identify_reads_what_is_stored() {
    let sensor = at(3);
    let before = words(&sensor);
    let mut bench = bench::<Isu>(&[&sensor]);
    let run = run(&mut bench, Identify::new(module(3)));
    let identity = run.result.unwrap();
    assert_eq!(identity.address, address(3));
    assert_eq!(identity.auto_shutoff_word, eeprom(&sensor).data(0x50));
    assert_eq!(identity.null_position, Angle::ZERO);
    assert_eq!(identity.audit.stored, eeprom(&sensor).computed_checksum());
    assert!(identity.audit.is_sound());
    assert_eq!(run.requests, 17);
    assert_eq!(words(&sensor), before);
}

#[test]
fn identify_says_that_a_module_is_in_error_and_leaves_it_so() {
    let sensor = broken(3);
    let mut bench = bench::<Isu>(&[&sensor]);
    let failure = run(&mut bench, Identify::new(module(3))).result.unwrap_err();
    assert_eq!((failure.cause, failure.writes, failure.repair), (Cause::HardError, 0, false));
    assert_eq!(mode(&sensor), Mode::HardError);
}

#[test]
fn go_to_soft_error() {
    let sensor = broken(3);
    let mut bench = bench::<Isu>(&[&sensor]);
    run(&mut bench, GoToSoftError::new(module(3))).result.unwrap();
    assert_eq!(mode(&sensor), Mode::SoftError);
    // No effect on one that is well.
    let sensor = at(4);
    let mut bench = bench_of(&sensor);
    run(&mut bench, GoToSoftError::new(module(4))).result.unwrap();
    assert_eq!(mode(&sensor), Mode::Normal);
}

fn bench_of(sensor: &common::isu::Shared) -> clino_testkit::rig::Bench<Isu> {
    bench::<Isu>(&[sensor])
}

#[test]
fn reset_waits_until_the_module_is_back_however_long_it_boots() {
    for boot_ms in [1, 50, 533, 2_000, 4_000] {
        let sensor = with(3, Default::default(), Options { boot_time: boot_ms * MS, ..options() });
        let mut bench = bench_of(&sensor);
        let alive = run(&mut bench, Reset::new(module(3))).result.unwrap();
        assert!(!alive.hard_error);
        let after = u64::from(alive.after.as_millis());
        assert!(after >= boot_ms && after < boot_ms.max(100) + 600, "{boot_ms} ms: {after} ms");
    }
}

#[test]
fn reset_gives_up_after_its_limit() {
    let sensor = with(3, Default::default(), Options { boot_time: 20_000 * MS, ..options() });
    let mut bench = bench_of(&sensor);
    let run = run(&mut bench, Reset::new(module(3)));
    assert!(matches!(run.result.unwrap_err().cause, Cause::NotBooted { fault: Fault::NoAnswer { .. } }));
    assert!(run.took < Duration::from_micros(6_500_000), "{:?}", run.took);
}

#[test]
fn reset_of_a_module_in_error_finds_it_in_error() {
    let sensor = broken(3);
    let mut bench = bench_of(&sensor);
    let alive = run(&mut bench, Reset::new(module(3))).result.unwrap();
    assert!(alive.hard_error);
}

#[test]
fn reset_is_asked_again_when_its_answer_is_lost() {
    let sensor = at(3);
    let mut bench = spoilt::<Isu>(&sensor, Spoil::Answer(0, Spoilt::Lost));
    let run = run(&mut bench, Reset::new(module(3)));
    assert!(!run.result.unwrap().hard_error);
    assert_eq!(run.requests, 3);
}

#[test]
fn the_null_position_becomes_where_it_stands() {
    let sensor = at(3);
    let before = words(&sensor);
    let mut bench = bench_of(&sensor);
    let nulled = run(&mut bench, ResetNull::new(module(3))).result.unwrap();
    // 40° is 7281.8 steps.
    assert_eq!((nulled.before, nulled.after, nulled.writes), (7_282, 0, 1));
    assert_eq!(eeprom(&sensor).null(), 7_282);
    assert!(eeprom(&sensor).is_sound());
    common::isu::assert_upper_bits(&before, &words(&sensor));
    // Again: nothing to do.
    let nulled = run(&mut bench, ResetNull::new(module(3))).result.unwrap();
    assert_eq!((nulled.before, nulled.writes), (0, 0));
}

#[test]
fn a_lost_answer_of_reset_null_is_no_second_write() {
    let sensor = at(3);
    // After the 16 readings of its EEPROM and three of its angle.
    let mut bench = spoilt::<Isu>(&sensor, Spoil::Answer(19, Spoilt::Lost));
    let nulled = run(&mut bench, ResetNull::new(module(3))).result.unwrap();
    assert_eq!((nulled.after, nulled.writes), (0, 1));
}

#[test]
fn address_0_takes_the_statement_that_one_is_attached() {
    assert!(Module::at(Address::ANY).is_err());
    assert!(Module::at(Address::RESERVED).is_err());
    let sensor = at(11);
    let mut bench = bench_of(&sensor);
    let single = Module::single(SingleDevice::i_have_attached_one_sensor_only());
    assert_eq!(run(&mut bench, Identify::new(single)).result.unwrap().address, address(11));
    run(&mut bench, ReadAngle::new(single)).result.unwrap();
    run(&mut bench, ResetNull::new(single)).result.unwrap();
}

#[test]
fn an_empty_line_is_no_answer() {
    let mut bench = bench::<Isu>(&[]);
    let run = run(&mut bench, ReadAngle::new(module(3)));
    let failure = run.result.unwrap_err();
    let function = Function::ReadRam;
    assert!(
        matches!(failure.cause, Cause::NoAnswer { function: f, fault: Fault::NoAnswer { .. }, .. } if f == function),
        "{failure}"
    );
    assert_eq!(run.requests, 3);
}

#[test]
fn a_damaged_command_is_sent_again() {
    let sensor = at(3);
    // The third character of Read RAM: the module answers "invalid checksum".
    let mut bench = spoilt::<Isu>(&sensor, Spoil::Heard(2, 0x40));
    let run = run(&mut bench, ReadAngle::new(module(3)));
    run.result.unwrap();
    assert_eq!(run.requests, 2);
}

#[test]
fn a_cancel_ends_between_two_exchanges() {
    let sensor = at(3);
    let mut bench = bench_of(&sensor);
    let run = run_and(&mut bench, Identify::new(module(3)), |runner, requests| {
        if requests == 5 {
            runner.cancel();
        }
    });
    assert_eq!(run.result.unwrap_err().cause, Cause::Cancelled);
    assert_eq!(run.requests, 5);
}

#[test]
fn raw_writes_go_where_the_name_says() {
    let sensor = at(3);
    let mut bench = bench::<UnprotectedIsu>(&[&sensor]);
    let request = Request::WriteEeprom { start: 0x10, words: Words::new(&[0x1234, 0x5678]).unwrap() };
    // The ordinary way is closed.
    assert_eq!(request.encode(address(3)), Err(EncodeError::Undocumented { start: 0x10, count: 2 }));
    let raw = RawWrite::new_even_if_it_bricks_the_module(module(3), request).unwrap();
    run(&mut bench, raw).result.unwrap();
    assert_eq!(words(&sensor)[0x10..0x12], [0x1234, 0x5678]);
    let request = Request::WriteRam { start: 0x80, data: Data::new(&[1, 2, 3]).unwrap() };
    let raw = RawWrite::new_even_if_it_bricks_the_module(module(3), request).unwrap();
    run(&mut bench, raw).result.unwrap();
}

#[test]
fn raw_writes_that_cannot_be_are_refused_with_the_limit() {
    let too_long = Request::WriteEeprom { start: 0, words: Words::new(&[0; 19]).unwrap() };
    let refused = RawWrite::new_even_if_it_bricks_the_module(module(3), too_long).unwrap_err();
    // Length, head, address, 38 bytes, checksum.
    assert_eq!(refused, RawRefusal::TooLong { characters: 42, max: 40 });
    let beyond = Request::WriteEeprom { start: 0xFF, words: Words::new(&[0; 2]).unwrap() };
    let refused = RawWrite::new_even_if_it_bricks_the_module(module(3), beyond).unwrap_err();
    assert_eq!(refused, RawRefusal::Encode(EncodeError::BeyondEnd { start: 0xFF, count: 2 }));
    let refused = RawWrite::new_even_if_it_bricks_the_module(module(3), Request::READ_ANGLE).unwrap_err();
    assert_eq!(refused, RawRefusal::NotAWrite(Function::ReadRam));
}

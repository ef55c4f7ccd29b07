//! Changing the address of a T7.

mod common;

use clino_codec::t7::{Address, DeviceType, EncodeError, Field, Opcode, Status, Text};
use clino_commissioning::SettingChange;
use clino_commissioning::t7::{Cause, ChangeAddress, Fault};
use clino_sim::fault::AnswerFault as SimFault;
use clino_sim::t7 as sim;
use common::spoil::{Fault as Spoilt, Spoil};
use common::t7::{address, at, bench, spoilt, store, three_axes, with};
use common::{run, run_and};

fn change(from: u8, to: u8) -> ChangeAddress {
    ChangeAddress::new(address(from), address(to)).unwrap()
}

#[test]
fn both_models_move() {
    for (sensor, from) in [(at(5), 5), (three_axes(100), 100), (at(127), 127)] {
        let mut bench = bench(&[&sensor]);
        let report = run(&mut bench, change(from, 42)).result.unwrap();
        let (from, to) = (address(from), address(42));
        assert_eq!((report.change, report.writes), (SettingChange::Changed { from, to }, 1));
        assert_eq!(store(&sensor).address, 42);
    }
}

#[test]
fn an_address_that_is_taken_is_refused_and_nothing_is_written() {
    let (one, other) = (at(5), at(6));
    let mut bench = bench(&[&one, &other]);
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    let taken = Cause::AddressTaken { address: address(6), serial: Some(1006) };
    assert_eq!((failure.cause, failure.writes), (taken, 0));
    assert_eq!((store(&one).address, store(&other).address), (5, 6));
}

#[test]
fn an_address_taken_by_two_who_talk_over_each_other_is_refused_too() {
    let (one, six, three) = (at(5), at(6), three_axes(6));
    let mut bench = bench(&[&one, &six, &three]);
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    assert_eq!(failure.cause, Cause::AddressTaken { address: address(6), serial: None });
    assert_eq!([store(&one).address, store(&six).address, store(&three).address], [5, 6, 6]);
}

#[test]
fn a_wrong_serial_number_is_refused() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let wrong = ChangeAddress::of(address(5), address(6), DeviceType::T7_1, 4711).unwrap();
    let failure = run(&mut bench, wrong).result.unwrap_err();
    // No device of that name is there: the device stays, whatever was sent.
    assert_eq!(failure.cause, Cause::StillAt { address: address(5) });
    assert_eq!(store(&sensor).address, 5);
}

#[test]
fn of_two_at_one_address_the_one_that_is_named_moves() {
    let (one, three) = (at(5), three_axes(5));
    let mut bench = bench(&[&one, &three]);
    // By its address alone it cannot be told from the other.
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    assert!(
        matches!(failure.cause, Cause::NoAnswer { fault: Fault::Bad(_) | Fault::Garbled { .. }, .. }),
        "{failure}"
    );
    let named = ChangeAddress::of(address(5), address(6), DeviceType::T7_3, 77).unwrap();
    let report = run(&mut bench, named).result.unwrap();
    assert_eq!(report.writes, 1);
    assert_eq!((store(&one).address, store(&three).address), (5, 6));
    // And again, as after an interruption: it is there already.
    let report = run(&mut bench, named).result.unwrap();
    assert_eq!((report.change, report.writes), (SettingChange::Unchanged(address(6)), 0));
}

#[test]
fn addresses_that_cannot_be_given_are_refused_with_the_limits() {
    for to in [Address::FACTORY, Address::ALL] {
        let refused = ChangeAddress::new(address(5), to).unwrap_err();
        let value = i32::from(to.get());
        assert_eq!(refused, EncodeError::OutOfRange { field: Field::NewAddress, value, min: 1, max: 100 });
    }
    let refused = ChangeAddress::new(Address::ALL, address(5)).unwrap_err();
    assert!(matches!(refused, EncodeError::NotForAll { .. }));
}

#[test]
fn where_it_is_already_is_no_change() {
    let sensor = at(127);
    let mut bench = bench(&[&sensor]);
    let report = run(&mut bench, change(127, 127)).result.unwrap();
    assert_eq!((report.change, report.writes), (SettingChange::Unchanged(Address::FACTORY), 0));
}

#[test]
fn the_documents_own_example_needs_its_type_named() {
    let sensor = with(
        sim::Identity { product: *b"X4    ", serial: 5, ..sim::Identity::default() },
        sim::StoredSettings { address: 5, ..sim::StoredSettings::default() },
    );
    let mut bench = bench(&[&sensor]);
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    assert_eq!(failure.cause, Cause::UnknownProduct { product: Text::new(*b"X4    ") });
    let named = ChangeAddress::of(address(5), address(6), DeviceType::T7_1, 5).unwrap();
    assert_eq!(run(&mut bench, named).result.unwrap().writes, 1);
    assert_eq!(store(&sensor).address, 6);
}

#[test]
fn a_lost_answer_does_not_hide_that_it_moved() {
    let sensor = at(5);
    // Answers: its identity, then Set Address.
    let mut bench = spoilt(&sensor, Spoil::Answer(1, Spoilt::Lost));
    let report = run(&mut bench, change(5, 6)).result.unwrap();
    assert_eq!((report.writes, store(&sensor).address), (1, 6));
}

#[test]
fn a_device_that_dies_in_the_middle_is_lost() {
    let sensor = at(5);
    let mut bench = spoilt(&sensor, Spoil::AnswersFrom(1, Spoilt::Lost));
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    assert!(matches!(failure.cause, Cause::Lost { .. }), "{failure}");
    assert_eq!(failure.writes, 1);
}

#[test]
fn a_refusal_is_told_with_its_status() {
    let sensor = at(5);
    // Its answer becomes "flash program error", checksum included; the command itself it hears damaged, and does nothing.
    let refusal = [0x05, 0x03, 0x91, 0x08, 0x5F];
    sensor.lock().unwrap().faults.every = Some((2, SimFault::Instead(refusal.to_vec())));
    let identity = 3;
    let probes_of_others = 3 * 3;
    let mut bench = spoilt(&sensor, Spoil::Heard(identity + probes_of_others + 5, 0x10));
    let failure = run(&mut bench, change(5, 6)).result.unwrap_err();
    let (opcode, status) = (Opcode::SetAddress, Status::FlashProgramError);
    assert_eq!((failure.cause, failure.writes), (Cause::Status { opcode, status }, 1));
    assert_eq!(store(&sensor).address, 5);
}

#[test]
fn a_cancel_before_the_write_changes_nothing_and_after_it_nothing_either() {
    for after in 0..6 {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        let run = run_and(&mut bench, change(5, 6), |runner, requests| {
            if requests == after {
                runner.cancel();
            }
        });
        match run.result {
            // Its identity, three probes of the new address, then the write.
            Err(failure) => {
                assert_eq!((failure.cause, failure.writes), (Cause::Cancelled, 0));
                assert!(after < 5, "after {after}");
                assert_eq!(store(&sensor).address, 5);
            }
            Ok(report) => {
                assert_eq!(report.writes, 1);
                assert!(after >= 5, "after {after}");
                assert_eq!(store(&sensor).address, 6);
            }
        }
    }
}

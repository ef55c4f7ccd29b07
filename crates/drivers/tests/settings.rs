//! What sensors keep: read, compare, write only a difference, read back. And the rest of the methods.
#![cfg(all(feature = "embedded-io", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::angle::{Angle, Range};
use clino_drivers::codec::isu::{Address, DeviceError};
use clino_drivers::codec::t7::{Axis, Direction, Field, Status};
use clino_drivers::rs485::PortSettings;
use clino_drivers::t7::FlashWrite;
use clino_drivers::{Serial, SttIsu, Timing, isu, t7};
use clino_sim::fault::AnswerFault as Fault;
use clino_sim::isu::Mode;
use common::{Board, Model, sensors};
use support::{MS, NbLine, address, nb_line, nb_t7};

fn mdeg(mdeg: i32) -> Angle {
    Angle::from_mdeg(mdeg).unwrap()
}

#[test]
fn a_t7_tells_everything() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let all = t7.all_angles(address(5)).unwrap();
    assert_eq!((all.angles[0], all.angles[1]), (Angle::ZERO, Angle::ZERO));
    assert!(sensors::is_true(all.angles[2], sensors::TURNING.at(board.now())));
    assert_eq!(all.temperature.centi_celsius(), 2_300);
    let data = t7.all_data(address(5)).unwrap();
    assert!(sensors::is_true(data.angles[2], sensors::TURNING.at(board.now())));
    assert_eq!((data.serial, data.temperature.centi_celsius()), (25_033, 2_300));
    let information = t7.information(address(5)).unwrap();
    assert_eq!((information.serial, information.product.as_str()), (25_033, Some("T7-1")));
    assert_eq!(t7.offsets(address(5)).unwrap(), [Angle::ZERO; 3]);
    assert_eq!(t7.directions(address(5)).unwrap(), [Direction::Normal; 3]);
    assert_eq!(t7.damping_ms(address(5)).unwrap(), 1_000);
    assert_eq!(t7.range(address(5)).unwrap(), Range::Bidirectional);
}

#[test]
fn settings_are_written_once() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let five = address(5);
    for expected in [FlashWrite::Written, FlashWrite::Unneeded] {
        assert_eq!(t7.set_offset(five, Axis::Two, mdeg(-12_345)), Ok(expected));
        assert_eq!(t7.set_direction(five, Axis::Two, Direction::Reversed), Ok(expected));
        assert_eq!(t7.set_damping_ms(five, 250), Ok(expected));
        assert_eq!(t7.set_range(five, Range::Unidirectional), Ok(expected));
    }
    assert_eq!(t7.counters().writes, 4);
    // A turn more is the same offset.
    assert_eq!(t7.set_offset(five, Axis::Two, mdeg(347_655)), Ok(FlashWrite::Unneeded));
    let sensor = sensor.lock().unwrap();
    let stored = sensor.settings();
    assert_eq!((stored.offsets, stored.damping_ms), ([0, 0, -12_345], 250));
    assert_eq!(stored.directions[2], clino_sim::t7::Direction::Reversed);
    assert_eq!(stored.range, clino_sim::t7::OutputRange::Unidirectional);
}

#[test]
fn a_refusal_is_reported() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    // The answer to the look before is the first, that to the command the second.
    sensor.lock().unwrap().faults.every = Some((2, Fault::WrongStatus(8)));
    let refused = t7.set_damping_ms(address(5), 250);
    assert_eq!(refused, Err(t7::Error::Refused(Status::FlashProgramError)));
}

/// A device that says it has written, and has not.
#[test]
fn a_setting_that_is_not_kept_is_reported() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    // Damping 1000 ms, whatever was written: every third answer is that to the read back.
    let stale = vec![0x05, 0x04, 0x8A, 0x03, 0xE8, 0x82];
    sensor.lock().unwrap().faults.every = Some((3, Fault::Instead(stale)));
    let not_kept = t7::Error::NotKept { field: Field::Damping, written: 250, found: 1_000 };
    assert_eq!(t7.set_damping_ms(address(5), 250), Err(not_kept));
}

/// An answer to a write that gets lost is no reason to write again.
#[test]
fn a_lost_answer_is_not_written_twice() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    t7.set_retry(clino_drivers::Retry::times(3));
    sensor.lock().unwrap().faults.every = Some((2, Fault::Silent));
    assert!(matches!(t7.set_damping_ms(address(5), 250), Err(t7::Error::NoAnswer { .. })));
    assert_eq!(t7.counters().writes, 1);
    sensor.lock().unwrap().faults.every = None;
    assert_eq!(t7.set_damping_ms(address(5), 250), Ok(FlashWrite::Unneeded));
}

fn module(number: u8) -> Address {
    Address::new(number).unwrap()
}

fn isu_of(board: &Board) -> SttIsu<NbLine> {
    SttIsu::new(nb_line(board, PortSettings::new(Serial::ISU)), Timing::isu())
}

#[test]
fn an_isu_tells_everything() {
    let sensor = sensors::isu(3, 90_000_000);
    let board = sensors::isu_board(Model::BARE, &[&sensor]);
    let mut isu = isu_of(&board);
    assert_eq!(isu.angle(module(3)), Ok(mdeg(90_000)));
    assert_eq!(isu.read_ram(module(3), 0x58, 2).unwrap().as_slice(), [0x40, 0x00]);
    let words: Vec<u16> = isu.read_eeprom(module(3), 0x48, 2).unwrap().iter().collect();
    assert_eq!(words, sensor.lock().unwrap().eeprom.words()[0x48..0x4A]);
    assert!(matches!(isu.read_ram(module(3), 0xFF, 2), Err(isu::Error::Request(_))));
    assert_eq!(isu.angle(Address::ANY), Err(isu::Error::NotSingleDevice));
    assert!(matches!(isu.angle(module(4)), Err(isu::Error::NoAnswer { .. })));
}

#[test]
fn an_isu_is_nulled() {
    let sensor = sensors::isu(3, 90_000_000);
    let board = sensors::isu_board(Model::BARE, &[&sensor]);
    let mut isu = isu_of(&board);
    isu.reset_null(module(3)).unwrap();
    board.pass(600 * MS);
    assert_eq!(isu.angle(module(3)), Ok(Angle::ZERO));
}

#[test]
fn a_broken_isu_is_told_from_a_silent_one() {
    let sensor = sensors::isu(3, 90_000_000);
    let board = sensors::isu_board(Model::BARE, &[&sensor]);
    let mut isu = isu_of(&board);
    sensor.lock().unwrap().eeprom.set_word(0x10, 0xFFFF);
    isu.reset(module(3)).unwrap();
    board.pass(600 * MS);
    assert_eq!(sensor.lock().unwrap().mode(), Mode::HardError);
    let error = isu.angle(module(3)).unwrap_err();
    assert!(matches!(error, isu::Error::Refused(DeviceError::HardwareError { .. })), "{error:?}");
    isu.go_to_soft_error_state(module(3)).unwrap();
    assert_eq!(sensor.lock().unwrap().mode(), Mode::SoftError);
    assert_eq!(isu.read_eeprom(module(3), 0x10, 1).unwrap().as_be_bytes(), [0xFF, 0xFF]);
}

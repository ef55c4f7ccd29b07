//! Everything that an ISU's driver does, on every HAL.

use clino_drivers::codec::isu::eeprom::{Change, ChecksumReading};
use clino_drivers::codec::isu::{Address as Number, Request};
use clino_drivers::commissioning::isu::{GoToSoftError, Identify, Module, Program, ReadAngle, Repair, Reset};
use clino_drivers::uart::{Io, Nb};
use clino_drivers::{SttIsu, asynch};

use super::*;
use crate::common::executor::block_on;
use crate::support::turns;

/// Module 3 is tilted by 90°.
macro_rules! everything {
    ($isu:ident, $row:ident, $board:ident, $wait:ident, $times:expr) => {{
        let number = |number| Number::new(number).unwrap();
        let module = |of| Module::at(number(of)).unwrap();
        let (three, seven) = (number(3), number(7));
        for _ in 0..$times {
            assert_eq!($wait!($isu.angle(three)).unwrap().mdeg(), 90_000, "{}", $row.name);
            assert_eq!($wait!($isu.read_eeprom(three, 0x48, 16)).unwrap().iter().count(), 16);
        }
        assert_eq!($wait!($isu.read_ram(three, 0x58, 2)).unwrap().as_slice(), [0x40, 0x00]);
        let answer = $wait!($isu.transact(three, &Request::READ_ANGLE)).unwrap();
        assert_eq!(answer.angle_word(), Some(0x4000));

        // Commands; a module measures again every 533 ms.
        $wait!($isu.reset(three)).unwrap();
        $board.pass(1_100 * MS);
        assert_eq!($wait!($isu.angle(three)).unwrap().mdeg(), 90_000);
        $wait!($isu.reset_null(three)).unwrap();
        $board.pass(600 * MS);
        assert_eq!($wait!($isu.angle(three)).unwrap().mdeg(), 0);
        $wait!($isu.go_to_soft_error_state(three)).unwrap();
        $wait!($isu.reset(three)).unwrap();
        $board.pass(1_100 * MS);

        // Operations.
        $wait!($isu.zero(three)).unwrap();
        $wait!($isu.run(GoToSoftError::new(module(3)))).unwrap();
        $wait!($isu.run(Reset::new(module(3)))).unwrap();
        $wait!($isu.run(ReadAngle::new(module(3)))).unwrap();
        $wait!($isu.run(Program::new(module(3), Change::ModuleAddress(seven)).unwrap())).unwrap();
        let identity = $wait!($isu.run(Identify::new(module(7)))).unwrap();
        assert_eq!(identity.address, seven);
        assert!(identity.audit.holds(ChecksumReading::UpperBitsCounted), "{}", $row.name);
        $wait!($isu.run(Repair::new(module(7)))).unwrap();
        assert!($wait!($isu.angle(three)).is_err());
        assert_eq!($wait!($isu.angle(seven)).unwrap().mdeg(), 0, "{}", $row.name);

        let counters = *$isu.counters();
        assert_eq!((counters.late, counters.bad_answer), (0, 0), "{}", $row.name);
    }};
}

on_every_hal!(on);

fn on(row: &Row, echo: Echo, how: Use) {
    let stations = vec![sensors::station("isu", sensors::isu(3, 90_000_000))];
    let board = board(row, 9_600, echo == Echo::Expected, stations);
    let (settings, uart) = (row.settings(Serial::ISU, echo), board.uart());
    let timing = row.isu_timing();
    // What an echo adds shows at once.
    let times = if echo == Echo::Off { TIMES } else { 3 };
    match how {
        Use::Nb => {
            let line = Rs485::new(Nb::new(uart), board.de(), board.delay(), settings);
            let mut isu = SttIsu::new(line, timing);
            everything!(isu, row, board, directly, times);
        }
        Use::Io => {
            let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
            let mut isu = SttIsu::new(line, timing);
            everything!(isu, row, board, directly, times);
        }
        Use::Async => {
            let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
            let mut isu = asynch::SttIsu::new(line, timing);
            macro_rules! wait {
                ($call:expr) => {
                    block_on(&board, $call)
                };
            }
            everything!(isu, row, board, wait, times);
        }
    }
    let turns = turns(&board);
    assert!(turns.all_clean() && !turns.high, "{}", row.name);
}

/// A method that is added is called here, too.
#[test]
fn every_method_is_called() {
    super::every_method_is_called(include_str!("../../src/isu.rs"), include_str!("isu.rs"), "isu");
}

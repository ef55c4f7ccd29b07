//! Futures dropped at every wait, on every HAL that has async drivers: DE is low at once, and the next call gets its own
//! answer.

use clino_drivers::asynch;
use clino_drivers::codec::isu::Address as Module;
use clino_drivers::codec::t7::Axis;
use clino_drivers::t7::AllData;

use super::*;
use crate::common::executor::{block_on, block_on_polls};
use crate::support::{IoLine, io_line, turns};

/// The rows with async drivers.
fn rows() -> impl Iterator<Item = &'static Row> {
    ROWS.iter().filter(|row| row.uses.contains(&Use::Async))
}

/// A T7 on a HAL, its board and its driver.
fn t7_on(row: &Row) -> (sensors::SharedT7, Board, asynch::UsDigitalT7<IoLine>) {
    let sensor = sensors::t7(5);
    let board = board(row, 115_200, false, vec![sensors::station("t7", sensor.clone())]);
    let line = io_line(&board, row.settings(SERIAL, Echo::Off));
    let driver = asynch::UsDigitalT7::new(line, row.t7_timing(SERIAL));
    (sensor, board, driver)
}

/// Drops a call at each of its waits, then makes it again: its angle is the true one, and was said after it was asked.
macro_rules! dropped_at_every_wait {
    ($row:ident, $t7:ident => $call:expr, $angle:expr) => {{
        let mut cut = 0;
        for polls in 0.. {
            let (sensor, board, mut $t7) = t7_on($row);
            let first = block_on_polls(&board, polls, $call);
            assert!(!turns(&board).high, "{}, {polls}", $row.name);
            let dropped_at = board.now();
            let second = block_on(&board, $call);
            let second = second.unwrap_or_else(|error| panic!("{}, {polls}: {error}", $row.name));
            assert!(is_true(&board, $angle(second), $row), "{}, {polls}: {second:?}", $row.name);
            let said = *sensor.lock().unwrap().said().last().unwrap();
            assert!(said.at >= dropped_at, "{}, {polls}: said before it was asked", $row.name);
            if first.is_some() {
                break;
            }
            cut += 1;
        }
        assert!(cut > 5, "{}: it was dropped at some of its waits: {cut}", $row.name);
    }};
}

#[test]
fn an_angle() {
    for row in rows() {
        dropped_at_every_wait!(row, t7 => t7.angle(address(5), Axis::Two), |angle| angle);
    }
}

/// The longest answer, which receivers hand over in several pieces.
#[test]
fn all_data() {
    for row in rows() {
        dropped_at_every_wait!(row, t7 => t7.all_data(address(5)), |data: AllData| data.angles[2]);
    }
}

#[test]
fn a_setting() {
    for row in rows() {
        for polls in 0.. {
            let (sensor, board, mut t7) = t7_on(row);
            let first = block_on_polls(&board, polls, t7.set_damping_ms(address(5), 250));
            assert!(!turns(&board).high, "{}, {polls}", row.name);
            let second = block_on(&board, t7.set_damping_ms(address(5), 250));
            assert!(second.is_ok(), "{}, {polls}: {second:?}", row.name);
            assert_eq!(sensor.lock().unwrap().settings().damping_ms, 250, "{}, {polls}", row.name);
            // The request at rest may be lost with its future; it is never carried out twice.
            assert!(t7.counters().writes <= 2, "{}, {polls}", row.name);
            if first.is_some() {
                break;
            }
        }
    }
}

#[test]
fn an_angle_of_an_isu() {
    let three = Module::new(3).unwrap();
    for row in rows() {
        let mut cut = 0;
        for polls in 0.. {
            let sensor = sensors::isu(3, 90_000_000);
            let board = board(row, 9_600, false, vec![sensors::station("isu", sensor)]);
            let line = io_line(&board, row.settings(Serial::ISU, Echo::Off));
            let mut isu = asynch::SttIsu::new(line, row.isu_timing());
            let first = block_on_polls(&board, polls, isu.angle(three));
            assert!(!turns(&board).high, "{}, {polls}", row.name);
            let second = block_on(&board, isu.angle(three));
            assert_eq!(second.map(|angle| angle.mdeg()).ok(), Some(90_000), "{}, {polls}", row.name);
            if first.is_some() {
                break;
            }
            cut += 1;
        }
        assert!(cut > 5, "{}: it was dropped at some of its waits: {cut}", row.name);
    }
}

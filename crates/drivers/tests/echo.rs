//! A transceiver whose receiver is always on: what we send comes back, is compared, and is removed.
#![cfg(all(feature = "embedded-io", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::character::Character;
use clino_drivers::codec::t7::Axis;
use clino_drivers::rs485::{Echo, Error, PortSettings};
use clino_drivers::{Port, Timing, UsDigitalT7, t7};
use clino_segment::{Babble, Faults, Station};
use common::{Board, Model, sensors};
use support::{MS, SERIAL, US, address, io_line, nb_line, turns};

const SETTINGS: PortSettings = PortSettings { echo: Echo::Expected, ..PortSettings::new(SERIAL) };

fn board(model: Model, echo: bool, babble: Option<Babble>, latency: u64) -> Board {
    let sensor = sensors::t7_with(5, sensors::quick(latency));
    let mut stations = vec![sensors::station("t7", sensor)];
    if let Some(babble) = babble {
        let faults = Faults { babble: vec![babble], ..Default::default() };
        stations.push(Station { name: "babbler".into(), node: Box::new(sensors::t7(6)), faults });
    }
    Board::new(115_200, model, clino_segment::SegmentSettings { echo, ..sensors::quiet() }, stations)
}

/// Even a UART that holds one character gets its echo out of the way in time for a quick answer.
#[test]
fn an_echo_is_removed() {
    for (nb, model) in [(true, Model::BARE), (false, Model::BARE), (false, Model::BUFFERED)] {
        for latency in [20 * US, 170 * US, 2 * MS] {
            let board = board(model, true, None, latency);
            let mut nb_t7 = UsDigitalT7::new(nb_line(&board, SETTINGS), Timing::t7(SERIAL));
            let mut io_t7 = UsDigitalT7::new(io_line(&board, SETTINGS), Timing::t7(SERIAL));
            for _ in 0..10 {
                let asked =
                    if nb { nb_t7.angle(address(5), Axis::Two) } else { io_t7.angle(address(5), Axis::Two) };
                assert!(sensors::is_true(asked.unwrap(), sensors::TURNING.at(board.now())));
            }
            assert_eq!((nb_t7.counters().discarded, io_t7.counters().discarded), (0, 0));
            let turns = turns(&board);
            assert!(turns.all_clean() && turns.count == 10, "{turns:?}");
        }
    }
}

#[test]
fn a_missing_echo_is_an_error() {
    let board = board(Model::BARE, false, None, 2 * MS);
    let mut t7 = UsDigitalT7::new(nb_line(&board, SETTINGS), Timing::t7(SERIAL));
    let missing = Error::Echo { index: 0, sent: 0x05, heard: None };
    assert_eq!(t7.angle(address(5), Axis::Two), Err(t7::Error::Port(missing)));
    assert!(!turns(&board).high);
}

/// An unexpected echo is discarded and costs no answer.
#[test]
fn an_unexpected_echo_costs_nothing() {
    let board = board(Model::BUFFERED, true, None, 2 * MS);
    let mut t7 = UsDigitalT7::new(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
    assert!(sensors::is_true(t7.angle(address(5), Axis::Two).unwrap(), sensors::TURNING.at(board.now())));
}

#[test]
fn contention_is_seen() {
    let babble = Babble { from: 120 * US, until: 130 * US, gap: 0 };
    let board = board(Model::BARE, true, Some(babble), 2 * MS);
    let mut line = nb_line(&board, SETTINGS);
    let error = line.send(&[0x55; 8]).unwrap_err();
    let Error::Echo { index, sent: 0x55, heard: Some(heard) } = error else { panic!("{error:?}") };
    assert!((1..=3).contains(&index) && heard != Character::clean(0x55), "{error:?}");
    // It was sent to its end, and the next frame is fine.
    assert_eq!(turns(&board).bytes(), [0x55; 8]);
    line.send(&[0x55; 8]).unwrap();
    assert!(!turns(&board).high);
}

//! DE, as the wire sees it: raised before the first start bit, dropped after the last stop bit, never left high.
#![cfg(all(feature = "embedded-io", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::t7::Axis;
use clino_drivers::rs485::{Error, PortSettings, Release};
use clino_drivers::{Duration, Port, Serial, SttIsu, Timing, UsDigitalT7, t7};
use clino_segment::log::Fate;
use common::uart::Flush;
use common::{Model, sensors};
use support::{CHARACTER, MS, SERIAL, US, address, io_line, nb_line, turns};

/// From TC to DE low at most, with polls of half a bit (5 µs) and a few calls of 200 ns each.
const RELEASE_POLLED: u64 = 7 * US;
/// The same for a `flush` that blocks: calls only.
const RELEASE_BLOCKING: u64 = US;

#[test]
fn nb_at_115200() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = UsDigitalT7::new(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
    for _ in 0..20 {
        t7.angle(address(5), Axis::Two).unwrap();
        t7.all_data(address(5)).unwrap();
    }
    let turns = turns(&board);
    assert_eq!(turns.count, 40);
    assert_eq!(turns.bytes()[..6], [0x05, 0x01, 0x83, 0x05, 0x01, 0x87]);
    assert!(turns.all_clean(), "{turns:?}");
    assert!(turns.hold.1 <= RELEASE_POLLED, "{:?}", turns.hold);
    assert!(turns.lead.1 <= US, "{:?}", turns.lead);
}

#[test]
fn embedded_io_at_115200() {
    let sensor = sensors::t7(5);
    for model in [Model::BARE, Model::BUFFERED] {
        let board = sensors::t7_board(model, &[&sensor]);
        let mut t7 = UsDigitalT7::new(io_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
        for _ in 0..20 {
            t7.angle(address(5), Axis::Two).unwrap();
        }
        let turns = turns(&board);
        assert_eq!(turns.sent.len(), 60);
        assert!(turns.all_clean(), "{turns:?}");
        assert!(turns.hold.1 <= RELEASE_BLOCKING, "{:?}", turns.hold);
    }
}

#[test]
fn both_at_9600() {
    for nb in [true, false] {
        let sensor = sensors::isu(3, 1_000_000);
        let board = sensors::isu_board(Model::BARE, &[&sensor]);
        let settings = PortSettings::new(Serial::ISU);
        let module = clino_drivers::codec::isu::Address::new(3).unwrap();
        if nb {
            SttIsu::new(nb_line(&board, settings), Timing::isu()).angle(module).unwrap();
        } else {
            SttIsu::new(io_line(&board, settings), Timing::isu()).angle(module).unwrap();
        }
        let turns = turns(&board);
        assert_eq!(turns.bytes(), [0x03, 0x34, 0x58, 0x02, 0x8E]);
        assert!(turns.all_clean(), "{turns:?}");
        // Half a bit is 53 µs.
        assert!(turns.hold.1 <= 55 * US, "{:?}", turns.hold);
    }
}

/// What the fate of characters is worth: a `flush` that lies costs the last one.
#[test]
fn a_flush_that_lies_cuts_the_last_character() {
    let sensor = sensors::t7(5);
    let model = Model { flush: Flush::RegisterEmpty, ..Model::BARE };
    let board = sensors::t7_board(model, &[&sensor]);
    let mut t7 = UsDigitalT7::new(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
    assert!(t7.angle(address(5), Axis::Two).is_err());
    let fates: Vec<Fate> = turns(&board).sent.iter().map(|&(_, fate)| fate).collect();
    assert!(matches!(fates[..], [Fate::Clean, Fate::Clean, Fate::Cut { .. }]), "{fates:?}");
}

#[test]
fn a_flush_that_lies_is_held() {
    let cases = [
        (Flush::RegisterEmpty, Model::BARE, Release::TRANSMIT_REGISTER_EMPTY),
        (Flush::Never, Model::BARE, Release::Held { characters: 2 }),
        (Flush::Never, Model::BUFFERED, Release::WHOLE_FRAME),
    ];
    for (flush, model, release) in cases {
        for nb in [true, false] {
            let sensor = sensors::t7(5);
            let board = sensors::t7_board(Model { flush, ..model }, &[&sensor]);
            let settings = PortSettings { release, ..PortSettings::new(SERIAL) };
            for _ in 0..10 {
                let asked = if nb {
                    UsDigitalT7::new(nb_line(&board, settings), Timing::t7(SERIAL))
                        .angle(address(5), Axis::Two)
                } else {
                    UsDigitalT7::new(io_line(&board, settings), Timing::t7(SERIAL))
                        .angle(address(5), Axis::Two)
                };
                asked.unwrap();
            }
            let turns = turns(&board);
            assert_eq!(turns.sent.len(), 30);
            assert!(turns.all_clean(), "{turns:?}");
            // A poll of half a bit, a margin of a bit, rounding, calls.
            assert!(turns.hold.1 <= 20 * US, "{:?} {release:?}", turns.hold);
        }
    }
}

#[test]
fn delays_are_kept() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let settings = PortSettings {
        before: Duration::from_micros(50),
        after: Duration::from_micros(30),
        ..PortSettings::new(SERIAL)
    };
    let mut t7 = UsDigitalT7::new(nb_line(&board, settings), Timing::t7(SERIAL));
    t7.angle(address(5), Axis::Two).unwrap();
    let turns = turns(&board);
    assert!(turns.all_clean(), "{turns:?}");
    assert!((50 * US..52 * US).contains(&turns.lead.0), "{:?}", turns.lead);
    assert!((30 * US..40 * US).contains(&turns.hold.0), "{:?}", turns.hold);
}

/// A UART that does not get on holds the line for no more than a frame and two characters.
#[test]
fn a_stuck_uart_lets_go_of_the_line() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = UsDigitalT7::new(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
    board.uart().jam(true);
    let error = t7.angle(address(5), Axis::Two).unwrap_err();
    assert!(matches!(error, t7::Error::Port(Error::Stuck { .. })), "{error:?}");
    assert!(!turns(&board).high);
    assert!(board.now() < 8 * CHARACTER, "{}", board.now());
    // It works again: the sensor is given the time to forget half a command.
    board.uart().jam(false);
    let angle = t7.angle(address(5), Axis::Two).unwrap();
    assert!(sensors::is_true(angle, sensors::TURNING.at(board.now())), "{angle}");
    assert!(board.now() >= 500 * MS, "{}", board.now());
}

/// An answer that begins a bit after ours is heard whole, even by a UART that holds one character.
#[test]
fn an_answer_at_once_is_not_lost() {
    for latency in [9 * US, 20 * US, 100 * US, 170 * US] {
        let sensor = sensors::t7_with(5, sensors::quick(latency));
        let board = sensors::t7_board(Model::BARE, &[&sensor]);
        let mut t7 = UsDigitalT7::new(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
        for _ in 0..20 {
            t7.angle(address(5), Axis::Two).unwrap();
        }
        assert_eq!(t7.counters().first_try, 20);
        assert!(turns(&board).all_clean());
    }
}

/// Anything half-duplex: one call of `write` is one turn.
#[test]
fn a_write_is_a_turn() {
    use embedded_io::Write;
    let board = sensors::t7_board(Model::BARE, &[]);
    let mut line = nb_line(&board, PortSettings::new(SERIAL));
    line.write_all(b"hello").unwrap();
    line.write_all(b"world!").unwrap();
    line.send(&[]).unwrap();
    assert_eq!(line.write(&[]).unwrap(), 0);
    let turns = turns(&board);
    assert_eq!((turns.count, turns.bytes()), (2, b"helloworld!".to_vec()));
    assert!(turns.all_clean() && !turns.high);
}

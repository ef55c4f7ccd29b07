//! Operations on a driver's line: they do what they say, blocking and async, and a future dropped at any of its waits
//! leaves a sensor that the next call puts right.
#![cfg(all(feature = "async", feature = "nb", feature = "commissioning"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::isu::Address as Module;
use clino_drivers::codec::isu::eeprom::{Change, ChecksumReading};
use clino_drivers::codec::t7::{Axis, BaudRate, Request};
use clino_drivers::commissioning::t7::{
    AskAll, ChangeAddress, ChangeBaud, Device, Found, Heard, Rates, Sweep,
};
use clino_drivers::commissioning::{SettingChange, SingleDevice, isu};
use clino_drivers::run::RunError;
use clino_drivers::t7::FlashWrite;
use clino_drivers::{PortSettings, Serial, SttIsu, Timing, UsDigitalT7, asynch, codec};
use common::executor::{block_on, block_on_polls};
use common::{Board, Model, sensors};
use support::{IoLine, MS, NbLine, SERIAL, address, io_line, nb_line, nb_t7, turns};

fn module(number: u8) -> isu::Module {
    isu::Module::at(Module::new(number).unwrap()).unwrap()
}

fn t7_async(board: &Board) -> asynch::UsDigitalT7<IoLine> {
    asynch::UsDigitalT7::new(io_line(board, PortSettings::new(SERIAL)), Timing::t7(SERIAL))
}

fn isu_async(board: &Board) -> asynch::SttIsu<IoLine> {
    asynch::SttIsu::new(io_line(board, PortSettings::new(Serial::ISU)), Timing::isu())
}

fn isu_nb(board: &Board) -> SttIsu<NbLine> {
    SttIsu::new(nb_line(board, PortSettings::new(Serial::ISU)), Timing::isu())
}

/// A T7 that stands at 12.345°, and a board with it.
fn still() -> (sensors::SharedT7, Board) {
    let mut options = sensors::turning();
    options.motion[2] = clino_sim::motion::Motion::Constant(12_345_000);
    let sensor = sensors::t7_with(5, options);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    (sensor, board)
}

#[test]
fn a_t7_is_zeroed() {
    for blocking in [true, false] {
        let (sensor, board) = still();
        let zeroed = if blocking {
            nb_t7(&board).zero(address(5), Axis::Two)
        } else {
            block_on(&board, t7_async(&board).zero(address(5), Axis::Two))
        };
        let zeroed = zeroed.unwrap();
        assert_eq!((zeroed.before.0, zeroed.after.0, zeroed.writes), (12_345, 0, 1));
        assert_eq!(nb_t7(&board).angle(address(5), Axis::Two).unwrap().mdeg(), 0);
        assert_eq!(sensor.lock().unwrap().settings().offsets[2], -12_345);
        // The default damping time, and the watch.
        assert!(board.now() > 1_250 * MS, "{}", board.now());
    }
}

/// One that moves is refused, and nothing is written.
#[test]
fn a_t7_that_turns_is_not_zeroed() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let error = t7.zero(address(5), Axis::Two).unwrap_err();
    assert!(error.to_string().contains("moves"), "{error}");
    assert_eq!((t7.counters().writes, sensor.lock().unwrap().settings().offsets[2]), (0, 0));
}

#[test]
fn the_only_t7_is_zeroed_without_its_address() {
    let (_, board) = still();
    let mut t7 = UsDigitalT7::single(nb_line(&board, PortSettings::new(SERIAL)), Timing::t7(SERIAL));
    assert_eq!(t7.zero(codec::t7::Address::ALL, Axis::Two).unwrap().after.0, 0);
    let mut t7 = nb_t7(&board);
    assert_eq!(t7.zero(codec::t7::Address::ALL, Axis::Two), Err(RunError::NotSingleDevice));
}

#[test]
fn an_isu_is_zeroed_and_given_an_address() {
    for blocking in [true, false] {
        let sensor = sensors::isu(3, 90_000_000);
        let board = sensors::isu_board(Model::BUFFERED, &[&sensor]);
        let change = isu::Program::new(module(3), Change::ModuleAddress(Module::new(7).unwrap())).unwrap();
        let (nulled, report) = if blocking {
            let mut isu = isu_nb(&board);
            (isu.zero(Module::new(3).unwrap()), isu.run(change))
        } else {
            let mut isu = isu_async(&board);
            block_on(&board, async { (isu.zero(Module::new(3).unwrap()).await, isu.run(change).await) })
        };
        nulled.unwrap();
        report.unwrap();
        let seven = Module::new(7).unwrap();
        assert_eq!(isu_nb(&board).angle(seven).unwrap().mdeg(), 0);
        assert_eq!(isu_nb(&board).run(isu::Identify::new(module(7))).unwrap().address, seven);
    }
}

/// A sweep over all rates finds a T7 at another; then it is given the line's.
#[test]
fn a_t7_at_another_rate_is_found_and_brought_home() {
    for blocking in [true, false] {
        let settings = clino_sim::t7::StoredSettings { address: 9, baud_index: 3, ..Default::default() };
        let identity = clino_sim::t7::Identity::default();
        let node = clino_sim::t7::T7::new(identity, settings, clino_sim::t7::Options::default()).unwrap();
        let sensor = std::sync::Arc::new(std::sync::Mutex::new(node));
        let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
        let mut found = Vec::new();
        let tell = |event| found.push(event);
        let uart = board.uart();
        let sweep = Sweep::new(SERIAL, Rates::ALL);
        let swept = if blocking {
            let rate = |line: &mut NbLine, serial: Serial| {
                uart.set_baud(serial.baud);
                line.set_settings(PortSettings::new(serial));
                Ok(Timing::t7(serial))
            };
            nb_t7(&board).run_at_rates(sweep, rate, tell)
        } else {
            let rate = async |line: &mut IoLine, serial: Serial| {
                uart.set_baud(serial.baud);
                line.set_settings(PortSettings::new(serial));
                Ok(Timing::t7(serial))
            };
            block_on(&board, t7_async(&board).run_at_rates(sweep, rate, tell))
        };
        assert_eq!(swept.unwrap().devices, 1);
        let [Found::Device { address: found, rate, .. }] = found[..] else { panic!("{found:?}") };
        assert_eq!((found.get(), rate.bits_per_second()), (9, 19_200));
    }
}

#[test]
fn everything_that_comes_back_is_told() {
    let (five, six) =
        (sensors::t7_with(5, sensors::quick(500_000)), sensors::t7_with(6, sensors::quick(1_500_000)));
    let board = sensors::t7_board(Model::BUFFERED, &[&five, &six]);
    let mut heard = Vec::new();
    let ask = AskAll::new(Request::GetDamping, AskAll::window(SERIAL)).unwrap();
    let all = nb_t7(&board).run_telling(ask, |event| heard.push(event)).unwrap();
    assert_eq!((all.answers, all.collisions), (2, 0));
    let senders: Vec<u8> = heard
        .iter()
        .map(|heard| match heard {
            Heard::Answer(answer) => answer.address.get(),
            Heard::Collision(fault) => panic!("{fault:?}"),
        })
        .collect();
    assert_eq!(senders, [5, 6]);
}

/// A port that fails in the middle: the operation ends, and the error says what the port said.
#[test]
fn a_port_that_fails_is_named() {
    let (_, board) = still();
    board.uart().jam(true);
    let mut t7 = nb_t7(&board);
    let error = t7.run(ChangeAddress::new(address(5), address(6)).unwrap()).unwrap_err();
    assert!(matches!(error, RunError::Port { .. }), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("; the port: the UART did not send within "), "{text}");
}

/// Whoever else is on the line, and however often it is dropped: what is asked for is done by the next call.
#[test]
fn a_setting_survives_a_drop_at_every_wait() {
    let mut cut = 0;
    for polls in 0.. {
        let sensor = sensors::t7(5);
        let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
        let mut t7 = t7_async(&board);
        let first = block_on_polls(&board, polls, t7.set_damping_ms(address(5), 250));
        assert!(!turns(&board).high, "{polls}");
        let second = block_on(&board, t7.set_damping_ms(address(5), 250)).unwrap();
        assert_eq!(sensor.lock().unwrap().settings().damping_ms, 250, "{polls}");
        // The request at rest may be lost with its future; it is never carried out twice.
        assert!(t7.counters().writes <= 2, "{polls}");
        if first.is_some() {
            assert_eq!(second, FlashWrite::Unneeded);
            break;
        }
        cut += 1;
    }
    assert!(cut > 20, "it was dropped at some of its waits: {cut}");
}

#[test]
fn an_address_survives_a_drop_at_every_wait() {
    let mut cut = 0;
    for polls in 0.. {
        let sensor = sensors::t7(5);
        let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
        let mut t7 = t7_async(&board);
        let change = || ChangeAddress::new(address(5), address(6)).unwrap();
        let first = block_on_polls(&board, polls, t7.run(change()));
        assert!(!turns(&board).high, "{polls}");
        // It may have moved, or be about to: then it is looked for at its new address.
        if block_on(&board, t7.run(change())).is_err() {
            let home = ChangeAddress::new(address(6), address(6)).unwrap();
            assert!(
                matches!(block_on(&board, t7.run(home)).unwrap().change, SettingChange::Unchanged(_)),
                "{polls}"
            );
        }
        assert_eq!(sensor.lock().unwrap().settings().address, 6, "{polls}");
        if first.is_some() {
            break;
        }
        cut += 1;
    }
    assert!(cut > 50, "it was dropped at some of its waits: {cut}");
}

/// An ISU's EEPROM takes several commands: dropped between any two, a repair makes it sound, at one address or the other.
#[test]
fn an_eeprom_survives_a_drop_at_every_wait() {
    let every: usize = std::env::var("CLINO_EVERY_WAIT").map_or(61, |_| 1);
    let (from, to) = (module(3), module(7));
    let change = || isu::Program::new(from, Change::ModuleAddress(to.address())).unwrap();
    let mut cut = 0;
    for polls in (0..).step_by(every) {
        let sensor = sensors::isu(3, 90_000_000);
        let board = sensors::isu_board(Model::BUFFERED, &[&sensor]);
        let mut isu = isu_async(&board);
        let first = block_on_polls(&board, polls, isu.run(change()));
        assert!(!turns(&board).high, "{polls}");
        if first.is_none() {
            block_on(&board, isu.run(isu::Repair::after_address_change(from, to))).unwrap();
        }
        let at = [from, to].into_iter().find(|at| block_on(&board, isu.angle(at.address())).is_ok()).unwrap();
        let identity = block_on(&board, isu.run(isu::Identify::new(at))).unwrap();
        let readings = [ChecksumReading::UpperBitsCounted, ChecksumReading::WordsLeftOut];
        assert!(readings.iter().any(|&reading| identity.audit.holds(reading)), "{polls}: {identity:?}");
        if first.is_some() {
            break;
        }
        cut += 1;
    }
    assert!(cut > 5, "it was dropped at some of its waits: {cut}");
}

#[test]
fn a_baud_rate_is_changed() {
    let (sensor, board) = still();
    let device = Device::single(SingleDevice::i_have_attached_one_sensor_only());
    let operation = ChangeBaud::new(device, BaudRate::B115200, BaudRate::B57600).unwrap();
    let uart = board.uart();
    let rate = |line: &mut NbLine, serial: Serial| {
        uart.set_baud(serial.baud);
        line.set_settings(PortSettings::new(serial));
        Ok(Timing::t7(serial))
    };
    let mut t7 = nb_t7(&board);
    t7.run_at_rates(operation, rate, |_| ()).unwrap();
    assert_eq!(t7.timing().serial.baud, 57_600);
    assert!(t7.angle(address(5), Axis::Two).is_ok());
    assert_eq!(sensor.lock().unwrap().settings().baud_index, 1);
}

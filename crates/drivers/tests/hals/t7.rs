//! Everything that a T7's driver does, on every HAL.

use clino_drivers::codec::angle::Range;
use clino_drivers::codec::t7::{Axis, BaudRate, Direction, Request, Response};
use clino_drivers::commissioning::t7::{
    AskAll, ChangeAddress, ChangeBaud, Device, DeviceSetting, Found, Identify, Rates, Set, Sweep,
};
use clino_drivers::t7::FlashWrite;
use clino_drivers::uart::{Io, Nb};
use clino_drivers::{Rs485, Serial, UsDigitalT7, asynch};
use clino_sim::motion::Motion;

use super::*;
use crate::common::executor::block_on;
use crate::support::{US, turns};

/// One that stands at 12.345°, and answers before the other.
fn still(number: u8) -> sensors::SharedT7 {
    let mut options = sensors::quick(500 * US);
    options.motion[2] = Motion::Constant(12_345_000);
    sensors::t7_with(number, options)
}

/// Number 5 turns, number 9 stands. `$rate` sets another bit rate.
macro_rules! everything {
    ($t7:ident, $row:ident, $board:ident, $wait:ident, $rate:ident, $times:expr) => {{
        let (five, six, nine) = (address(5), address(6), address(9));
        for _ in 0..$times {
            let angle = $wait!($t7.angle(five, Axis::Two)).unwrap();
            assert!(is_true(&$board, angle, $row), "{}: {angle}", $row.name);
            let angle = $wait!($t7.all_data(five)).unwrap().angles[2];
            assert!(is_true(&$board, angle, $row), "{}: {angle}", $row.name);
            assert_eq!($wait!($t7.information(five)).unwrap().serial, 25_033);
        }
        let angle = $wait!($t7.all_angles(five)).unwrap().angles[2];
        assert!(is_true(&$board, angle, $row), "{}: {angle}", $row.name);

        // Settings: as they are, as they are set, and read back.
        let mdeg = |mdeg| Angle::from_mdeg(mdeg).unwrap();
        assert_eq!($wait!($t7.offsets(nine)), Ok([Angle::ZERO; 3]));
        assert_eq!($wait!($t7.directions(nine)), Ok([Direction::Normal; 3]));
        assert_eq!($wait!($t7.damping_ms(nine)), Ok(1_000));
        assert_eq!($wait!($t7.range(nine)), Ok(Range::Bidirectional));
        for expected in [FlashWrite::Written, FlashWrite::Unneeded] {
            assert_eq!($wait!($t7.set_direction(nine, Axis::Two, Direction::Reversed)), Ok(expected));
            assert_eq!($wait!($t7.set_range(nine, Range::Unidirectional)), Ok(expected));
            assert_eq!($wait!($t7.set_offset(nine, Axis::Two, mdeg(20_000))), Ok(expected));
            assert_eq!($wait!($t7.set_damping_ms(nine, 250)), Ok(expected));
        }
        assert_eq!($wait!($t7.angle(nine, Axis::Two)), Ok(mdeg(20_000 - 12_345)));
        assert_eq!(
            $wait!($t7.transact(nine, &Request::GetDamping)),
            Ok(Response::GetDamping { damping_ms: 250 })
        );

        // Operations.
        let device = |address| Device::at(address).unwrap();
        assert_eq!($wait!($t7.zero(nine, Axis::Two)).unwrap().after.0, 0);
        let set = Set::new(device(nine), DeviceSetting::Damping(2)).unwrap();
        assert_eq!($wait!($t7.run(set)).unwrap().writes, 1);
        let identity = $wait!($t7.run(Identify::new(device(nine)).unwrap())).unwrap();
        assert_eq!((identity.damping_ms, identity.range), (2, Range::Unidirectional));
        let ask = AskAll::new(Request::GetDamping, AskAll::window(SERIAL)).unwrap();
        let mut heard = 0;
        assert_eq!($wait!($t7.run_telling(ask, |_| heard += 1)).unwrap().answers, 2, "{}", $row.name);
        assert_eq!(heard, 2);
        $wait!($t7.run(ChangeAddress::new(five, six).unwrap())).unwrap();
        assert!($wait!($t7.angle(five, Axis::Two)).is_err());
        assert!(is_true(&$board, $wait!($t7.angle(six, Axis::Two)).unwrap(), $row));

        // Another bit rate for one, at which a sweep finds it alone.
        let change = ChangeBaud::new(device(nine), BaudRate::B115200, BaudRate::B57600).unwrap();
        $wait!($t7.run_at_rates(change, &$rate, |_| ())).unwrap();
        let sweep = Sweep::new(Serial { baud: 57_600 }, Rates::NONE.and(BaudRate::B57600));
        let mut found = Vec::new();
        $wait!($t7.run_at_rates(sweep, &$rate, |event| found.push(event))).unwrap();
        let [Found::Device { address, .. }] = found[..] else { panic!("{}: {found:?}", $row.name) };
        assert_eq!(address, nine);

        let counters = *$t7.counters();
        assert_eq!((counters.late, counters.bad_answer, counters.retries), (0, 0, 0), "{}", $row.name);
    }};
}

on_every_hal!(on);

fn on(row: &Row, echo: Echo, how: Use) {
    let stations = [sensors::t7(5), still(9)].map(|sensor| sensors::station("t7", sensor));
    let board = board(row, 115_200, echo == Echo::Expected, stations.into());
    let (settings, timing) = (row.settings(SERIAL, echo), row.t7_timing(SERIAL));
    let (uart, hardware) = (board.uart(), board.uart());
    // What an echo adds shows at once.
    let times = if echo == Echo::Off { TIMES } else { 3 };
    match how {
        Use::Nb => {
            let line = Rs485::new(Nb::new(uart), board.de(), board.delay(), settings);
            let mut t7 = UsDigitalT7::new(line, timing);
            let rate = |line: &mut Rs485<Nb<_>, _, _>, serial: Serial| {
                hardware.set_baud(serial.baud);
                line.set_settings(row.settings(serial, echo));
                Ok(row.t7_timing(serial))
            };
            everything!(t7, row, board, directly, rate, times);
        }
        Use::Io => {
            let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
            let mut t7 = UsDigitalT7::new(line, timing);
            let rate = |line: &mut Rs485<Io<_>, _, _>, serial: Serial| {
                hardware.set_baud(serial.baud);
                line.set_settings(row.settings(serial, echo));
                Ok(row.t7_timing(serial))
            };
            everything!(t7, row, board, directly, rate, times);
        }
        Use::Async => {
            let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
            let mut t7 = asynch::UsDigitalT7::new(line, timing);
            let rate = async |line: &mut crate::support::IoLine, serial: Serial| {
                hardware.set_baud(serial.baud);
                line.set_settings(row.settings(serial, echo));
                Ok(row.t7_timing(serial))
            };
            macro_rules! wait {
                ($call:expr) => {
                    block_on(&board, $call)
                };
            }
            everything!(t7, row, board, wait, rate, times);
        }
    }
    let turns = turns(&board);
    assert!(turns.all_clean() && !turns.high, "{}", row.name);
}

/// A method that is added is called here, too.
#[test]
fn every_method_is_called() {
    super::every_method_is_called(include_str!("../../src/t7.rs"), include_str!("t7.rs"), "t7");
}

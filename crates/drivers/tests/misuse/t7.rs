//! Mistakes with a T7.

use std::sync::{Arc, Mutex};

use clino_drivers::codec::angle::Angle;
use clino_drivers::codec::t7::{Address, Axis, Direction};
use clino_drivers::commissioning::t7::ChangeAddress;
use clino_drivers::{PortSettings, Serial};
use clino_sim::t7 as sim_t7;

use super::*;
use crate::support::{SERIAL, US, address};

/// A T7 that is level.
fn level(address: u8, identity: sim_t7::Identity) -> Station {
    let settings = sim_t7::StoredSettings { address, ..Default::default() };
    let node = sim_t7::T7::new(identity, settings, sim_t7::Options::default()).unwrap();
    sensors::station("t7", Arc::new(Mutex::new(node)))
}

/// A three-axis T7 that is level.
fn three_axes(address: u8) -> Station {
    level(address, sim_t7::Identity { model: sim_t7::Model::T73, product: *b"T7-3  ", ..Default::default() })
}

fn five() -> Vec<Station> {
    vec![sensors::station("t7", sensors::t7(5))]
}

#[test]
fn no_sensor_at_all() {
    for how in BOTH {
        let board = board(115_200, vec![]);
        let expected = format!("no answer within 2174 µs: {NEVER_ANSWERED}");
        says(how, T7::new(how, &board).angle(address(5)), &expected);
    }
}

#[test]
fn another_address() {
    for how in BOTH {
        let board = board(115_200, five());
        let mut t7 = T7::new(how, &board);
        t7.angle(address(5)).unwrap();
        // An async driver listens in pieces.
        let waited = if how == Use::Blocking { 2174 } else { 2262 };
        says(how, t7.angle(address(6)), &format!("no answer within {waited} µs: {SILENT}"));
    }
}

#[test]
fn another_bit_rate() {
    for how in BOTH {
        for baud in [57_600, 38_400, 19_200, 9_600] {
            let board = board(baud, five());
            let mut t7 = T7::with(how, &board, PortSettings::new(Serial { baud }));
            ends(how, t7.angle(address(5)), "no answer within ", NEVER_ANSWERED);
        }
    }
}

#[test]
fn the_uart_runs_at_another_rate_than_the_port() {
    for how in BOTH {
        let stuck = |micros| {
            format!(
                "not sent whole: the UART did not send within {micros} µs: its transmitter is off, or it runs at a \
                 lower bit rate than `PortSettings` says"
            )
        };
        let board_at_9600 = board(9_600, five());
        let mut t7 = T7::new(how, &board_at_9600);
        match how {
            Use::Blocking => says(how, t7.angle(address(5)), &stuck(435)),
            // An executor may be busy for 20 ms; three characters take 3.
            Use::Async => {
                says(how, t7.angle(address(5)), &format!("no answer within 2174 µs: {NEVER_ANSWERED}"))
            }
        }
        let board_at_1200 = board(1_200, five());
        let waited = if how == Use::Blocking { 435 } else { 20_435 };
        says(how, T7::new(how, &board_at_1200).angle(address(5)), &stuck(waited));
    }
}

/// What comes has no stop bits.
#[test]
fn something_at_a_lower_bit_rate() {
    for how in BOTH {
        let board = board(115_200, vec![printing()]);
        let mut t7 = T7::new(how, &board);
        let errors: Vec<String> = (0..400).filter_map(|_| t7.angle(address(5)).err()).collect();
        // An `embedded_io` UART does not name what is wrong with a character.
        let expected = if how == Use::Blocking { LINE_LOW } else { COLLISION };
        assert!(errors.iter().any(|error| error.ends_with(expected)), "{how:?}: {:#?}", errors.last());
    }
}

#[test]
fn a_line_upside_down() {
    for how in BOTH {
        let board = board_upside_down(115_200);
        let expected = if how == Use::Blocking { LINE_LOW } else { COLLISION };
        ends(how, T7::new(how, &board).angle(address(5)), "no frame in ", expected);
    }
}

#[test]
fn the_bus_of_an_isu() {
    for how in BOTH {
        let board = board(115_200, vec![sensors::station("isu", sensors::isu(3, 0))]);
        says(
            how,
            T7::new(how, &board).angle(address(3)),
            &format!("no answer within 2174 µs: {NEVER_ANSWERED}"),
        );
    }
}

/// A dead sensor; a live one is heard all the same.
#[test]
fn an_echo_that_was_not_announced() {
    for how in BOTH {
        let board = board_with_echo(115_200, five());
        let mut t7 = T7::new(how, &board);
        for _ in 0..2 {
            ends(how, t7.angle(address(6)), "no answer within ", OWN_ECHO);
            assert!(t7.damping_ms(address(5)).is_ok());
        }
        // A longer command, of which a driver keeps the beginning.
        ends(how, t7.set_damping_ms(address(6), 250), "no answer within ", OWN_ECHO);
    }
}

#[test]
fn an_echo_that_does_not_come() {
    for how in BOTH {
        let board = board(115_200, five());
        says(
            how,
            T7::with(how, &board, echo_expected(SERIAL)).angle(address(5)),
            "not sent whole: character 0, 05, did not come back: set `Echo::Off` if /RE is tied to DE, or \
             `PortSettings::handover` if the receiver is late",
        );
    }
}

/// Two sensors fresh from the factory.
#[test]
fn two_sensors_at_one_address() {
    for how in BOTH {
        let twins = [900, 907].map(|latency| sensors::t7_with(5, sensors::quick(latency * US)));
        let board = board(115_200, twins.map(|twin| sensors::station("t7", twin)).into());
        ends(how, T7::new(how, &board).angle(address(5)), "", COLLISION);
    }
}

#[test]
fn an_address_that_is_taken() {
    for how in BOTH {
        let other = level(6, sim_t7::Identity { serial: 25_034, ..Default::default() });
        let board = board(115_200, vec![sensors::station("t7", sensors::t7(5)), other]);
        let mut t7 = T7::new(how, &board);
        let operation = ChangeAddress::new(address(5), address(6)).unwrap();
        says(how, t7.change_address(operation), "address 6 is taken by serial number 25034 (writes sent: 0)");
        assert_eq!(t7.writes(), 0);
    }
}

#[test]
fn a_line_that_is_released_early() {
    for how in BOTH {
        let model = Model { flush: Flush::Never, ..Model::BUFFERED };
        let board = Board::new(115_200, model, sensors::quiet(), five());
        let mut t7 = T7::new(how, &board);
        let expected = format!("no answer within 2174 µs: {NEVER_ANSWERED}");
        for _ in 0..3 {
            says(how, t7.angle(address(5)), &expected);
        }
    }
}

#[test]
fn a_receiver_that_hands_over_late() {
    let fifo = Handover::Fifo { threshold: 28, silence: 32 };
    for (handover, baud) in [
        (fifo, 115_200),
        (fifo, 9_600),
        (Handover::Packets { period: 16 * MS }, 115_200),
        (Handover::Packets { period: 16 * MS }, 9_600),
    ] {
        for how in BOTH {
            let model = Model { handover, ..Model::BUFFERED };
            let index = sim_t7::BAUD_RATES.iter().position(|&rate| rate == baud).unwrap();
            let settings =
                sim_t7::StoredSettings { baud_index: index as u8, address: 5, ..Default::default() };
            let node = sim_t7::T7::new(sim_t7::Identity::default(), settings, sensors::turning()).unwrap();
            let stations = vec![sensors::station("t7", Arc::new(Mutex::new(node)))];
            let board = Board::new(baud, model, sensors::quiet(), stations);
            let mut t7 = T7::with(how, &board, PortSettings::new(Serial { baud }));
            // The first answer that comes late shows it.
            let last = (0..10).map(|_| t7.all_data(address(5))).last().unwrap();
            ends(how, last, "", LATE);
        }
    }
}

#[test]
fn a_line_that_is_never_silent() {
    for how in BOTH {
        let board = board_with_babble(115_200, sensors::t7(6));
        says(how, T7::new(how, &board).angle(address(5)), NOT_SILENT);
    }
}

/// The all-respond address on a line that may have several sensors.
#[test]
fn all_sensors_at_once() {
    for how in BOTH {
        let board = board(115_200, five());
        let mut t7 = T7::new(how, &board);
        says(
            how,
            t7.angle(Address::ALL),
            "not sent: all T7s of the line would answer at once; make the driver with `single` if there is one",
        );
        says(
            how,
            t7.zero(Address::ALL, Axis::Two),
            "not sent: all sensors of the line have this address; make the driver with `single` if there is one",
        );
    }
}

/// A single-axis T7 answers zero for the axes that it does not have, whether it is asked or set. A three-axis T7 that is
/// level does, too.
#[test]
fn an_axis_that_is_not_there() {
    for how in BOTH {
        for axis in [Axis::Zero, Axis::One] {
            let board = board(115_200, five());
            let mut t7 = T7::new(how, &board);
            let expected =
                format!("a single-axis T7 has axis 2 only: its zero for axis {} is no angle", axis.get());
            says(how, t7.angle_of(address(5), axis), &expected);
            for offset in [0, 1_000] {
                let offset = Angle::from_mdeg(offset).unwrap();
                says(how, t7.set_offset(address(5), axis, offset), &expected);
            }
            for direction in [Direction::Normal, Direction::Reversed] {
                says(how, t7.set_direction(address(5), axis, direction), &expected);
            }
            says(how, t7.zero(address(5), axis), &format!("{expected} (writes sent: 0)"));
            assert_eq!(t7.writes(), 0);
        }
        for axis in Axis::ALL {
            let board = board(115_200, vec![three_axes(5)]);
            let mut t7 = T7::new(how, &board);
            assert_eq!(t7.angle_of(address(5), axis).unwrap(), Angle::ZERO);
            t7.set_direction(address(5), axis, Direction::Reversed).unwrap();
            t7.set_offset(address(5), axis, Angle::from_mdeg(1_000).unwrap()).unwrap();
            assert_eq!(t7.angle_of(address(5), axis).unwrap().mdeg(), 1_000);
            assert_eq!(t7.zero(address(5), axis), Ok(0));
        }
    }
}

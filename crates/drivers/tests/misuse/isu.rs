//! Mistakes with an ISU.

use std::sync::{Arc, Mutex};

use clino_drivers::PortSettings;
use clino_drivers::codec::isu::eeprom::Change;
use clino_drivers::commissioning::isu::{Module as OneModule, Program};
use clino_sim::latency::Latency;
use clino_sim::motion::Motion;

use super::*;

fn module(number: u8) -> Module {
    Module::new(number).unwrap()
}

fn three() -> Vec<Station> {
    vec![sensors::station("isu", sensors::isu(3, 90_000_000))]
}

/// A module that answers after this time, nanoseconds, and is tilted by this many micro-degrees.
fn answering_after(latency: u64, angle: i64) -> Station {
    let content = sim_isu::Content { address: 3, ..Default::default() };
    let eeprom = sim_isu::Eeprom::factory(content, sim_isu::ChecksumScope::default(), 1);
    let options = sim_isu::Options {
        motion: Motion::Constant(angle),
        latency: Latency::fixed(latency),
        ..Default::default()
    };
    sensors::station("isu", Arc::new(Mutex::new(sim_isu::Isu::new(eeprom, options))))
}

#[test]
fn no_sensor_at_all() {
    for how in BOTH {
        let board = board(9_600, vec![]);
        let expected = format!("no answer within 53084 µs: {NEVER_ANSWERED}");
        says(how, Isu::new(how, &board).angle(module(3)), &expected);
    }
}

#[test]
fn another_address() {
    for how in BOTH {
        let board = board(9_600, three());
        let mut isu = Isu::new(how, &board);
        isu.angle(module(3)).unwrap();
        says(how, isu.angle(module(4)), &format!("no answer within 53084 µs: {SILENT}"));
    }
}

/// An ISU has one bit rate: the line has another.
#[test]
fn another_bit_rate() {
    for how in BOTH {
        for baud in [19_200, 38_400, 115_200] {
            let board = board(baud, three());
            let mut isu = Isu::with(how, &board, PortSettings::new(Serial { baud }));
            says(how, isu.angle(module(3)), &format!("no answer within 53084 µs: {NEVER_ANSWERED}"));
        }
    }
}

#[test]
fn the_uart_runs_at_another_rate_than_the_port() {
    for how in BOTH {
        let board = board(1_200, three());
        ends(
            how,
            Isu::new(how, &board).angle(module(3)),
            "not sent whole: the UART did not send within ",
            "its transmitter is off, or it runs at a lower bit rate than `PortSettings` says",
        );
    }
}

#[test]
fn a_line_upside_down() {
    for how in BOTH {
        let board = board_upside_down(9_600);
        let expected = if how == Use::Blocking { LINE_LOW } else { COLLISION };
        ends(how, Isu::new(how, &board).angle(module(3)), "no frame in ", expected);
    }
}

#[test]
fn the_bus_of_a_t7() {
    for how in BOTH {
        let board = board(9_600, vec![sensors::station("t7", sensors::t7(3))]);
        says(
            how,
            Isu::new(how, &board).angle(module(3)),
            &format!("no answer within 53084 µs: {NEVER_ANSWERED}"),
        );
    }
}

#[test]
fn a_module_that_prints_lines() {
    for how in BOTH {
        let board = board(9_600, vec![printing()]);
        let mut isu = Isu::new(how, &board);
        let last = (0..5).map(|_| isu.angle(module(3))).last().unwrap();
        ends(
            how,
            last,
            "",
            "an ISU prints lines of text: its RX was low when it started; keep RX high and start it again",
        );
    }
}

/// A dead module; a live one is heard all the same.
#[test]
fn an_echo_that_was_not_announced() {
    for how in BOTH {
        let board = board_with_echo(9_600, three());
        let mut isu = Isu::new(how, &board);
        for _ in 0..2 {
            ends(how, isu.angle(module(4)), "no answer within ", OWN_ECHO);
            assert!(isu.angle(module(3)).is_ok());
        }
        // A longer command.
        ends(how, isu.read_eeprom(module(4), 0x48, 2), "no answer within ", OWN_ECHO);
    }
}

#[test]
fn an_echo_that_does_not_come() {
    for how in BOTH {
        let board = board(9_600, three());
        says(
            how,
            Isu::with(how, &board, echo_expected(Serial::ISU)).angle(module(3)),
            "not sent whole: character 0, 03, did not come back: set `Echo::Off` if /RE is tied to DE, or \
             `PortSettings::handover` if the receiver is late",
        );
    }
}

/// Two modules at one address: their answers overlap by half a bit more than whole characters.
#[test]
fn two_sensors_at_one_address() {
    for how in BOTH {
        let twins = [answering_after(5_000_000, 90_000_000), answering_after(5_350_000, 45_000_000)];
        let board = board(9_600, twins.into());
        ends(how, Isu::new(how, &board).angle(module(3)), "", COLLISION);
    }
}

#[test]
fn an_address_that_is_taken() {
    for how in BOTH {
        let stations = [3, 7].map(|number| sensors::station("isu", sensors::isu(number, 0)));
        let board = board(9_600, stations.into());
        let mut isu = Isu::new(how, &board);
        let change = Change::ModuleAddress(module(7));
        let operation = Program::new(OneModule::at(module(3)).unwrap(), change).unwrap();
        says(how, isu.program(operation), "another module answers at address 7 (writes sent: 0)");
        assert_eq!(isu.writes(), 0);
    }
}

#[test]
fn a_line_that_is_released_early() {
    for how in BOTH {
        let model = Model { flush: Flush::Never, ..Model::BUFFERED };
        let board = Board::new(9_600, model, sensors::quiet(), three());
        let mut isu = Isu::new(how, &board);
        let expected = format!("no answer within 53084 µs: {NEVER_ANSWERED}");
        for _ in 0..3 {
            says(how, isu.angle(module(3)), &expected);
        }
    }
}

/// A module that takes as long as an ISU may, behind a receiver that keeps what it has.
#[test]
fn a_receiver_that_hands_over_late() {
    for handover in [Handover::Fifo { threshold: 28, silence: 200 }, Handover::Packets { period: 64 * MS }] {
        for how in BOTH {
            let model = Model { handover, ..Model::BUFFERED };
            let stations = vec![answering_after(45_000_000, 90_000_000)];
            let board = Board::new(9_600, model, sensors::quiet(), stations);
            let mut isu = Isu::new(how, &board);
            let late: Vec<String> = (0..10).filter_map(|_| isu.angle(module(3)).err()).collect();
            assert!(late.iter().any(|text| text.ends_with(LATE)), "{how:?}: {late:#?}");
        }
    }
}

#[test]
fn a_line_that_is_never_silent() {
    for how in BOTH {
        let board = board_with_babble(9_600, sensors::isu(4, 0));
        says(how, Isu::new(how, &board).angle(module(3)), NOT_SILENT);
    }
}

/// The address of all modules on a line that may have several.
#[test]
fn all_sensors_at_once() {
    for how in BOTH {
        let board = board(9_600, three());
        let mut isu = Isu::new(how, &board);
        says(
            how,
            isu.angle(Module::ANY),
            "not sent: all ISUs of the line would answer at once; make the driver with `single` if there is one",
        );
        says(
            how,
            isu.zero(Module::ANY),
            "not sent: all sensors of the line have this address; make the driver with `single` if there is one",
        );
    }
}

//! What goes wrong on the first evening, one mistake each: the message names the probable cause and the next step.
//!
//! Expected texts are written out: they are what a user reads.
#![cfg(all(feature = "embedded-io", feature = "nb", feature = "commissioning"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use std::fmt::Display;
use std::sync::{Arc, Mutex};

use clino_drivers::codec::isu::Address as Module;
use clino_drivers::codec::t7::Axis;
use clino_drivers::commissioning::t7::ChangeAddress;
use clino_drivers::rs485::Echo;
use clino_drivers::{PortSettings, Serial, SttIsu, Timing, UsDigitalT7};
use clino_segment::{LineFaults, SegmentSettings, Station, StuckLine};
use clino_sim::isu as sim_isu;
use common::{Board, Model, sensors};
use support::{MS, NbLine, US, address, nb_line};

const NEVER_ANSWERED: &str = "no sensor has answered yet; check the supply, the address, the bit rate, A and B, and \
    that DE stays high until the last stop bit: `flush` of some UARTs returns early, see `Release`";
const COLLISION: &str = "answers come, and no good one yet: two sensors have one address, or the line is bad; connect \
    one sensor alone, then check the termination";

const LINE_LOW: &str = "the line is low for whole characters: swap A and B, give it a bias, or look for something that \
    sends at a lower bit rate";

/// A pair on which the master may hear itself.
fn board_with(baud: u32, echo: bool, stations: Vec<Station>) -> Board {
    Board::new(baud, Model::BUFFERED, SegmentSettings { echo, ..sensors::quiet() }, stations)
}

/// A T7's driver at this bit rate.
fn t7_at(board: &Board, baud: u32, echo: Echo) -> UsDigitalT7<NbLine> {
    let serial = Serial { baud };
    let line = nb_line(board, PortSettings { echo, ..PortSettings::new(serial) });
    UsDigitalT7::new(line, Timing::t7(serial))
}

/// A T7 that is level.
fn t7_node(address: u8, identity: clino_sim::t7::Identity) -> sensors::SharedT7 {
    let settings = clino_sim::t7::StoredSettings { address, ..Default::default() };
    let node = clino_sim::t7::T7::new(identity, settings, clino_sim::t7::Options::default()).unwrap();
    Arc::new(Mutex::new(node))
}

fn isu_on(board: &Board) -> SttIsu<NbLine> {
    SttIsu::new(nb_line(board, PortSettings::new(Serial::ISU)), Timing::isu())
}

fn module(number: u8) -> Module {
    Module::new(number).unwrap()
}

/// What a user reads.
#[track_caller]
fn says<T: std::fmt::Debug>(result: Result<T, impl Display>, expected: &str) {
    let text = result.map_err(|error| error.to_string());
    match text {
        Ok(value) => panic!("{value:?} instead of an error"),
        Err(text) => assert_eq!(text, expected),
    }
}

#[test]
fn no_sensor_at_all() {
    let board = board_with(115_200, false, vec![]);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    says(t7.angle(address(5), Axis::Two), &format!("no answer within 2174 µs: {NEVER_ANSWERED}"));
    let board = board_with(9_600, false, vec![]);
    says(isu_on(&board).angle(module(3)), &format!("no answer within 53084 µs: {NEVER_ANSWERED}"));
}

#[test]
fn another_address() {
    let stations = vec![sensors::station("t7", sensors::t7(5))];
    let board = board_with(115_200, false, stations);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    t7.angle(address(5), Axis::Two).unwrap();
    says(
        t7.angle(address(6), Axis::Two),
        "no answer within 2174 µs: other requests were answered; check supply, cable and address of this sensor",
    );
}

/// The receiver is on while we send, and `Echo::Off` says that it is not. A live sensor is heard all the same.
#[test]
fn an_echo_that_was_not_announced() {
    const OWN_ECHO: &str = "only our own frame came back: the sensor is silent, and the receiver is on while we send; set \
        `Echo::Expected`, or tie /RE to DE";
    let board = board_with(115_200, true, vec![sensors::station("t7", sensors::t7(5))]);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    for _ in 0..2 {
        let error = t7.angle(address(6), Axis::Two).unwrap_err().to_string();
        assert!(error.starts_with("no answer within ") && error.ends_with(OWN_ECHO), "{error}");
        assert!(t7.damping_ms(address(5)).is_ok());
    }
    // A longer command, of which a driver keeps the beginning.
    says(
        t7.set_damping_ms(address(6), 250)
            .map_err(|error| error.to_string().split_off(error.to_string().len() - OWN_ECHO.len())),
        OWN_ECHO,
    );
    let board = board_with(9_600, true, vec![]);
    let error = isu_on(&board).angle(module(3)).unwrap_err().to_string();
    assert!(error.starts_with("no answer within ") && error.ends_with(OWN_ECHO), "{error}");
}

#[test]
fn an_echo_that_does_not_come() {
    let board = board_with(115_200, false, vec![sensors::station("t7", sensors::t7(5))]);
    says(
        t7_at(&board, 115_200, Echo::Expected).angle(address(5), Axis::Two),
        "not sent whole: character 0, 05, did not come back: set `Echo::Off` if /RE is tied to DE, or \
         `PortSettings::handover` if the receiver is late",
    );
}

/// Two sensors fresh from the factory.
#[test]
fn two_sensors_at_one_address() {
    let twins =
        [sensors::t7_with(5, sensors::quick(900 * US)), sensors::t7_with(5, sensors::quick(907 * US))];
    let stations = twins.map(|twin| sensors::station("t7", twin));
    let board = board_with(115_200, false, stations.into());
    let error = t7_at(&board, 115_200, Echo::Off).angle(address(5), Axis::Two).unwrap_err().to_string();
    assert!(error.ends_with(COLLISION), "{error}");
}

#[test]
fn another_bit_rate() {
    for baud in [57_600, 38_400, 19_200, 9_600] {
        let board = board_with(baud, false, vec![sensors::station("t7", sensors::t7(5))]);
        let error = t7_at(&board, baud, Echo::Off).angle(address(5), Axis::Two).unwrap_err().to_string();
        assert!(error.ends_with(NEVER_ANSWERED), "{baud}: {error}");
    }
}

/// What comes has no stop bits.
#[test]
fn something_at_a_lower_bit_rate() {
    let stations = vec![sensors::station("isu", sim_isu::RxLow::new(printing()))];
    let board = board_with(115_200, false, stations);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    let errors: Vec<String> = (0..400)
        .filter_map(|_| t7.angle(address(5), Axis::Two).err())
        .map(|error| error.to_string())
        .collect();
    assert!(errors.iter().any(|error| error.ends_with(LINE_LOW)), "{:#?}", errors.last());
}

#[test]
fn the_uart_runs_at_another_rate_than_the_port() {
    let board = board_with(9_600, false, vec![sensors::station("t7", sensors::t7(5))]);
    says(
        t7_at(&board, 115_200, Echo::Off).angle(address(5), Axis::Two),
        "not sent whole: the UART did not send within 435 µs: its transmitter is off, or it runs at a lower bit rate \
         than `PortSettings` says",
    );
}

/// A and B swapped, or no bias: the line is low where it should be high.
#[test]
fn a_line_upside_down() {
    let low = StuckLine { high: false, from: MS, until: 100 * MS };
    let faults = LineFaults { stuck: vec![low], ..Default::default() };
    let board = Board::with_faults(115_200, Model::BUFFERED, sensors::quiet(), vec![], faults);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    let error = t7.angle(address(5), Axis::Two).unwrap_err().to_string();
    assert!(error.ends_with(LINE_LOW), "{error}");
}

/// Each driver on the other's pair.
#[test]
fn swapped_buses() {
    let board = board_with(115_200, false, vec![sensors::station("isu", sensors::isu(3, 0))]);
    let error = t7_at(&board, 115_200, Echo::Off).angle(address(3), Axis::Two).unwrap_err().to_string();
    assert!(error.ends_with(NEVER_ANSWERED), "{error}");
    let board = board_with(9_600, false, vec![sensors::station("t7", sensors::t7(3))]);
    let error = isu_on(&board).angle(module(3)).unwrap_err().to_string();
    assert!(error.ends_with(NEVER_ANSWERED), "{error}");
}

fn printing() -> sim_isu::Isu {
    let content = sim_isu::Content { address: 3, ..Default::default() };
    let eeprom = sim_isu::Eeprom::factory(content, sim_isu::ChecksumScope::default(), 1);
    sim_isu::Isu::new(eeprom, sim_isu::Options::default())
}

#[test]
fn an_isu_that_prints_lines() {
    let board = board_with(9_600, false, vec![sensors::station("isu", sim_isu::RxLow::new(printing()))]);
    let mut isu = isu_on(&board);
    let texts: Vec<String> =
        (0..5).filter_map(|_| isu.angle(module(3)).err()).map(|error| error.to_string()).collect();
    let expected =
        "an ISU prints lines of text: its RX was low when it started; keep RX high and start it again";
    assert!(texts.last().is_some_and(|text| text.ends_with(expected)), "{texts:#?}");
}

#[test]
fn an_address_that_is_taken() {
    let other = t7_node(6, clino_sim::t7::Identity { serial: 25_034, ..Default::default() });
    let stations = vec![sensors::station("t7", sensors::t7(5)), sensors::station("t7", other)];
    let board = board_with(115_200, false, stations);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    let operation = ChangeAddress::new(address(5), address(6)).unwrap();
    says(t7.run(operation), "address 6 is taken by serial number 25034 (writes sent: 0)");
    assert_eq!(t7.counters().writes, 0);
}

/// A single-axis T7 answers zero for the axes that it does not have. A three-axis T7 that is level does, too.
#[test]
fn an_axis_that_is_not_there() {
    let board = board_with(115_200, false, vec![sensors::station("t7", sensors::t7(5))]);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    says(
        t7.angle(address(5), Axis::Zero),
        "a single-axis T7 has axis 2 only: its zero for axis 0 is no angle",
    );
    says(
        t7.angle(address(5), Axis::One),
        "a single-axis T7 has axis 2 only: its zero for axis 1 is no angle",
    );
    let model = clino_sim::t7::Model::T73;
    let level = t7_node(5, clino_sim::t7::Identity { model, product: *b"T7-3  ", ..Default::default() });
    let board = board_with(115_200, false, vec![sensors::station("t7", level)]);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    for axis in [Axis::Zero, Axis::One, Axis::Two] {
        assert_eq!(t7.angle(address(5), axis).unwrap().mdeg(), 0);
    }
}

/// The bus of a T7 whose driver is on all the time.
#[test]
fn a_line_that_is_never_silent() {
    let babble = clino_segment::Babble { from: 0, until: 300 * MS, gap: 0 };
    let faults = clino_segment::Faults { babble: vec![babble], ..Default::default() };
    let node = Box::new(sensors::t7(6));
    let board = board_with(115_200, false, vec![Station { name: "babbler".into(), node, faults }]);
    board.pass(3 * MS);
    says(
        t7_at(&board, 115_200, Echo::Off).angle(address(5), Axis::Two),
        "not sent: the line did not fall silent; look for another master, a sensor that does not stop sending, and a \
         line without bias",
    );
}

/// The all-respond address on a line that may have several sensors.
#[test]
fn everybody_at_once() {
    let all = clino_drivers::codec::t7::Address::ALL;
    let board = board_with(115_200, false, vec![sensors::station("t7", sensors::t7(5))]);
    let mut t7 = t7_at(&board, 115_200, Echo::Off);
    says(
        t7.angle(all, Axis::Two),
        "not sent: all T7s of the line would answer at once; make the driver with `single` if there is one",
    );
    says(
        t7.zero(all, Axis::Two),
        "not sent: all sensors of the line have this address; make the driver with `single` if there is one",
    );
    let board = board_with(9_600, false, vec![]);
    says(
        isu_on(&board).angle(Module::ANY),
        "not sent: all ISUs of the line would answer at once; make the driver with `single` if there is one",
    );
}

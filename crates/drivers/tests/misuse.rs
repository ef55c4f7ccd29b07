//! The first evening: every mistake, and the message that the user then reads. It is the test's expectation; both sensors, and
//! blocking and async drivers, where a receiver error has no name.
#![cfg(all(feature = "embedded-io", feature = "nb", feature = "commissioning", feature = "async"))]

#[path = "../examples/common/mod.rs"]
mod common;
#[path = "misuse/isu.rs"]
mod isu;
mod support;
#[path = "misuse/t7.rs"]
mod t7;

use std::fmt::Debug;

use clino_drivers::codec::angle::Angle;
use clino_drivers::codec::isu::Address as Module;
use clino_drivers::codec::t7::{Address, Axis, Direction};
use clino_drivers::commissioning::isu::Program;
use clino_drivers::commissioning::t7::ChangeAddress;
use clino_drivers::rs485::Echo;
use clino_drivers::{PortSettings, Serial, SttIsu, Timing, UsDigitalT7, asynch};
use clino_segment::{LineFaults, SegmentSettings, Station, StuckLine};
use clino_sim::isu as sim_isu;
use common::executor::block_on;
use common::uart::{Flush, Handover};
use common::{Board, Model, sensors};
use support::{IoLine, MS, NbLine, io_line, nb_line};

const NEVER_ANSWERED: &str = "no sensor has answered yet; check the supply, the address, the bit rate, A and B, and \
    that DE stays high until the last stop bit: `flush` of some UARTs returns early, see `Release`";
const SILENT: &str = "other requests were answered; check supply, cable and address of this sensor";
const OWN_ECHO: &str = "only our own frame came back: the sensor is silent, and the receiver is on while we send; set \
    `Echo::Expected`, or tie /RE to DE";
const LATE: &str = "answers come after their deadline; the receiver hands them over late: give \
    `Timing::handed_over_within`, or lower the threshold of its FIFO or the latency timer of the adapter";
const COLLISION: &str = "answers come, and no good one yet: two sensors have one address, or the line is bad; connect \
    one sensor alone, then check the termination";
const LINE_LOW: &str = "the line is low for whole characters: swap A and B, give it a bias, or look for something that \
    sends at a lower bit rate";
const NOT_SILENT: &str = "not sent: the line did not fall silent; look for another master, a sensor that does not stop \
    sending, and a line without bias";

/// How a driver is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    Blocking,
    Async,
}

const BOTH: [Use; 2] = [Use::Blocking, Use::Async];

/// A T7's driver, of either kind.
enum T7 {
    Blocking(UsDigitalT7<NbLine>),
    Async(asynch::UsDigitalT7<IoLine>, Board),
}

/// An ISU's driver, of either kind.
enum Isu {
    Blocking(SttIsu<NbLine>),
    Async(asynch::SttIsu<IoLine>, Board),
}

/// Calls a method of either kind; its error as the user reads it.
macro_rules! call {
    ($self:ident.$method:ident($($argument:expr),*)) => {
        match $self {
            Self::Blocking(driver) => driver.$method($($argument),*).map_err(|error| error.to_string()),
            Self::Async(driver, board) => {
                block_on(board, driver.$method($($argument),*)).map_err(|error| error.to_string())
            }
        }
    };
}

impl T7 {
    /// At the factory's bit rate, with nothing to set.
    fn new(how: Use, board: &Board) -> T7 {
        T7::with(how, board, PortSettings::new(support::SERIAL))
    }

    fn with(how: Use, board: &Board, settings: PortSettings) -> T7 {
        let timing = Timing::t7(settings.serial);
        match how {
            Use::Blocking => T7::Blocking(UsDigitalT7::new(nb_line(board, settings), timing)),
            Use::Async => {
                T7::Async(asynch::UsDigitalT7::new(io_line(board, settings), timing), board.clone())
            }
        }
    }

    fn angle(&mut self, address: Address) -> Result<Angle, String> {
        self.angle_of(address, Axis::Two)
    }

    fn angle_of(&mut self, address: Address, axis: Axis) -> Result<Angle, String> {
        call!(self.angle(address, axis))
    }

    fn all_data(&mut self, address: Address) -> Result<(), String> {
        call!(self.all_data(address)).map(|_| ())
    }

    fn damping_ms(&mut self, address: Address) -> Result<u16, String> {
        call!(self.damping_ms(address))
    }

    fn set_damping_ms(&mut self, address: Address, damping_ms: u16) -> Result<(), String> {
        call!(self.set_damping_ms(address, damping_ms)).map(|_| ())
    }

    fn set_offset(&mut self, address: Address, axis: Axis, offset: Angle) -> Result<(), String> {
        call!(self.set_offset(address, axis, offset)).map(|_| ())
    }

    fn set_direction(&mut self, address: Address, axis: Axis, direction: Direction) -> Result<(), String> {
        call!(self.set_direction(address, axis, direction)).map(|_| ())
    }

    fn zero(&mut self, address: Address, axis: Axis) -> Result<i32, String> {
        call!(self.zero(address, axis)).map(|zeroed| zeroed.after.0)
    }

    fn change_address(&mut self, operation: ChangeAddress) -> Result<(), String> {
        call!(self.run(operation)).map(|_| ())
    }

    fn writes(&self) -> u32 {
        match self {
            Self::Blocking(driver) => driver.counters().writes,
            Self::Async(driver, _) => driver.counters().writes,
        }
    }
}

impl Isu {
    /// With nothing to set.
    fn new(how: Use, board: &Board) -> Isu {
        Isu::with(how, board, PortSettings::new(Serial::ISU))
    }

    fn with(how: Use, board: &Board, settings: PortSettings) -> Isu {
        let timing = Timing::isu();
        match how {
            Use::Blocking => Isu::Blocking(SttIsu::new(nb_line(board, settings), timing)),
            Use::Async => Isu::Async(asynch::SttIsu::new(io_line(board, settings), timing), board.clone()),
        }
    }

    fn angle(&mut self, module: Module) -> Result<Angle, String> {
        call!(self.angle(module))
    }

    fn read_eeprom(&mut self, module: Module, start: u8, count: u8) -> Result<(), String> {
        call!(self.read_eeprom(module, start, count)).map(|_| ())
    }

    fn zero(&mut self, module: Module) -> Result<(), String> {
        call!(self.zero(module)).map(|_| ())
    }

    fn program(&mut self, operation: Program) -> Result<(), String> {
        call!(self.run(operation)).map(|_| ())
    }

    fn writes(&self) -> u32 {
        match self {
            Self::Blocking(driver) => driver.counters().writes,
            Self::Async(driver, _) => driver.counters().writes,
        }
    }
}

/// A quiet pair on which the master does not hear itself, and a UART with nothing to set.
fn board(baud: u32, stations: Vec<Station>) -> Board {
    Board::new(baud, Model::BUFFERED, sensors::quiet(), stations)
}

/// The same, on which it does.
fn board_with_echo(baud: u32, stations: Vec<Station>) -> Board {
    Board::new(baud, Model::BUFFERED, SegmentSettings { echo: true, ..sensors::quiet() }, stations)
}

/// A pair that is low where it should be high: A and B swapped, or no bias.
fn board_upside_down(baud: u32) -> Board {
    let low = StuckLine { high: false, from: MS, until: 10_000 * MS };
    let faults = LineFaults { stuck: vec![low], ..Default::default() };
    Board::with_faults(baud, Model::BUFFERED, sensors::quiet(), vec![], faults)
}

/// A pair on which a sensor's driver is on all the time.
fn board_with_babble(baud: u32, node: impl clino_sim::node::Node + 'static) -> Board {
    // From a silent line on: a receiver in the middle of a character may take its bits for silence.
    let babble = clino_segment::Babble { from: MS, until: 10_000 * MS, gap: 0 };
    let faults = clino_segment::Faults { babble: vec![babble], ..Default::default() };
    let board = board(baud, vec![Station { name: "babbler".into(), node: Box::new(node), faults }]);
    board.pass(3 * MS);
    board
}

/// An ISU with RX low from power-up: it prints lines.
fn printing() -> Station {
    let content = sim_isu::Content { address: 3, ..Default::default() };
    let eeprom = sim_isu::Eeprom::factory(content, sim_isu::ChecksumScope::default(), 1);
    let isu = sim_isu::Isu::new(eeprom, sim_isu::Options::default());
    sensors::station("isu", sim_isu::RxLow::new(isu))
}

/// With the echo announced.
fn echo_expected(serial: Serial) -> PortSettings {
    PortSettings { echo: Echo::Expected, ..PortSettings::new(serial) }
}

/// What a user reads.
#[track_caller]
fn says<T: Debug>(how: Use, result: Result<T, String>, expected: &str) {
    assert_eq!(result.expect_err("an error"), expected, "{how:?}");
}

/// What a user reads, but for figures at the beginning that depend on chance or on the kind of driver.
#[track_caller]
fn ends<T: Debug>(how: Use, result: Result<T, String>, begins: &str, expected: &str) {
    let text = result.expect_err("an error");
    let rest = text.strip_suffix(expected).and_then(|rest| rest.strip_prefix(begins));
    // Figures only, and no other cause.
    assert!(rest.is_some_and(|rest| rest.len() < 40 && !rest.contains(';')), "{how:?}: {text}");
}

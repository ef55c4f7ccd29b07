//! Models of the UARTs of all HALs in the README's table, with the settings that the table gives: every operation,
//! nothing wrong, nothing lost, blocking and async. And without these settings, what the error says.
#![cfg(all(feature = "embedded-io", feature = "nb", feature = "commissioning", feature = "async"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::isu::Address as Module;
use clino_drivers::codec::isu::eeprom::Change;
use clino_drivers::codec::t7::Axis;
use clino_drivers::commissioning::isu;
use clino_drivers::commissioning::t7::{ChangeAddress, Device, Identify};
use clino_drivers::rs485::{Echo, Release};
use clino_drivers::t7::FlashWrite;
use clino_drivers::uart::{Io, Nb};
use clino_drivers::{
    Duration, PortSettings, Rs485, Serial, SttIsu, Suspect, Timing, UsDigitalT7, asynch, t7,
};
use common::executor::block_on;
use common::uart::{Flush, Handover};
use common::{Board, Model, sensors};
use support::{MS, SERIAL, address, turns};

/// How a HAL is used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    Nb,
    Io,
    Async,
}

/// A row of the README's table.
struct Row {
    name: &'static str,
    uses: &'static [Use],
    model: Model,
    release: Release,
    /// Characters, and microseconds.
    handed_over_within: (u32, u32),
}

/// Registers and FIFOs as the reference manuals have them; when `flush` returns and what the receiver waits for as the
/// sources of the HALs have it.
const ROWS: [Row; 7] = [
    // One register each way.
    Row {
        name: "stm32f4xx-hal",
        uses: &[Use::Nb],
        model: Model::BARE,
        release: Release::Flushed,
        handed_over_within: (0, 0),
    },
    // 32 characters each way; `flush` waits for `busy`.
    Row {
        name: "rp2040-hal",
        uses: &[Use::Nb],
        model: Model { transmit_buffer: 32, receive_buffer: 32, ..Model::BARE },
        release: Release::Flushed,
        handed_over_within: (0, 0),
    },
    // 128 characters each way; an async read lowers the threshold to what it wants.
    Row {
        name: "esp-hal",
        uses: &[Use::Io, Use::Async],
        model: Model { transmit_buffer: 128, receive_buffer: 128, ..Model::BARE },
        release: Release::Flushed,
        handed_over_within: (0, 0),
    },
    // A buffer of 128 filled by an interrupt; a reader is woken when it is half full or the line idle for a character.
    Row {
        name: "embassy-stm32 BufferedUart",
        uses: &[Use::Io, Use::Async],
        model: Model {
            transmit_buffer: 128,
            receive_buffer: 128,
            handover: Handover::Fifo { threshold: 64, silence: 10 },
            ..Model::BARE
        },
        release: Release::Flushed,
        handed_over_within: (36, 0),
    },
    // `flush` waits for the FIFO to be empty: the last character has just begun.
    Row {
        name: "embassy-rp Uart",
        uses: &[Use::Nb],
        model: Model { flush: Flush::RegisterEmpty, transmit_buffer: 32, receive_buffer: 32, ..Model::BARE },
        release: Release::TRANSMIT_REGISTER_EMPTY,
        handed_over_within: (0, 0),
    },
    // `flush` waits for a buffer before the FIFO; the receiver interrupts at 28 of 32, or after 32 bits of silence.
    Row {
        name: "embassy-rp BufferedUart",
        uses: &[Use::Io, Use::Async],
        model: Model {
            flush: Flush::Never,
            transmit_buffer: 64,
            receive_buffer: 64,
            handover: Handover::Fifo { threshold: 28, silence: 32 },
        },
        release: Release::WHOLE_FRAME,
        handed_over_within: (32, 0),
    },
    // A USB adapter that sends a packet every 16 ms, and keeps DE by itself until it has sent.
    Row {
        name: "USB adapter",
        uses: &[Use::Io, Use::Async],
        model: Model {
            transmit_buffer: 512,
            receive_buffer: 512,
            handover: Handover::Packets { period: 16 * MS },
            ..Model::BARE
        },
        release: Release::Flushed,
        handed_over_within: (0, 16_000),
    },
];

/// Answers to each kind of request.
const TIMES: usize = 50;

impl Row {
    fn handover(&self, serial: Serial) -> Duration {
        let (characters, micros) = self.handed_over_within;
        serial.characters(characters) + Duration::from_micros(micros)
    }

    fn settings(&self, serial: Serial, echo: Echo) -> PortSettings {
        PortSettings {
            release: self.release,
            echo,
            handover: self.handover(serial),
            ..PortSettings::new(serial)
        }
    }

    fn t7_timing(&self, serial: Serial) -> Timing {
        Timing::t7(serial).handed_over_within(self.handover(serial))
    }
}

fn board(row: &Row, baud: u32, echo: bool, stations: Vec<clino_segment::Station>) -> Board {
    let settings = clino_segment::SegmentSettings { echo, ..sensors::quiet() };
    Board::new(baud, row.model, settings, stations)
}

fn is_true(board: &Board, angle: clino_drivers::codec::angle::Angle, row: &Row) -> bool {
    // Its age: 2° a second, and what the receiver has kept it. The row's handover at 9600 bit/s is 37 ms.
    let age = sensors::TURNING.at(board.now()) - i64::from(angle.udeg());
    (0..10_000 + 2 * i64::from(row.handover(SERIAL).as_micros())).contains(&age.abs())
}

/// Everything that a T7's driver does.
macro_rules! t7_does_everything {
    ($t7:ident, $row:ident, $board:ident, $wait:ident) => {{
        let five = address(5);
        for _ in 0..TIMES {
            let angle = $wait!($t7.angle(five, Axis::Two)).unwrap();
            assert!(is_true(&$board, angle, $row), "{}: {angle}", $row.name);
            let angle = $wait!($t7.all_data(five)).unwrap().angles[2];
            assert!(is_true(&$board, angle, $row), "{}: {angle}", $row.name);
            assert_eq!($wait!($t7.information(five)).unwrap().serial, 25_033);
        }
        assert_eq!($wait!($t7.set_damping_ms(five, 250)), Ok(FlashWrite::Written));
        assert_eq!(
            $wait!($t7.run(Identify::new(Device::at(five).unwrap()).unwrap())).unwrap().damping_ms,
            250
        );
        $wait!($t7.run(ChangeAddress::new(five, address(6)).unwrap())).unwrap();
        assert!($wait!($t7.angle(five, Axis::Two)).is_err());
        assert!(is_true(&$board, $wait!($t7.angle(address(6), Axis::Two)).unwrap(), $row));
        let counters = *$t7.counters();
        assert_eq!((counters.late, counters.bad_answer, counters.retries), (0, 0, 0), "{}", $row.name);
    }};
}

macro_rules! directly {
    ($call:expr) => {
        $call
    };
}

#[test]
fn a_t7_on_every_hal() {
    for row in &ROWS {
        for echo in [false, true] {
            for how in row.uses {
                let board = board(row, 115_200, echo, vec![sensors::station("t7", sensors::t7(5))]);
                let settings = row.settings(SERIAL, if echo { Echo::Expected } else { Echo::Off });
                let (timing, uart) = (row.t7_timing(SERIAL), board.uart());
                match how {
                    Use::Nb => {
                        let line = Rs485::new(Nb::new(uart), board.de(), board.delay(), settings);
                        let mut t7 = UsDigitalT7::new(line, timing);
                        t7_does_everything!(t7, row, board, directly);
                    }
                    Use::Io => {
                        let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
                        let mut t7 = UsDigitalT7::new(line, timing);
                        t7_does_everything!(t7, row, board, directly);
                    }
                    Use::Async => {
                        let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
                        let mut t7 = asynch::UsDigitalT7::new(line, timing);
                        macro_rules! wait {
                            ($call:expr) => {
                                block_on(&board, $call)
                            };
                        }
                        t7_does_everything!(t7, row, board, wait);
                    }
                }
                let turns = turns(&board);
                assert!(turns.all_clean() && !turns.high, "{}", row.name);
            }
        }
    }
}

/// Everything that an ISU's driver does.
macro_rules! isu_does_everything {
    ($isu:ident, $row:ident, $board:ident, $wait:ident) => {{
        let three = Module::new(3).unwrap();
        for _ in 0..TIMES {
            assert_eq!($wait!($isu.angle(three)).unwrap().mdeg(), 90_000, "{}", $row.name);
            assert_eq!($wait!($isu.read_eeprom(three, 0x48, 16)).unwrap().iter().count(), 16);
        }
        assert_eq!($wait!($isu.read_ram(three, 0x58, 2)).unwrap().as_slice(), [0x40, 0x00]);
        $wait!($isu.zero(three)).unwrap();
        assert_eq!($wait!($isu.angle(three)).unwrap().mdeg(), 0, "{}", $row.name);
        let module = |number| isu::Module::at(Module::new(number).unwrap()).unwrap();
        let address = Change::ModuleAddress(Module::new(7).unwrap());
        $wait!($isu.run(isu::Program::new(module(3), address).unwrap())).unwrap();
        assert_eq!($wait!($isu.run(isu::Identify::new(module(7)))).unwrap().address.get(), 7);
        let counters = *$isu.counters();
        assert_eq!((counters.late, counters.bad_answer), (0, 0), "{}", $row.name);
    }};
}

#[test]
fn an_isu_on_every_hal() {
    for row in &ROWS {
        for how in row.uses {
            let board = board(row, 9_600, false, vec![sensors::station("isu", sensors::isu(3, 90_000_000))]);
            let (settings, uart) = (row.settings(Serial::ISU, Echo::Off), board.uart());
            let timing = Timing::isu().handed_over_within(row.handover(Serial::ISU));
            match how {
                Use::Nb => {
                    let line = Rs485::new(Nb::new(uart), board.de(), board.delay(), settings);
                    let mut isu = SttIsu::new(line, timing);
                    isu_does_everything!(isu, row, board, directly);
                }
                Use::Io => {
                    let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
                    let mut isu = SttIsu::new(line, timing);
                    isu_does_everything!(isu, row, board, directly);
                }
                Use::Async => {
                    let line = Rs485::new(Io::new(uart), board.de(), board.delay(), settings);
                    let mut isu = asynch::SttIsu::new(line, timing);
                    macro_rules! wait {
                        ($call:expr) => {
                            block_on(&board, $call)
                        };
                    }
                    isu_does_everything!(isu, row, board, wait);
                }
            }
            let turns = turns(&board);
            assert!(turns.all_clean() && !turns.high, "{}", row.name);
        }
    }
}

fn row(name: &str) -> &'static Row {
    ROWS.iter().find(|row| row.name == name).expect("a row")
}

/// A T7 on a HAL, asked with these settings: how often it answers, and the last error.
fn asked(
    row: &Row,
    settings: PortSettings,
    timing: Timing,
) -> (usize, Option<t7::Error<impl std::fmt::Debug>>) {
    let baud = settings.serial.baud;
    let baud_index = clino_sim::t7::BAUD_RATES.iter().position(|&rate| rate == baud).expect("a T7 has it");
    let options =
        clino_sim::t7::StoredSettings { baud_index: baud_index as u8, address: 5, ..Default::default() };
    let node =
        clino_sim::t7::T7::new(clino_sim::t7::Identity::default(), options, sensors::turning()).unwrap();
    let board = board(
        row,
        baud,
        false,
        vec![sensors::station("t7", std::sync::Arc::new(std::sync::Mutex::new(node)))],
    );
    let line = Rs485::new(Io::new(board.uart()), board.de(), board.delay(), settings);
    let mut t7 = UsDigitalT7::new(line, timing);
    let results: Vec<_> = (0..TIMES).map(|_| t7.all_data(address(5))).collect();
    let good = results.iter().flatten().count();
    (good, results.into_iter().filter_map(Result::err).next_back())
}

/// The trap of the most used HAL for the RP2040: every frame is cut, nothing ever answers, and the error says where to look.
#[test]
fn a_line_that_is_released_early_is_suspected() {
    let row = row("embassy-rp BufferedUart");
    for release in [Release::Flushed, Release::TRANSMIT_REGISTER_EMPTY] {
        let settings = PortSettings { release, ..row.settings(SERIAL, Echo::Off) };
        let (good, error) = asked(row, settings, row.t7_timing(SERIAL));
        assert_eq!(good, 0);
        let Some(t7::Error::NoAnswer { suspect, .. }) = error else { panic!("{error:?}") };
        assert_eq!(suspect, Suspect::NeverAnswered);
        assert!(suspect.to_string().contains("`flush` of some UARTs returns early, see `Release`"));
    }
    assert_eq!(asked(row, row.settings(SERIAL, Echo::Off), row.t7_timing(SERIAL)).0, TIMES);
}

/// A receiver that hands over late: at 115200 bit/s a FIFO, at 9600 bit/s a FIFO or a USB adapter.
#[test]
fn late_hand_over_is_advised_against() {
    for (name, baud) in [
        ("embassy-rp BufferedUart", 115_200),
        ("embassy-rp BufferedUart", 9_600),
        ("USB adapter", 115_200),
        ("USB adapter", 9_600),
    ] {
        let (row, serial) = (row(name), Serial { baud });
        let settings = row.settings(serial, Echo::Off);
        let (good, error) = asked(row, settings, Timing::t7(serial));
        assert_eq!(good, 0, "{name} at {baud}");
        let text = match error {
            Some(
                t7::Error::NoAnswer { suspect, .. }
                | t7::Error::Garbled { suspect, .. }
                | t7::Error::Bad { suspect, .. },
            ) => suspect.to_string(),
            other => panic!("{name} at {baud}: {other:?}"),
        };
        assert!(text.contains("Timing::handed_over_within"), "{name} at {baud}: {text}");
        assert_eq!(asked(row, settings, row.t7_timing(serial)).0, TIMES, "{name} at {baud}");
    }
}

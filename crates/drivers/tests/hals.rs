//! Models of the UARTs of all HALs in the README's table, with the settings that the table gives: every method and every
//! operation, nothing wrong, nothing lost, blocking and async; and futures dropped at every wait. And without these settings,
//! what the error says.
#![cfg(all(feature = "embedded-io", feature = "nb", feature = "commissioning", feature = "async"))]

/// A call that blocks.
macro_rules! directly {
    ($call:expr) => {
        $call
    };
}

/// The tests of a driver that does this with a row.
macro_rules! on_every_hal {
    ($on:ident) => {
        #[test]
        fn on_every_hal_through_nb() {
            on_every_row(Use::Nb, $on);
        }

        #[test]
        fn on_every_hal_through_io() {
            on_every_row(Use::Io, $on);
        }

        #[test]
        fn on_every_hal_async() {
            on_every_row(Use::Async, $on);
        }
    };
}

#[path = "../examples/common/mod.rs"]
mod common;
#[path = "hals/dropped.rs"]
mod dropped;
#[path = "hals/isu.rs"]
mod isu;
mod support;
#[path = "hals/t7.rs"]
mod t7;

use clino_drivers::codec::angle::Angle;
use clino_drivers::rs485::{Echo, Release};
use clino_drivers::t7::Error;
use clino_drivers::uart::Io;
use clino_drivers::{Duration, PortSettings, Rs485, Serial, Suspect, Timing, UsDigitalT7};
use common::uart::{Flush, Handover};
use common::{Board, Model, sensors};
use support::{MS, SERIAL, address};

/// How a HAL is used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    Nb,
    Io,
    Async,
}

impl Use {
    /// The adapter's name.
    const fn adapter(self) -> &'static str {
        match self {
            Use::Nb => "uart::Nb",
            Use::Io | Use::Async => "uart::Io",
        }
    }
}

/// A row of the README's table.
struct Row {
    /// The HAL, and its UART if it has several.
    name: &'static str,
    uses: &'static [Use],
    model: Model,
    release: Release,
    /// Characters, and microseconds.
    handed_over_within: (u32, u32),
}

/// Registers and FIFOs as the reference manuals have them; when `flush` returns and what the receiver waits for as the
/// sources of the HALs have it.
const ROWS: [Row; 8] = [
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
    // The same, whose reader is woken by each character: `eager_reads: Some(1)`.
    Row {
        name: "embassy-stm32 BufferedUart, eager",
        uses: &[Use::Io, Use::Async],
        model: Model { transmit_buffer: 128, receive_buffer: 128, ..Model::BARE },
        release: Release::Flushed,
        handed_over_within: (0, 0),
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

    fn isu_timing(&self) -> Timing {
        Timing::isu().handed_over_within(self.handover(Serial::ISU))
    }
}

fn board(row: &Row, baud: u32, echo: bool, stations: Vec<clino_segment::Station>) -> Board {
    let settings = clino_segment::SegmentSettings { echo, ..sensors::quiet() };
    Board::new(baud, row.model, settings, stations)
}

/// Does this on each row that is used so, without an echo and with one.
fn on_every_row(how: Use, on: fn(&Row, Echo, Use)) {
    for row in ROWS.iter().filter(|row| row.uses.contains(&how)) {
        on(row, Echo::Off, how);
        on(row, Echo::Expected, how);
    }
}

fn is_true(board: &Board, angle: Angle, row: &Row) -> bool {
    // Its age: 2° a second, and what the receiver has kept it. The row's handover at 9600 bit/s is 37 ms.
    let age = sensors::TURNING.at(board.now()) - i64::from(angle.udeg());
    (0..10_000 + 2 * i64::from(row.handover(SERIAL).as_micros())).contains(&age.abs())
}

/// That the methods of a driver, which are in `source`, are all called in `calls`, on what is named `driver` there.
fn every_method_is_called(source: &str, calls: &str, driver: &str) {
    // What makes a driver is called differently.
    let methods = source.split("\n    pub fn ").skip(1).filter_map(|rest| rest.split(['(', '<']).next());
    let methods: Vec<&str> = methods.filter(|name| !["new", "single"].contains(name)).collect();
    assert!(methods.len() > 8, "{methods:?}");
    for method in methods {
        assert!(calls.contains(&format!("${driver}.{method}(")), "{method}");
    }
}

fn row(name: &str) -> &'static Row {
    ROWS.iter().find(|row| row.name == name).expect("a row")
}

/// A T7 on a HAL, asked with these settings: how often it answers, and the last error.
fn asked(row: &Row, settings: PortSettings, timing: Timing) -> (usize, Option<Error<impl std::fmt::Debug>>) {
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
        let Some(Error::NoAnswer { suspect, .. }) = error else { panic!("{error:?}") };
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
                Error::NoAnswer { suspect, .. } | Error::Garbled { suspect, .. } | Error::Bad { suspect, .. },
            ) => suspect.to_string(),
            other => panic!("{name} at {baud}: {other:?}"),
        };
        assert!(text.contains("Timing::handed_over_within"), "{name} at {baud}: {text}");
        assert_eq!(asked(row, settings, row.t7_timing(serial)).0, TIMES, "{name} at {baud}");
    }
}

/// The README's table says of each HAL what is tested here, and names no other.
#[test]
fn the_readme_has_the_rows_that_are_tested() {
    let readme = include_str!("../README.md");
    let table =
        readme.split("\n| HAL | UART |").nth(1).expect("the table").split("\n\n").next().expect("its end");
    let lines: Vec<Vec<&str>> = table
        .lines()
        .skip(2)
        .map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().trim_matches('`')).collect())
        .collect();
    // HAL with its version, UART, name of the row here.
    let expected = [
        ("stm32f4xx-hal` 0.23", "Serial", "stm32f4xx-hal"),
        ("rp2040-hal` 0.12", "UartPeripheral", "rp2040-hal"),
        ("esp-hal` 1.2", "Uart`, blocking or async", "esp-hal"),
        ("embassy-stm32` 0.6", "BufferedUart", "embassy-stm32 BufferedUart"),
        ("embassy-stm32` 0.6", "BufferedUart`, `eager_reads: Some(1)", "embassy-stm32 BufferedUart, eager"),
        ("embassy-rp` 0.10", "Uart`, blocking", "embassy-rp Uart"),
        ("embassy-rp` 0.10", "BufferedUart", "embassy-rp BufferedUart"),
        ("Linux", "/dev/tty…", "USB adapter"),
    ];
    assert_eq!(lines.len(), expected.len());
    for (line, (hal, uart, name)) in lines.iter().zip(expected) {
        let [said_hal, said_uart, adapter, release, handed_over, _program] = line[..] else {
            panic!("{line:?}")
        };
        let row = row(name);
        assert_eq!((said_hal, said_uart), (hal, uart));
        // What has no HAL has no adapter and keeps DE by itself.
        if name != "USB adapter" {
            assert!(row.uses.iter().all(|how| how.adapter() == adapter), "{name}: {adapter}");
            let expected = match row.release {
                Release::Flushed => "Flushed",
                Release::TRANSMIT_REGISTER_EMPTY => "TRANSMIT_REGISTER_EMPTY",
                Release::WHOLE_FRAME => "WHOLE_FRAME",
                other => panic!("{other:?}"),
            };
            assert_eq!(release, expected, "{name}");
        }
        let expected = match row.handed_over_within {
            (0, 0) => "none".to_owned(),
            (characters, 0) => format!("{characters} characters"),
            (_, micros) => format!("{} ms for most USB adapters", micros / 1_000),
        };
        assert_eq!(handed_over, expected, "{name}");
    }
}

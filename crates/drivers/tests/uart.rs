//! The adapters: no receiver error is lost, in whatever traits it comes.
#![cfg(all(feature = "embedded-io", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use std::collections::VecDeque;

use clino_drivers::codec::character::{Character, LineErrors};
use clino_drivers::rs485::{Error, NoPin, PortSettings, Rs485};
use clino_drivers::uart::{Io, Nb, Uart};
use common::uart::LineError;
use embedded_hal_nb::serial::ErrorKind;
use support::SERIAL;

/// A UART that has received this.
struct Script(VecDeque<Result<u8, ErrorKind>>);

const RECEIVED: [Result<u8, ErrorKind>; 7] = [
    Ok(0x41),
    Err(ErrorKind::FrameFormat),
    Err(ErrorKind::Overrun),
    Ok(0x42),
    Err(ErrorKind::Parity),
    Err(ErrorKind::Noise),
    Err(ErrorKind::Other),
];

fn script() -> Script {
    Script(RECEIVED.into())
}

impl embedded_hal_nb::serial::ErrorType for Script {
    type Error = ErrorKind;
}

impl embedded_hal_nb::serial::Read for Script {
    fn read(&mut self) -> nb::Result<u8, ErrorKind> {
        self.0.pop_front().ok_or(nb::Error::WouldBlock)?.map_err(nb::Error::Other)
    }
}

impl embedded_hal_nb::serial::Write for Script {
    fn write(&mut self, _: u8) -> nb::Result<(), ErrorKind> {
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), ErrorKind> {
        Ok(())
    }
}

impl embedded_io::ErrorType for Script {
    type Error = LineError;
}

impl embedded_io::ReadReady for Script {
    fn read_ready(&mut self) -> Result<bool, LineError> {
        Ok(!self.0.is_empty())
    }
}

impl embedded_io::Read for Script {
    fn read(&mut self, buf: &mut [u8]) -> Result<usize, LineError> {
        buf[0] = self.0.pop_front().unwrap().map_err(LineError)?;
        Ok(1)
    }
}

impl embedded_io::Write for Script {
    fn write(&mut self, buf: &[u8]) -> Result<usize, LineError> {
        Ok(buf.len())
    }

    fn flush(&mut self) -> Result<(), LineError> {
        Ok(())
    }
}

fn all(mut uart: impl Uart) -> Vec<Character> {
    std::iter::from_fn(|| uart.receive()).collect()
}

fn spoilt(errors: LineErrors) -> Character {
    Character { byte: 0, errors }
}

#[test]
fn nb_names_its_errors() {
    let expected = [
        Character::clean(0x41),
        spoilt(LineErrors::FRAMING),
        spoilt(LineErrors::OVERRUN),
        Character::clean(0x42),
        spoilt(LineErrors::PARITY),
        spoilt(LineErrors::NOISE),
        spoilt(LineErrors::NOISE),
    ];
    assert_eq!(all(Nb::new(script())), expected);
}

#[test]
fn embedded_io_has_errors_without_names() {
    let expected = RECEIVED.map(|read| read.map_or(spoilt(LineErrors::NOISE), Character::clean));
    assert_eq!(all(Io::new(script())), expected);
}

#[test]
fn embedded_io_can_be_told_their_names() {
    let named = Io::with_line_errors(script(), |LineError(kind)| match kind {
        ErrorKind::Overrun => LineErrors::OVERRUN,
        // Even an error that is called none at all is one.
        _ => LineErrors::NONE,
    });
    let errors: Vec<LineErrors> = all(named).iter().map(|character| character.errors).collect();
    let (noise, none) = (LineErrors::NOISE, LineErrors::NONE);
    assert_eq!(errors, [none, noise, LineErrors::OVERRUN, none, noise, noise, noise]);
}

#[cfg(feature = "embedded-io-06")]
#[test]
fn embedded_io_06_works_like_its_successor() {
    use clino_drivers::codec::t7::Axis;
    use clino_drivers::uart::Io06;
    use clino_drivers::{Timing, UsDigitalT7};
    use common::{Model, sensors};

    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let line = Rs485::new(Io06::new(board.uart()), board.de(), board.delay(), PortSettings::new(SERIAL));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(SERIAL));
    let angle = t7.angle(support::address(5), Axis::Two).unwrap();
    assert!(sensors::is_true(angle, sensors::TURNING.at(board.now())));
    assert!(support::turns(&board).all_clean());
}

/// Read through the line, an error stands in the place of its character, and takes no other along.
#[test]
fn a_line_reads_errors_in_their_place() {
    use embedded_io::{Read, ReadReady};

    let board = common::sensors::t7_board(common::Model::BARE, &[]);
    let mut line = Rs485::new(Nb::new(script()), NoPin, board.delay(), PortSettings::new(SERIAL));
    let mut buffer = [0; 8];
    assert_eq!(line.read(&mut []), Ok(0));
    assert_eq!((line.read(&mut buffer), buffer[0]), (Ok(1), 0x41));
    assert_eq!(line.read(&mut buffer), Err(Error::Receiver(LineErrors::FRAMING)));
    assert_eq!(line.read(&mut buffer), Err(Error::Receiver(LineErrors::OVERRUN)));
    assert_eq!((line.read(&mut buffer), buffer[0]), (Ok(1), 0x42));
    for errors in [LineErrors::PARITY, LineErrors::NOISE, LineErrors::NOISE] {
        assert_eq!(line.read_ready(), Ok(true));
        assert_eq!(line.read(&mut buffer), Err(Error::Receiver(errors)));
    }
    assert_eq!(line.read_ready(), Ok(false));
}

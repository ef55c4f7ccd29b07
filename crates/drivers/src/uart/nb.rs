//! UARTs that implement `embedded_hal_nb::serial`.

use clino_codec::character::{Character, LineErrors};
use embedded_hal_nb::serial::{Error as _, ErrorKind, Read, Write};

use super::{ErrorType, Uart, spoilt};

/// A UART that implements `embedded_hal_nb::serial::{Read, Write}`: the way to the receiver errors by name, and the
/// one to take where a HAL's `embedded_io` is incomplete (`stm32f4xx-hal` 0.23 has no `Read`, and its `write` returns
/// `Ok(0)`).
#[derive(Clone, Debug)]
pub struct Nb<U> {
    uart: U,
}

impl<U> Nb<U> {
    /// An adapter.
    pub const fn new(uart: U) -> Self {
        Self { uart }
    }

    /// The UART, to change what only its HAL can: its bit rate, say.
    pub fn uart(&mut self) -> &mut U {
        &mut self.uart
    }

    /// The UART.
    pub fn release(self) -> U {
        self.uart
    }
}

impl<U: embedded_hal_nb::serial::ErrorType> ErrorType for Nb<U> {
    type Error = U::Error;
}

impl<U: Read + Write> Uart for Nb<U> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, U::Error> {
        let Some(&first) = bytes.first() else { return Ok(0) };
        match self.uart.write(first) {
            Ok(()) => Ok(1),
            Err(nb::Error::WouldBlock) => Ok(0),
            Err(nb::Error::Other(error)) => Err(error),
        }
    }

    fn flush(&mut self) -> Result<bool, U::Error> {
        match self.uart.flush() {
            Ok(()) => Ok(true),
            Err(nb::Error::WouldBlock) => Ok(false),
            Err(nb::Error::Other(error)) => Err(error),
        }
    }

    fn receive(&mut self) -> Option<Character> {
        match self.uart.read() {
            Ok(byte) => Some(Character::clean(byte)),
            Err(nb::Error::WouldBlock) => None,
            Err(nb::Error::Other(error)) => Some(spoilt(line_errors(error.kind()))),
        }
    }
}

fn line_errors(kind: ErrorKind) -> LineErrors {
    match kind {
        ErrorKind::Overrun => LineErrors::OVERRUN,
        ErrorKind::FrameFormat => LineErrors::FRAMING,
        ErrorKind::Parity => LineErrors::PARITY,
        // Noise, and whatever else it was.
        _ => LineErrors::NOISE,
    }
}

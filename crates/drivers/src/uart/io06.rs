//! UARTs that implement `embedded_io` 0.6.

use clino_codec::character::{Character, LineErrors};
use embedded_io_06::{Read, ReadReady, Write};

use super::{ErrorType, Uart, spoilt};

/// A UART that implements `embedded_io` 0.6, blocking.
#[derive(Clone, Debug)]
pub struct Io06<U: embedded_io_06::ErrorType> {
    uart: U,
    line_errors: fn(&U::Error) -> LineErrors,
}

impl<U: embedded_io_06::ErrorType> Io06<U> {
    /// An adapter that calls every receiver error [noise](LineErrors::NOISE), because `embedded_io` has no names for
    /// them.
    pub const fn new(uart: U) -> Self {
        Self { uart, line_errors: |_| LineErrors::NOISE }
    }

    /// An adapter that knows the names of the HAL's errors.
    pub const fn with_line_errors(uart: U, line_errors: fn(&U::Error) -> LineErrors) -> Self {
        Self { uart, line_errors }
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

impl<U: embedded_io_06::ErrorType> ErrorType for Io06<U> {
    type Error = U::Error;
}

impl<U: Read + ReadReady + Write> Uart for Io06<U> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, U::Error> {
        self.uart.write(bytes)
    }

    fn flush(&mut self) -> Result<bool, U::Error> {
        self.uart.flush().map(|()| true)
    }

    fn receive(&mut self) -> Option<Character> {
        let mut byte = [0];
        let read = match self.uart.read_ready() {
            Ok(false) => return None,
            Ok(true) => self.uart.read(&mut byte),
            Err(error) => Err(error),
        };
        match (read, byte) {
            (Ok(0), _) => None,
            (Ok(_), [byte]) => Some(Character::clean(byte)),
            (Err(error), _) => Some(spoilt((self.line_errors)(&error))),
        }
    }
}

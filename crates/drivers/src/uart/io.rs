//! UARTs that implement `embedded_io` 0.7 or `embedded_io_async` 0.7.

use clino_codec::character::{Character, LineErrors};
use embedded_io::{Read, ReadReady, Write};

use super::{ErrorType, Uart, spoilt};

/// A UART that implements `embedded_io` or `embedded_io_async`.
///
/// - Blocking: `ReadReady` is needed, because a `read` cannot be given a deadline.
/// - Async: `read` has to be cancel-safe, as that of an interrupt-driven or ring-buffered UART is: it is raced against
///   a timer, and what a dropped `read` took along would be lost.
#[derive(Clone, Debug)]
pub struct Io<U: embedded_io::ErrorType> {
    pub(crate) uart: U,
    line_errors: fn(&U::Error) -> LineErrors,
}

impl<U: embedded_io::ErrorType> Io<U> {
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

    /// What a `read` of one byte came to; nothing at the end of the file.
    pub(crate) fn character(&self, read: Result<usize, U::Error>, byte: u8) -> Option<Character> {
        match read {
            Ok(0) => None,
            Ok(_) => Some(Character::clean(byte)),
            Err(error) => Some(spoilt((self.line_errors)(&error))),
        }
    }
}

impl<U: embedded_io::ErrorType> ErrorType for Io<U> {
    type Error = U::Error;
}

impl<U: Read + ReadReady + Write> Uart for Io<U> {
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
        let [byte] = byte;
        self.character(read, byte)
    }
}

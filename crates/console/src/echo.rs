//! The editor's way to the port, which can be silent.

use core::convert::Infallible;

use embedded_io::{ErrorType, Write};

/// A port for people, or none for programs, which are not echoed.
pub struct Echo<W>(pub Option<W>);

impl<W> ErrorType for Echo<W> {
    type Error = Infallible;
}

impl<W: Write<Error = Infallible>> Write for Echo<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        match &mut self.0 {
            Some(port) => port.write(bytes),
            None => Ok(bytes.len()),
        }
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        match &mut self.0 {
            Some(port) => port.flush(),
            None => Ok(()),
        }
    }
}

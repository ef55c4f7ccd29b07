//! Text on its way out: a line feed becomes carriage return and line feed.

use core::convert::Infallible;
use core::fmt;

use embedded_io::Write;

const LINE_END: &[u8] = b"\r\n";

/// Writes text to a port that never fails.
pub struct Text<'a, W>(pub &'a mut W);

impl<W: Write<Error = Infallible>> fmt::Write for Text<'_, W> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut lines = text.split('\n');
        if let Some(first) = lines.next() {
            _ = self.0.write_all(first.as_bytes());
        }
        for line in lines {
            _ = self.0.write_all(LINE_END);
            _ = self.0.write_all(line.as_bytes());
        }
        Ok(())
    }
}

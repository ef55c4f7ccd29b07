//! Text on its way out, without `core::fmt`: its numbers, paddings and tables of functions would cost more flash than all
//! that is printed here.
//!
//! What is counted, escaped or left out is ASCII; other characters pass as they are.

use core::convert::Infallible;

use embedded_io::Write;

/// Takes text. It never fails: a port that cannot take more waits.
pub trait Out {
    /// Takes the next characters. A line ends with a line feed.
    fn put(&mut self, text: &[u8]);

    /// No more comes for now: what is held back goes out.
    fn flush(&mut self) {}
}

/// Characters that are held back until they are worth asking the port for: an answer is made of pieces of a few characters,
/// and the port of the firmware is asked under a lock.
const HELD: usize = 48;

/// A port: a line feed goes out as carriage return and line feed. What ends no line is held back until it is flushed.
pub struct Port<W> {
    port: W,
    held: [u8; HELD],
    length: usize,
}

impl<W> Port<W> {
    /// Holds nothing yet.
    pub const fn new(port: W) -> Port<W> {
        Port { port, held: [0; HELD], length: 0 }
    }
}

impl<W: Write<Error = Infallible>> Port<W> {
    /// Takes a character. One that finds no room lets the others out.
    fn hold(&mut self, byte: u8) {
        if self.length >= HELD {
            self.flush();
        }
        if let Some(place) = self.held.get_mut(self.length) {
            *place = byte;
            self.length = self.length.saturating_add(1);
        }
    }
}

impl<W: Write<Error = Infallible>> Out for Port<W> {
    fn flush(&mut self) {
        write(&mut self.port, self.held.get(..self.length).unwrap_or_default());
        self.length = 0;
    }

    fn put(&mut self, text: &[u8]) {
        for &byte in text {
            if byte == b'\n' {
                self.hold(b'\r');
                self.hold(byte);
                self.flush();
            } else {
                self.hold(byte);
            }
        }
    }
}

/// All of it, however little the port takes at once.
#[inline(never)]
fn write<W: Write<Error = Infallible>>(port: &mut W, mut text: &[u8]) {
    while let Ok(taken @ 1..) = port.write(text) {
        text = text.get(taken..).unwrap_or_default();
    }
}

/// Text in a string of JSON, or in quotation marks.
pub struct Inside<'o> {
    pub out: &'o mut dyn Out,
    /// What would end the string is escaped; otherwise it is left out: it is a sensor's own text, or repeats what was typed.
    pub escapes: bool,
}

impl Out for Inside<'_> {
    fn put(&mut self, text: &[u8]) {
        for &byte in text {
            let ends = matches!(byte, b'"' | b'\\');
            if byte.is_ascii_control() || ends && !self.escapes {
                continue;
            }
            if ends {
                self.out.put(b"\\");
            }
            self.out.put(&[byte]);
        }
    }
}

/// Counts characters.
pub struct Width(pub usize);

impl Out for Width {
    fn put(&mut self, text: &[u8]) {
        self.0 = self.0.saturating_add(text.len());
    }
}

/// The same character some times.
pub fn repeat(out: &mut dyn Out, byte: u8, times: usize) {
    (0..times).for_each(|_| out.put(&[byte]));
}

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
}

/// A port: a line feed goes out as carriage return and line feed.
pub struct Port<W>(pub W);

impl<W: Write<Error = Infallible>> Out for Port<W> {
    fn put(&mut self, text: &[u8]) {
        let mut rest = text;
        while !rest.is_empty() {
            let length = rest.iter().take_while(|&&byte| byte != b'\n').count();
            let (line, behind) = rest.split_at_checked(length).unwrap_or((rest, b""));
            write(&mut self.0, line);
            rest = match behind.strip_prefix(b"\n") {
                Some(behind) => {
                    write(&mut self.0, b"\r\n");
                    behind
                }
                None => b"",
            };
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
        let is_plain = |byte: &u8| !matches!(byte, b'"' | b'\\') && !byte.is_ascii_control();
        let mut rest = text;
        while !rest.is_empty() {
            // What needs nothing goes on as a whole: a port is asked once, not for each character.
            let length = rest.iter().take_while(|byte| is_plain(byte)).count();
            let (plain, behind) = rest.split_at_checked(length).unwrap_or((rest, b""));
            if !plain.is_empty() {
                self.out.put(plain);
            }
            let Some((special, behind)) = behind.split_first() else { return };
            if self.escapes && matches!(special, b'"' | b'\\') {
                self.out.put(&[b'\\', *special]);
            }
            rest = behind;
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

//! A frame, or a stream of them, from the command line to standard output.
//!
//! In a stream every line of input gets exactly one line of output, in order, so that the two can be joined. Output is
//! collected while more input is at hand, and written out before the next wait for input: fast from a file, prompt
//! from a terminal.

use std::io::{self, BufRead as _, BufReader, BufWriter, Read, Write};

use clap::Args;
use serde::Serialize;

use crate::bad::Bad;
use crate::outcome::DecodeVerdict;
use crate::report;

/// Bytes read or written at once.
const CHUNK: usize = 64 * 1024;
/// Longest line. The longest frame has 257 bytes, which take at most six characters each (`0xNN, `): there is room.
const LONGEST_LINE: usize = 4_096;

/// Where the frames to decode come from.
#[derive(Args)]
pub struct Frames {
    /// One frame, in any customary way: 05 06, 0506, 05:06, 0x05,0x06, \x05\x06, $05, 05h, in brackets, a line of a dump
    #[arg(required_unless_present = "stdin", conflicts_with = "stdin")]
    pub hex: Vec<String>,
    /// Take one frame per line from standard input, and answer each with one line
    #[arg(long)]
    pub stdin: bool,
}

/// Prints the result of `interpret` for each frame.
///
/// # Errors
/// Input or output failed.
pub fn run<T: Serialize>(
    frames: &Frames,
    interpret: impl Fn(&[u8]) -> Result<T, Bad>,
) -> io::Result<DecodeVerdict> {
    if frames.stdin {
        return lines(io::stdin().lock(), io::stdout().lock(), interpret);
    }
    report::line(&mut io::stdout().lock(), interpret(frames.hex.join(" ").as_bytes()))
}

/// As [`run`], for a stream.
///
/// # Errors
/// Input or output failed.
pub fn lines<T: Serialize>(
    input: impl Read,
    output: impl Write,
    interpret: impl Fn(&[u8]) -> Result<T, Bad>,
) -> io::Result<DecodeVerdict> {
    let mut input = BufReader::with_capacity(CHUNK, input);
    let mut output = BufWriter::with_capacity(CHUNK, output);
    let mut line = Vec::new();
    let mut verdict = DecodeVerdict::Good;
    loop {
        if !input.buffer().contains(&b'\n') {
            output.flush()?;
        }
        let Some(text) = next_line(&mut input, &mut line)? else { break };
        verdict = verdict.and(report::line(&mut output, text.and_then(&interpret))?);
    }
    output.flush()?;
    Ok(verdict)
}

/// Takes one line, without its end; the last one needs none. A line that is too long is skipped.
fn next_line<'a>(
    input: &mut BufReader<impl Read>,
    line: &'a mut Vec<u8>,
) -> io::Result<Option<Result<&'a [u8], Bad>>> {
    line.clear();
    // One more for the end of the line.
    let taken = input.take(LONGEST_LINE as u64 + 1).read_until(b'\n', line)?;
    let text = line.strip_suffix(b"\n").unwrap_or(line);
    if text.len() > LONGEST_LINE {
        input.skip_until(b'\n')?;
        let message = format!("more than {LONGEST_LINE} characters in a line");
        return Ok(Some(Err(Bad::new("line_too_long", message).with("limit", LONGEST_LINE))));
    }
    Ok((taken > 0).then_some(Ok(text)))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;

    fn answers(input: &str) -> String {
        let mut output = Vec::new();
        lines(input.as_bytes(), &mut output, |text| Ok(String::from_utf8_lossy(text).len())).unwrap();
        String::from_utf8(output).unwrap()
    }

    #[test]
    fn one_answer_per_line_with_or_without_an_end() {
        assert_eq!(answers(""), "");
        assert_eq!(answers("abc"), "3\n");
        assert_eq!(answers("abc\n"), "3\n");
        assert_eq!(answers("abc\n\nde"), "3\n0\n2\n");
    }

    #[test]
    fn a_line_may_be_as_long_as_the_limit_and_no_longer() {
        let longest = "x".repeat(LONGEST_LINE);
        assert_eq!(answers(&format!("{longest}\nab\n")), format!("{LONGEST_LINE}\n2\n"));
        let refused = answers(&format!("{longest}x\nab\n{longest}{longest}{longest}"));
        let lines: Vec<&str> = refused.lines().collect();
        assert_eq!(lines.len(), 3, "{refused}");
        assert!(lines[0].contains("line_too_long") && lines[2].contains("line_too_long"), "{refused}");
        assert_eq!(lines[1], "2");
    }

    /// Hands out one line at a time, and notes how much output had been written when each was asked for.
    struct Slow<'a> {
        lines: Vec<&'a [u8]>,
        written: Rc<RefCell<Vec<u8>>>,
        seen: Rc<RefCell<Vec<usize>>>,
    }

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.seen.borrow_mut().push(self.written.borrow().len());
            if self.lines.is_empty() {
                return Ok(0);
            }
            let line = self.lines.remove(0);
            buffer[..line.len()].copy_from_slice(line);
            Ok(line.len())
        }
    }

    struct Shared(Rc<RefCell<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.borrow_mut().extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn everything_is_written_before_the_next_wait() {
        let written = Rc::new(RefCell::new(Vec::new()));
        let seen = Rc::new(RefCell::new(Vec::new()));
        let input = Slow {
            lines: vec![b"a\n", b"b\nc\nd", b"e\n"],
            written: Rc::clone(&written),
            seen: Rc::clone(&seen),
        };
        lines(input, Shared(Rc::clone(&written)), |text| Ok(text.len())).unwrap();
        assert_eq!(*written.borrow(), b"1\n1\n1\n2\n");
        // Before each read: nothing yet, one answer, three answers (the fourth line is half there), all.
        assert_eq!(*seen.borrow(), [0, 2, 6, 8]);
    }
}

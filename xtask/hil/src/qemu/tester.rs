//! QEMU's test protocol: words of the machine's address space, read and written from outside. A line each way.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;

/// An open connection.
pub struct Tester {
    commands: UnixStream,
    answers: BufReader<UnixStream>,
}

impl Tester {
    /// Over this socket.
    ///
    /// # Errors
    /// The system's words.
    pub fn new(socket: UnixStream) -> Result<Tester, String> {
        let answers = socket.try_clone().map_err(|why| format!("QEMU's test socket: {why}"))?;
        Ok(Tester { commands: socket, answers: BufReader::new(answers) })
    }

    /// Writes a word.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn write(&mut self, address: u32, word: u32) -> Result<(), String> {
        self.exchange(&format!("writel {address:#x} {word:#x}\n")).map(drop)
    }

    /// Reads a word.
    ///
    /// # Errors
    /// QEMU has ended, or has no number for it.
    pub fn read(&mut self, address: u32) -> Result<u32, String> {
        let answer = self.exchange(&format!("readl {address:#x}\n"))?;
        let word = answer.trim().strip_prefix("0x").and_then(|digits| u64::from_str_radix(digits, 16).ok());
        word.map(|word| word as u32).ok_or_else(|| format!("QEMU's test socket: {answer:?}"))
    }

    fn exchange(&mut self, command: &str) -> Result<String, String> {
        let failed = |why: std::io::Error| format!("QEMU's test socket: {why}");
        self.commands.write_all(command.as_bytes()).map_err(failed)?;
        loop {
            let mut line = String::new();
            if self.answers.read_line(&mut line).map_err(failed)? == 0 {
                return Err("QEMU has ended".to_owned());
            }
            // Interrupts that it was not asked for come as lines of their own.
            if let Some(rest) = line.strip_prefix("OK") {
                return Ok(rest.to_owned());
            }
            if line.starts_with("FAIL") || line.starts_with("ERR") {
                return Err(format!("QEMU's test socket: {line:?} to {command:?}"));
            }
        }
    }
}

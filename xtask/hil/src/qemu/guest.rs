//! QEMU as a debugger of the machine: registers, memory, breakpoints, in GDB's remote protocol.
//!
//! A packet is `$text#` and two digits of its sum. The machine runs, or has stopped at a breakpoint and said so.

use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;

/// Core registers by their number.
pub const SP: u8 = 13;
pub const LR: u8 = 14;
pub const PC: u8 = 15;
pub const XPSR: u8 = 25;

/// What stops a machine that runs.
const INTERRUPT: u8 = 3;

/// An open connection.
pub struct Guest {
    socket: UnixStream,
    /// What has come and was not taken yet.
    heard: Vec<u8>,
}

impl Guest {
    /// Over this socket; the machine stands still.
    ///
    /// # Errors
    /// The system's words.
    pub fn new(socket: UnixStream) -> Result<Guest, String> {
        let mut guest = Guest { socket, heard: Vec::new() };
        // No confirmation of each packet from here on.
        guest.ask("QStartNoAckMode")?;
        Ok(guest)
    }

    /// The machine stops when it comes to this instruction.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn break_at(&mut self, address: u32) -> Result<(), String> {
        self.ask(&format!("Z1,{address:x},2")).map(drop)
    }

    /// Lets it execute the instruction that it has stopped at.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn step_over(&mut self, breakpoint: u32) -> Result<(), String> {
        self.ask(&format!("z1,{breakpoint:x},2"))?;
        self.ask("s")?;
        self.break_at(breakpoint)
    }

    /// Stops it where it is.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn halt(&mut self) -> Result<(), String> {
        self.socket.write_all(&[INTERRUPT]).map_err(failed)?;
        while !self.has_stopped()? {}
        Ok(())
    }

    /// Lets it run.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn go(&mut self) -> Result<(), String> {
        self.send("c")
    }

    /// Whether it has stopped since.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn has_stopped(&mut self) -> Result<bool, String> {
        self.socket.set_nonblocking(true).map_err(failed)?;
        let heard = self.hear();
        self.socket.set_nonblocking(false).map_err(failed)?;
        match heard {
            Ok(()) => {}
            Err(why) if why.kind() == ErrorKind::WouldBlock => {}
            Err(why) => return Err(failed(why)),
        }
        Ok(self.packet().is_some_and(|packet| packet.starts_with('T') || packet.starts_with('S')))
    }

    /// A register of the core.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn register(&mut self, number: u8) -> Result<u32, String> {
        let bytes = self.bytes(&format!("p{number:x}"))?;
        word(&bytes).ok_or_else(|| format!("QEMU's debugger: register {number} is {bytes:02x?}"))
    }

    /// Sets a register of the core.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn set_register(&mut self, number: u8, value: u32) -> Result<(), String> {
        self.ask(&format!("P{number:x}={}", hex(value))).map(drop)
    }

    /// A word of memory.
    ///
    /// # Errors
    /// QEMU has ended, or there is no memory.
    pub fn word(&mut self, address: u32) -> Result<u32, String> {
        let bytes = self.bytes(&format!("m{address:x},4"))?;
        word(&bytes).ok_or_else(|| format!("QEMU's debugger: no memory at {address:#010x}"))
    }

    /// Sets a word of memory.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn set_word(&mut self, address: u32, value: u32) -> Result<(), String> {
        self.ask(&format!("M{address:x},4:{}", hex(value))).map(drop)
    }

    fn bytes(&mut self, command: &str) -> Result<Vec<u8>, String> {
        let answer = self.ask(command)?;
        let digits = answer.as_bytes().as_chunks::<2>().0.iter();
        let byte = |pair: &[u8; 2]| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok();
        digits
            .map(byte)
            .collect::<Option<_>>()
            .ok_or_else(|| format!("QEMU's debugger: {answer:?} to {command:?}"))
    }

    fn ask(&mut self, command: &str) -> Result<String, String> {
        self.send(command)?;
        loop {
            if let Some(packet) = self.packet() {
                return Ok(packet);
            }
            self.hear().map_err(failed)?;
        }
    }

    fn send(&mut self, command: &str) -> Result<(), String> {
        let sum = command.bytes().fold(0, u8::wrapping_add);
        self.socket.write_all(format!("${command}#{sum:02x}").as_bytes()).map_err(failed)
    }

    fn hear(&mut self) -> std::io::Result<()> {
        let mut buffer = [0; 512];
        match self.socket.read(&mut buffer)? {
            0 => Err(ErrorKind::UnexpectedEof.into()),
            length => {
                self.heard.extend(buffer.iter().take(length));
                Ok(())
            }
        }
    }

    /// The first whole packet that has come.
    fn packet(&mut self) -> Option<String> {
        let begin = self.heard.iter().position(|byte| *byte == b'$')?;
        let length = self.heard.get(begin..)?.iter().position(|byte| *byte == b'#')?;
        let text = self.heard.get(begin + 1..begin + length)?.to_vec();
        let end = begin + length + 3;
        if self.heard.len() < end {
            return None;
        }
        self.heard.drain(..end);
        String::from_utf8(text).ok()
    }
}

fn word(bytes: &[u8]) -> Option<u32> {
    bytes.try_into().ok().map(u32::from_le_bytes)
}

fn hex(value: u32) -> String {
    value.to_le_bytes().map(|byte| format!("{byte:02x}")).concat()
}

fn failed(why: std::io::Error) -> String {
    format!("QEMU's debugger: {why}")
}

//! The console as a program uses it: lines of commands, JSON objects as answers.
//!
//! Lists have no end mark: each command is followed by `version`, whose object ends what belongs to the command.

use std::time::{Duration, Instant};

use serde_json::Value;
use serial2::Parity;

use crate::patience;
use crate::port::Port;

/// Bit rate, 8N1.
const BAUD: u32 = 115_200;
/// A character each, of a fast typist.
const TYPED: Duration = Duration::from_millis(2);

/// An open console.
pub struct Console {
    port: Port,
    partial: Vec<u8>,
}

impl Console {
    /// Opens the port. What it says after a start is not lost: the stream waits in the port.
    ///
    /// # Errors
    /// The port's.
    pub fn open(path: &str) -> Result<Console, String> {
        Ok(Console { port: Port::open(path, BAUD, Parity::None)?, partial: Vec::new() })
    }

    /// The first line that is an object with this key, within this time.
    ///
    /// # Errors
    /// There was none, or the port is gone.
    pub fn wait_for(&mut self, key: &str, longest: Duration) -> Result<Value, String> {
        let deadline = Instant::now() + longest;
        let mut last = String::new();
        while Instant::now() < deadline {
            let Some(line) = self.line(deadline)? else { break };
            match serde_json::from_str::<Value>(&line) {
                Ok(object) if object.get(key).is_some() => return Ok(object),
                _ => last = line,
            }
        }
        let heard =
            if last.is_empty() { "nothing was heard".to_owned() } else { format!("last heard: {last}") };
        Err(format!("no line with `{key}` on the console within {} s; {heard}", longest.as_secs()))
    }

    /// The same console, behind a port that has no bit rate: what is typed comes at a typist's.
    pub fn typed(self) -> Console {
        Console { port: self.port.paced(TYPED), ..self }
    }

    /// Ends stream and prompt, whichever there is; what the image says of itself.
    ///
    /// # Errors
    /// The console does not say that it has.
    pub fn for_programs(&mut self) -> Result<Value, String> {
        // What is on the line is dropped.
        self.port.send(b"\x03json on\rversion\r")?;
        self.wait_for("what", patience::ANSWER)
    }

    /// Has a command carried out; all objects of its answer.
    ///
    /// # Errors
    /// An error object, or none comes.
    pub fn ask(&mut self, command: &str) -> Result<Vec<Value>, String> {
        self.port.send(format!("{command}\rversion\r").as_bytes())?;
        let deadline = Instant::now() + patience::ANSWER;
        let mut answer = Vec::new();
        let ends = |object: &Value| object["what"] == "clino";
        let mut wanted = if command == "version" { 2 } else { 1 };
        while let Some(line) = self.line(deadline)? {
            let Ok(object) = serde_json::from_str::<Value>(&line) else { continue };
            if let Some(error) = object.get("error") {
                return Err(format!("`{command}`: {error}"));
            }
            if ends(&object) {
                wanted -= 1;
                if wanted == 0 {
                    return Ok(answer);
                }
            }
            answer.push(object);
        }
        Err(format!("`{command}` was not answered within {} s", patience::ANSWER.as_secs()))
    }

    /// Has a command carried out that writes flash, and returns the object with this key that ends it. Nothing else may be
    /// sent meanwhile: the core stands still while flash is erased, and a line of which characters were lost is refused.
    ///
    /// # Errors
    /// There is no such object.
    pub fn ask_flash(&mut self, command: &str, key: &str) -> Result<Value, String> {
        self.port.send(format!("{command}\r").as_bytes())?;
        self.wait_for(key, patience::ANSWER).map_err(|why| format!("`{command}`: {why}"))
    }

    /// Has a command carried out whose answer is a start: `reboot`.
    ///
    /// # Errors
    /// It does not start.
    pub fn restart(&mut self) -> Result<Value, String> {
        self.port.send(b"reboot --yes\r")?;
        let started = self.wait_for("stream", patience::START)?;
        self.for_programs()?;
        Ok(started)
    }

    /// The objects of an answer that have this key with this value.
    ///
    /// # Errors
    /// There is none.
    pub fn find(answer: &[Value], key: &str, value: &str) -> Result<Value, String> {
        let found = answer.iter().find(|object| object[key] == value);
        found.cloned().ok_or_else(|| format!("no object with `{key}` = {value} in {answer:?}"))
    }

    fn line(&mut self, deadline: Instant) -> Result<Option<String>, String> {
        loop {
            if let Some(end) = self.partial.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.partial.drain(..=end).collect();
                return Ok(Some(String::from_utf8_lossy(&line).trim().to_owned()));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            let bytes = self.port.receive(left)?;
            self.partial.extend(bytes);
        }
    }
}

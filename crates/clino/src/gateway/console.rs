//! The gateway's console as a program uses it: one line out, JSON objects back.
//!
//! `json on` ends prompt, echo and stream; the answer of `version` behind it shows that it is in force: what came before belongs to
//! the stream, or to a person. A command that changes something answers with one object, `export` with one for each
//! line, and a `version` behind it shows its end.

use std::time::{Duration, Instant};

use clino_codec::character::Character;
use serde_json::Value;

use crate::port::{Port, PortError};

/// Longest time for an answer: storing settings takes half a second.
const PATIENCE: Duration = Duration::from_secs(5);
/// From one attempt to be heard to the next.
const AGAIN: Duration = Duration::from_secs(1);
/// Attempts to be heard.
const ATTEMPTS: usize = 3;
/// A wait for characters.
const LOOK: Duration = Duration::from_millis(50);

/// Drops the line that was begun.
const CTRL_C: &[u8] = b"\x03";
const JSON_ON: &str = "json on";
const JSON_OFF: &str = "json off";
const VERSION: &str = "version";
/// What its answer is called.
const NAMED: &str = "clino";
/// What `save` answers.
const SAVED: &str = "saved";
/// What the console says of a command that changes something, when it is carried out.
const DONE: [&str; 2] = ["done", "accepted"];

/// Why there is no answer.
pub enum Broken {
    Port(PortError),
    /// Nothing came that is one.
    Silent,
}

impl From<PortError> for Broken {
    fn from(error: PortError) -> Self {
        Self::Port(error)
    }
}

/// A console that answers programs.
pub struct Console {
    port: Box<dyn Port>,
    heard: Vec<Character>,
    line: String,
}

impl Console {
    /// Makes it answer programs.
    ///
    /// # Errors
    /// It does not.
    pub fn begin(port: Box<dyn Port>) -> Result<Self, Broken> {
        let mut console = Self { port, heard: Vec::new(), line: String::new() };
        for _ in 0..ATTEMPTS {
            console.send(CTRL_C)?;
            console.type_line(JSON_ON)?;
            console.type_line(VERSION)?;
            let until = Instant::now() + AGAIN;
            while let Some(object) = console.object(until)? {
                if is_called(&object, NAMED) {
                    console.quiet()?;
                    return Ok(console);
                }
            }
        }
        Err(Broken::Silent)
    }

    /// Gives it back to people.
    ///
    /// # Errors
    /// The port failed.
    pub fn end(&mut self) -> Result<(), Broken> {
        self.type_line(JSON_OFF)
    }

    /// The lines of the configuration.
    ///
    /// # Errors
    /// No answer.
    pub fn export(&mut self) -> Result<Vec<String>, Broken> {
        self.type_line("export")?;
        self.type_line(VERSION)?;
        let mut lines = Vec::new();
        loop {
            let object = self.object(Instant::now() + PATIENCE)?.ok_or(Broken::Silent)?;
            match object.get("export").and_then(Value::as_str) {
                Some(line) => lines.push(line.to_owned()),
                None if is_called(&object, NAMED) => return Ok(lines),
                None => {}
            }
        }
    }

    /// Carries out a command; what the gateway has against it.
    ///
    /// # Errors
    /// No answer.
    pub fn command(&mut self, line: &str) -> Result<Option<String>, Broken> {
        self.type_line(line)?;
        loop {
            let object = self.object(Instant::now() + PATIENCE)?.ok_or(Broken::Silent)?;
            if let Some(error) = object.get("error") {
                return Ok(Some(error.to_string()));
            }
            if is_done(&object) || is_called(&object, SAVED) {
                return Ok(None);
            }
        }
    }

    fn type_line(&mut self, line: &str) -> Result<(), Broken> {
        self.send(format!("{line}\r").as_bytes())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), Broken> {
        self.port.send(bytes)?;
        Ok(self.port.sent()?)
    }

    /// Forgets what is still on its way.
    fn quiet(&mut self) -> Result<(), Broken> {
        let until = Instant::now() + 2 * LOOK;
        while self.object(until)?.is_some() {}
        Ok(())
    }

    /// The next object. What is none, people were to read.
    fn object(&mut self, until: Instant) -> Result<Option<Value>, Broken> {
        loop {
            if let Some(end) = self.line.find('\n') {
                let line: String = self.line.drain(..=end).collect();
                // A prompt, or an echo, may stand before it.
                let object = line
                    .find('{')
                    .and_then(|start| line.get(start..))
                    .and_then(|text| serde_json::from_str(text.trim()).ok());
                match object {
                    Some(object) => return Ok(Some(object)),
                    None => continue,
                }
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.port.receive(left.min(LOOK), &mut self.heard)?;
            self.line.extend(self.heard.drain(..).map(|character| char::from(character.byte)));
        }
    }
}

fn is_done(object: &Value) -> bool {
    DONE.iter().any(|word| object.get(word).and_then(Value::as_bool) == Some(true))
}

fn is_called(object: &Value, what: &str) -> bool {
    object.get("what").and_then(Value::as_str) == Some(what)
}

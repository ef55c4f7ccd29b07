//! The two ports for people and programs: a terminal at the console, a master at the Modbus port.

use std::sync::{Arc, Mutex};

use clino_sim::node::Ns;
use rigless::chip::{Timeline, uart};
use rigless::snapshot::{Error, Reader, Store, Writer};
use rigless::time::VirtualNanos;

use super::bus::Shared;

/// What a host has heard, and is to say.
#[derive(Debug, Default)]
pub struct Said {
    /// Bytes, and when each was complete.
    pub heard: Vec<(Ns, u8)>,
    /// Bytes to be sent, and when.
    pub to_say: std::collections::VecDeque<(Ns, u8)>,
}

/// Shared with the run.
pub type Talk = Arc<Mutex<Said>>;

impl Said {
    /// Says `text` at `at`, a character each millisecond, as a person types.
    pub fn line(&mut self, at: Ns, text: &str) {
        self.to_say.extend((0..).zip(text.bytes()).map(|(number, byte)| (at + number * 1_000_000, byte)));
    }

    /// Says `bytes` at `at`, one behind the other.
    pub fn frame(&mut self, at: Ns, bytes: &[u8]) {
        self.to_say.extend(bytes.iter().map(|byte| (at, *byte)));
    }

    /// All text.
    pub fn text(&self) -> String {
        self.heard.iter().map(|(_, byte)| char::from(*byte)).collect()
    }
}

/// A host on a line; with a driver, if the line has two wires.
#[derive(Debug)]
pub struct Host {
    talk: Talk,
    line: Option<(Shared, Ns)>,
}

impl Host {
    /// At a line without a driver.
    pub fn new(talk: Talk) -> Host {
        Host { talk, line: None }
    }

    /// At the line whose driver DE switches; a character lasts so long.
    pub fn on_pair(talk: Talk, line: Shared, character: Ns) -> Host {
        Host { talk, line: Some((line, character)) }
    }
}

impl Store for Host {
    fn store(&self, _: &mut Writer) -> Result<(), Error> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), Error> {
        Ok(())
    }
}

impl uart::Peer for Host {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let now = context.now().0;
        if let Some((line, character)) = &self.line {
            line.lock().expect("no panic").send(now, *character);
        }
        self.talk.lock().expect("no panic").heard.push((now, word as u8));
    }

    fn restarted(&mut self, _: &mut Timeline<'_, '_>) {
        if let Some((line, _)) = &self.line {
            let mut line = line.lock().expect("no panic");
            (line.is_driven, line.sent_at) = (false, None);
        }
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let mut talk = self.talk.lock().expect("no panic");
        let (at, byte) = *talk.to_say.front()?;
        if at > now.0 {
            return None;
        }
        talk.to_say.pop_front();
        Some(u16::from(byte))
    }
}

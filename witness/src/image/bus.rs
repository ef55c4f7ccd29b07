//! A pair of wires with simulated sensors on it, at the far end of a USART, and the driver that DE switches.
//!
//! A sensor hears a character only while DE is high. What it sends before DE is low is a collision.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use clino_sim::node::{Burst, Heard, Node, Ns};
use rigless::chip::{Timeline, uart};
use rigless::snapshot::{Error, Reader, Store, Writer};
use rigless::time::{EventId, VirtualNanos};

/// What was seen of one line.
#[derive(Debug, Default)]
pub struct Line {
    /// DE is high.
    pub is_driven: bool,
    /// When it last went high.
    pub driven_at: Ns,
    /// The end of the last character that the gateway sent, if DE has not fallen since.
    pub sent_at: Option<Ns>,
    /// The end of the last character, until firmware looks at the port's status.
    pub unnoticed: Option<Ns>,
    /// From the end of a character to the first look at the port's status.
    pub notices: Vec<Ns>,
    /// From the end of the last stop bit to DE low.
    pub releases: Vec<Ns>,
    /// From DE high to the end of the first character.
    pub leads: Vec<Ns>,
    /// From the end of a character to the end of the next one.
    pub characters: Vec<Ns>,
    /// Characters that the gateway sent.
    pub sent: u64,
    /// What must not happen, and when.
    pub faults: Vec<String>,
}

impl Line {
    /// DE was set.
    pub fn drive(&mut self, is_high: bool, now: Ns) {
        if is_high == self.is_driven {
            return;
        }
        self.is_driven = is_high;
        if is_high {
            self.driven_at = now;
        } else if let Some(sent) = self.sent_at.take() {
            self.releases.push(now - sent);
        }
    }

    /// The gateway has sent a character whose stop bit ends now.
    pub fn send(&mut self, now: Ns, character: Ns) {
        self.sent += 1;
        if !self.is_driven || self.driven_at + character > now + 1 {
            self.faults.push(format!(
                "a character ends at {now} ns, DE high since {}: {}",
                self.driven_at, self.is_driven
            ));
        }
        match self.sent_at {
            Some(last) => self.characters.push(now - last),
            None => self.leads.push(now - self.driven_at),
        }
        self.sent_at = Some(now);
        self.unnoticed = Some(now);
    }

    /// Firmware looks at the port's status.
    pub fn look(&mut self, now: Ns) {
        if let Some(sent) = self.unnoticed.take() {
            self.notices.push(now - sent);
        }
    }
}

/// Shared with the run, which sees DE.
pub type Shared = Arc<Mutex<Line>>;

/// The sensors.
pub struct Sensors {
    nodes: Vec<Box<dyn Node>>,
    line: Shared,
    /// Bits per second of the line.
    baud: u32,
    waiting: VecDeque<(Ns, u16)>,
}

impl std::fmt::Debug for Sensors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sensors").field("nodes", &self.nodes.len()).finish_non_exhaustive()
    }
}

impl Sensors {
    /// These sensors on a line.
    pub fn new(nodes: Vec<Box<dyn Node>>, line: Shared, baud: u32) -> Sensors {
        Sensors { nodes, line, baud, waiting: VecDeque::new() }
    }

    fn bits(&self, bits: u64) -> Ns {
        bits * 1_000_000_000 / u64::from(self.baud)
    }

    /// Lets every sensor do what is due.
    fn act(&mut self, context: &mut Timeline<'_, '_>) {
        let now = context.now().0;
        for number in 0..self.nodes.len() {
            while self.nodes[number].next_event().is_some_and(|due| due <= now) {
                let Some(burst) = self.nodes[number].act(now) else { continue };
                self.send(&burst, now);
            }
        }
        let next = self
            .nodes
            .iter()
            .filter_map(|node| node.next_event())
            .chain(self.waiting.iter().map(|(at, _)| *at));
        if let Some(due) = next.filter(|due| *due > now).min() {
            context.schedule(VirtualNanos(due));
        }
    }

    fn send(&mut self, burst: &Burst, now: Ns) {
        let mut line = self.line.lock().expect("no panic");
        if line.is_driven {
            line.faults.push(format!("a sensor answers at {now} ns, and DE is high"));
        }
        for (number, byte) in (0..).zip(&burst.bytes) {
            self.waiting.push_back((burst.start_at + self.bits(10 * number), u16::from(*byte)));
        }
    }
}

impl Store for Sensors {
    fn store(&self, _: &mut Writer) -> Result<(), Error> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), Error> {
        Ok(())
    }
}

impl uart::Peer for Sensors {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let now = context.now().0;
        let character = self.bits(10);
        let is_heard = {
            let mut line = self.line.lock().expect("no panic");
            line.send(now, character);
            line.is_driven
        };
        let centre_of_stop_bit = now - self.bits(1) / 2;
        for node in self.nodes.iter_mut().filter(|_| is_heard) {
            node.hear(Heard { at: centre_of_stop_bit, byte: word as u8, framing_error: false });
        }
        self.act(context);
    }

    fn on_event(&mut self, _: EventId, context: &mut Timeline<'_, '_>) {
        self.act(context);
    }

    fn restarted(&mut self, context: &mut Timeline<'_, '_>) {
        let mut line = self.line.lock().expect("no panic");
        (line.is_driven, line.sent_at) = (false, None);
        drop(line);
        self.act(context);
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let (at, word) = *self.waiting.front()?;
        (at <= now.0).then(|| self.waiting.pop_front()).flatten().map(|_| word)
    }
}

//! The frames on a pair, for people: one line on standard error for each sender.
//!
//! ```text
//!     1.250000 t7 program: 05 01 83
//!     1.252260 t7 t7-1 5 (serial 1001): 05 06 83 00 00 30 39 09
//! ```
//! Seconds since the start of the first start bit, the bus, the sender, the bytes as sent. `!` marks a byte that did not reach
//! the pair as it was sent. A separate line names the drivers that drove the pair against each other.

use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::sync::PoisonError;

use clino_segment::log::{Fate, LineEvent, SharedLog, Talker};
use clino_sim::node::Ns;

const NS_PER_S: u64 = 1_000_000_000;
const NS_PER_US: u64 = 1_000;

/// Follows the log of a pair, and keeps it short.
pub struct Chatter {
    bus: &'static str,
    log: SharedLog,
    verbose: bool,
    nodes: Vec<String>,
    /// The current senders: since when, and the bytes so far.
    speaking: BTreeMap<Talker, (Ns, String)>,
}

impl Chatter {
    /// Tells nothing unless `verbose`.
    pub fn new(bus: &'static str, log: SharedLog, verbose: bool) -> Self {
        let nodes = log.lock().unwrap_or_else(PoisonError::into_inner).nodes.clone();
        Self { bus, log, verbose, nodes, speaking: BTreeMap::new() }
    }

    /// Tells what is new, and forgets it.
    pub fn tell(&mut self) {
        let events = core::mem::take(&mut self.log.lock().unwrap_or_else(PoisonError::into_inner).events);
        if !self.verbose {
            return;
        }
        let mut output = io::stderr().lock();
        for line in events.iter().filter_map(|event| self.line(event)) {
            // A closed standard error is no reason to end.
            let _ = writeln!(output, "{line}");
        }
    }

    fn line(&mut self, event: &LineEvent) -> Option<String> {
        match *event {
            LineEvent::Char { who, start, word, fate, .. } => {
                let (_, bytes) = self.speaking.entry(who).or_insert((start, String::new()));
                let mark = if fate == Fate::Clean { "" } else { "!" };
                bytes.push_str(&format!(" {word:02X}{mark}"));
                None
            }
            LineEvent::De { high: false, .. } => self.ended(Talker::Gateway),
            LineEvent::Drive { node, on: false, .. } => self.ended(Talker::Node(node)),
            LineEvent::Contention { from, ref who, fought: true, .. } => {
                let names: Vec<&str> = who.iter().map(|who| self.name(*who)).collect();
                Some(format!("{} {} talk at once", self.head(from), names.join(" and ")))
            }
            _ => None,
        }
    }

    fn ended(&mut self, who: Talker) -> Option<String> {
        let (start, bytes) = self.speaking.remove(&who)?;
        Some(format!("{} {}:{bytes}", self.head(start), self.name(who)))
    }

    fn head(&self, at: Ns) -> String {
        format!("{:5}.{:06} {}", at / NS_PER_S, at % NS_PER_S / NS_PER_US, self.bus)
    }

    fn name(&self, who: Talker) -> &str {
        match who {
            Talker::Gateway => "program",
            Talker::Node(node) => self.nodes.get(node).map_or("?", String::as_str),
        }
    }
}

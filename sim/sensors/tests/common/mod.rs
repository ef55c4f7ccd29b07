//! A line with one node on it: carries characters at their instants, notes what comes back.

#![allow(dead_code, reason = "each test file uses its own part")]

pub mod isu;
pub mod t7;

use clino_sim::node::{Burst, Heard, Node, Ns};

pub const US: Ns = 1_000;
pub const MS: Ns = 1_000_000;
pub const SECOND: Ns = 1_000_000_000;

/// One bit at `baud`, in nanoseconds, rounded down.
pub fn bit(baud: u32) -> Ns {
    SECOND / u64::from(baud)
}

/// Bytes from a string like the documents print them.
pub fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// End of the last stop bit of a burst.
pub fn end(burst: &Burst) -> Ns {
    burst.start_at + burst.bytes.len() as u64 * 10 * SECOND / u64::from(burst.baud)
}

pub struct Bench<N> {
    pub node: N,
    pub now: Ns,
    /// All bursts so far.
    pub bursts: Vec<Burst>,
}

impl<N: Node> Bench<N> {
    pub fn new(node: N) -> Self {
        Self { node, now: 0, bursts: Vec::new() }
    }

    /// Lets everything up to and including `until` happen.
    pub fn run_until(&mut self, until: Ns) {
        let mut last = None;
        let mut repeats = 0;
        while let Some(at) = self.node.next_event().filter(|at| *at <= until) {
            repeats = if last == Some(at) { repeats + 1 } else { 0 };
            assert!(repeats < 4, "the node is stuck at {at} ns");
            last = Some(at);
            self.now = self.now.max(at);
            if let Some(burst) = self.node.act(self.now) {
                assert!(burst.drive_at >= self.now, "it drives in the past");
                assert!(burst.start_at >= burst.drive_at);
                self.bursts.push(burst);
            }
        }
        self.now = self.now.max(until);
    }

    pub fn run_for(&mut self, time: Ns) {
        self.run_until(self.now + time);
    }

    /// Carries characters to the node from now on, at its own rate, with `gap` between them. Returns the
    /// end of the last stop bit.
    pub fn send_with_gap(&mut self, bytes: &[u8], gap: Ns) -> Ns {
        let baud = self.node.baud();
        for (i, &byte) in bytes.iter().enumerate() {
            let start = if i == 0 { self.now } else { self.now + gap };
            let at = start + bit(baud) * 19 / 2;
            self.run_until(at);
            self.hear(Heard { at, byte, framing_error: false });
            self.run_until(start + bit(baud) * 10);
        }
        self.now
    }

    /// Lets the node hear a character unless it is deaf.
    pub fn hear(&mut self, heard: Heard) {
        let sending =
            self.bursts.last().is_some_and(|b| b.drive_at <= heard.at && heard.at < end(b) + b.hold);
        if !(sending && self.node.deaf_while_sending()) {
            self.node.hear(heard);
        }
    }

    pub fn send(&mut self, bytes: &[u8]) -> Ns {
        self.send_with_gap(bytes, 0)
    }

    /// Sends and waits at most `limit` for a burst, then until it is over.
    pub fn ask_within(&mut self, bytes: &[u8], limit: Ns) -> Option<Burst> {
        let before = self.bursts.len();
        let deadline = self.send(bytes) + limit;
        while self.bursts.len() == before {
            let Some(at) = self.node.next_event().filter(|at| *at <= deadline) else {
                self.run_until(deadline);
                return None;
            };
            self.run_until(at);
        }
        let burst = self.bursts[before].clone();
        self.run_until(end(&burst) + burst.hold);
        Some(burst)
    }

    /// The answer to `command`, both as the documents print them; none within 3 s is the empty string.
    pub fn ask(&mut self, command: &str) -> String {
        let answer = self.ask_within(&hex(command), 3 * SECOND).map_or(Vec::new(), |burst| burst.bytes);
        answer.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
    }

    /// Changes the level on the node's receive pin.
    pub fn node_level(&mut self, high: bool) {
        self.node.line_level(self.now, high);
    }

    pub fn power_cycle(&mut self, off_for: Ns, settle: Ns) {
        self.node.power_off(self.now);
        self.run_for(off_for);
        self.node.power_on(self.now);
        self.run_for(settle);
    }
}

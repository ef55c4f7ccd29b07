//! An ISU whose RX pin is tied low: it receives no commands and sends a line with every new angle.
//!
//! RX and TX are two wires. On a pair that both share, a master cannot hold the one low and leave the other free;
//! this is the module whose TX alone is on the pair.
//!
//! Source: "Interfacing to an ISU Module", section 4, "ASCII Output Mode".

use super::Isu;
use crate::node::{Burst, Heard, Node, Ns};

/// A module with RX tied low since before time 0.
#[derive(Clone, Debug)]
pub struct RxLow(Isu);

impl RxLow {
    /// Powers the module up at time 0 with RX low.
    #[must_use]
    pub fn new(mut isu: Isu) -> Self {
        isu.power_off(0);
        isu.line_level(0, false);
        isu.power_on(0);
        Self(isu)
    }
}

impl Node for RxLow {
    fn baud(&self) -> u32 {
        self.0.baud()
    }

    /// What goes over the pair does not reach RX.
    fn hear(&mut self, _heard: Heard) {}

    fn next_event(&self) -> Option<Ns> {
        self.0.next_event()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        self.0.act(now)
    }

    fn power_off(&mut self, now: Ns) {
        self.0.power_off(now);
    }

    fn power_on(&mut self, now: Ns) {
        self.0.power_on(now);
    }
}

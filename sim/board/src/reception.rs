//! A log of received characters of a serial port, each with the flags that the USART's receiver raised.
//!
//! The emulated USART itself writes it, so that a test knows what the firmware could know under any impairment.
//! Not logged: a character that the receiver cannot have heard (switched off, without a clock or a pin).

use std::fmt;
use std::sync::{Arc, Mutex};

use clino_sim::node::Ns;

use crate::timeline::lock;

/// A character at the receiver, and the error flags that belong to it (RM0090 section 30.6.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// Centre of the stop bit.
    pub at: Ns,
    /// All bits between start and stop bit, the parity bit included.
    pub word: u16,
    /// FE: the stop bit was low.
    pub framing: bool,
    /// NF: samples disagreed.
    pub noise: bool,
    /// PE: the parity bit is wrong.
    pub parity: bool,
    /// ORE: the character before has not been fetched. This one is lost; its other flags are not raised.
    pub overrun: bool,
}

impl Reception {
    /// The eight data bits.
    pub fn byte(&self) -> u8 {
        self.word as u8
    }

    /// No flag was raised.
    pub fn is_clean(&self) -> bool {
        !(self.framing || self.noise || self.parity || self.overrun)
    }
}

impl fmt::Display for Reception {
    /// The word in hexadecimal, and the flags.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02x}", self.word)?;
        for (flag, name) in [
            (self.framing, "framing_error"),
            (self.noise, "noise"),
            (self.parity, "parity_error"),
            (self.overrun, "overrun"),
        ] {
            if flag {
                write!(f, " {name}")?;
            }
        }
        Ok(())
    }
}

/// The characters of one port, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Receptions(Arc<Mutex<Vec<Reception>>>);

impl Receptions {
    /// One more.
    pub fn note(&self, reception: Reception) {
        lock(&self.0).push(reception);
    }

    /// All that are kept.
    pub fn all(&self) -> Vec<Reception> {
        lock(&self.0).clone()
    }

    /// Drops what came before `horizon`.
    pub fn forget(&self, horizon: Ns) {
        lock(&self.0).retain(|reception| reception.at >= horizon);
    }
}

//! The settings of a line.

use crate::{Duration, Serial};

/// The properties of the wires of a [`Line`](super::Line). Spans in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineSettings {
    /// Bit rate and framing.
    pub serial: Serial,
    /// Silence between the end of anything heard and our next DE.
    pub guard: Duration,
    /// From DE high to our first start bit, for a transceiver that is slow to drive.
    pub pre_delay: Duration,
    /// From our last stop bit to DE low, for a cable that needs its idle level driven. Not longer than the fastest
    /// sensor takes to answer; a character that is heard ends it.
    pub post_delay: Duration,
    /// Whether our own characters come back.
    pub echo: EchoMode,
}

impl LineSettings {
    /// No delay around DE, no echo: a transceiver whose receiver is off while it drives.
    pub const fn new(serial: Serial, guard: Duration) -> LineSettings {
        LineSettings {
            serial,
            guard,
            pre_delay: Duration::ZERO,
            post_delay: Duration::ZERO,
            echo: EchoMode::Off,
        }
    }
}

/// Whether the receiver hears what we send: it does when RE̅ is not tied to DE.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EchoMode {
    /// It does not: every character comes from another node.
    #[default]
    Off,
    /// It does: every character of ours has to come back as it was sent.
    Expected,
    /// Find out: a frame that came back whole proves an echo, a frame of which nothing came back proves that there is
    /// none (any more).
    Detect,
}

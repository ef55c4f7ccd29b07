//! The interface between a simulated sensor and its line.
//!
//! Everything is sans-IO: a node takes what its receiver sampled and when, returns when it next wants to act,
//! and hands out whole [`Burst`]s. It knows nothing of other nodes, of noise or of other drivers on the line:
//! the segment models these.

/// Virtual time in nanoseconds since power-up of the simulation.
pub type Ns = u64;

/// One character as a node's own receiver sampled it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heard {
    /// Centre of the stop bit: the instant at which a UART knows the character.
    pub at: Ns,
    /// The eight data bits as sampled.
    pub byte: u8,
    /// The stop bit was sampled low.
    pub framing_error: bool,
}

/// A run of characters that a node sends without a gap, and the time its line driver is on around them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Burst {
    /// The node's driver takes the line (drives it idle-high until the first start bit).
    pub drive_at: Ns,
    /// First start bit.
    pub start_at: Ns,
    /// What is sent, 8N1, least significant bit first, back to back.
    pub bytes: Vec<u8>,
    /// Bit rate in bit/s.
    pub baud: u32,
    /// How long after the last stop bit the driver still holds the line, in nanoseconds.
    pub hold: Ns,
}

/// A sensor on a serial line.
pub trait Node: Send {
    /// Bit rate at which the node samples the line just now, in bit/s.
    fn baud(&self) -> u32;

    /// One character was sampled. The segment does not call this while the node is deaf.
    fn hear(&mut self, heard: Heard);

    /// Earliest instant at which the node wants [`Node::act`] called, if any.
    fn next_event(&self) -> Option<Ns>;

    /// Does what is due at `now`; may start to send. The segment puts the burst on the line unless the
    /// node is unplugged or loses power meanwhile.
    fn act(&mut self, now: Ns) -> Option<Burst>;

    /// Whether the node's receiver is deaf between `drive_at` and the end of its own burst.
    fn deaf_while_sending(&self) -> bool {
        true
    }

    /// Power is gone: everything volatile is lost. Called with the instant of the cut.
    fn power_off(&mut self, now: Ns);

    /// Power is back.
    fn power_on(&mut self, now: Ns);

    /// The level on the node's receive pin changed (ASCII mode and break detection use this).
    fn line_level(&mut self, _now: Ns, _high: bool) {}
}

//! What comes to the gateway core and what it hands out, beside the events of a line: captures, actions of a port,
//! requesters.

use clino_bus::{Timing, line};
use clino_codec::pwm::Ticks;

/// What a timer input saw. Raw: the law that makes an angle of it is the codec's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Capture {
    /// One whole cycle, rising edge to rising edge.
    Cycle(Ticks),
    /// An edge was not read before the next one overwrote it; the cycle is not trustworthy.
    LostEdge,
    /// No edge for longer than any legal period; the pin sits at this level.
    NoSignal {
        /// The pin is high.
        high: bool,
    },
}

/// What a bus's port has to do for the gateway.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action<'a> {
    /// Send this frame.
    Send(&'a [u8]),
    /// Run with this bit rate and these waits from now on.
    Run(Timing, line::LineSettings),
}

/// The interface an order comes from. The outcome of a task is reported to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Requester {
    /// The console.
    Console,
    /// The Modbus master.
    Modbus,
}

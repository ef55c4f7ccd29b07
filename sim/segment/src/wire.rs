//! The interface between the emulated USART and the circuit at its TX, RX and DE pins.
//!
//! The USART owns bit timing of what it sends and tells the wire its receiver's format; the wire owns the
//! physics: which driver is on when, what each receiver samples, noise, and the log.
//!
//! Times are nanoseconds since power-up; bit times are picoseconds, because 1/115200 s is not a whole number
//! of nanoseconds.

use clino_sim::node::Ns;

/// How a UART frames characters on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Length of one bit in picoseconds.
    pub bit_ps: u64,
    /// Bits between start and stop bit, parity bit included: 8 or 9.
    pub data_bits: u8,
    /// Stop bits in halves: 1, 2, 3 or 4.
    pub stop_halves: u8,
}

/// One character the USART shifts out: start bit at `start`, then `format.data_bits` of `word`, least
/// significant first, then the stop bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// Beginning of the start bit.
    pub start: Ns,
    /// Data bits (and the parity bit above them, when there is one).
    pub word: u16,
    /// Bit time and framing.
    pub format: Format,
}

/// One character as the USART's receiver sampled it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// Centre of the (first) stop bit.
    pub at: Ns,
    /// The sampled bits, `data_bits` of them.
    pub word: u16,
    /// The stop bit was low.
    pub framing_error: bool,
    /// Samples within a bit disagreed (the line was fought over or noisy).
    pub noise: bool,
}

/// What hangs on one USART.
pub trait Wire: Send {
    /// The USART's receiver is on with this format, or off.
    fn set_receiver(&mut self, now: Ns, format: Option<Format>);

    /// The USART starts a character. Called at `sent.start` (never for the past).
    fn send(&mut self, sent: Sent);

    /// The GPIO that enables the line driver changed.
    fn drive_enable(&mut self, now: Ns, high: bool);

    /// Earliest instant at which [`Wire::advance`] wants to be called.
    fn next_event(&self) -> Option<Ns>;

    /// Lets everything up to and including `now` happen.
    fn advance(&mut self, now: Ns);

    /// A character whose stop-bit centre has been reached, in order.
    fn take_received(&mut self) -> Option<Received>;
}

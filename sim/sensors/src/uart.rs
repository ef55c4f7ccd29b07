//! Character timing on an asynchronous line, 8N1.
//!
//! All instants a node sees or schedules are rounded down to whole nanoseconds; the error is far below one
//! bit at every rate in use and does not add up, because each instant is computed from its own frame.

use crate::node::Ns;

/// Start bit, eight data bits, stop bit.
const HALF_BITS_PER_CHARACTER: u64 = 20;

/// Half-bits in one second at 1 bit/s, in nanoseconds.
const HALF_SECOND: u64 = 500_000_000;

/// Length of `half_bits` half bit times at `baud` bit/s.
fn half_bits(half_bits: u64, baud: u32) -> Ns {
    half_bits * HALF_SECOND / u64::from(baud.max(1))
}

/// From the centre of a stop bit, where a receiver knows the character, to its end, where the line is free.
pub(crate) fn rest_of_stop_bit(baud: u32) -> Ns {
    half_bits(1, baud)
}

/// Length of `count` characters sent back to back.
pub(crate) fn characters(count: usize, baud: u32) -> Ns {
    half_bits(count as u64 * HALF_BITS_PER_CHARACTER, baud)
}

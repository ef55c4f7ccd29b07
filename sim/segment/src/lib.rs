//! An RS485 segment in virtual time, with a master's UART on one side and simulated sensors on the other.
//!
//! | Part | What |
//! |---|---|
//! | [`Segment`] | the pair: its drivers, what each receiver samples, disturbances |
//! | [`wire`] | the seam to the master's UART |
//! | [`log`] | everything that happened on it, for tests and figures |
//! | [`trace`] | its level over time, as a logic analyser records it |
//!
//! The virtual board, the host tests of the portable crates and the simulator on pseudo-terminals hang on it.

pub mod log;
mod segment;
pub mod trace;
pub mod wire;

/// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use segment::{
    Babble, Faults, LineFaults, Noise, Probability, Segment, SegmentSettings, Station, StuckLine, chance,
};

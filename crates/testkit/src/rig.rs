//! Test rig: the portable bus code on a simulated segment, in virtual time, without the board.
//!
//! [`Port`] does what `src/uart.rs` does on the board: it moves the characters of a
//! [`Line`](clino_bus::Line) to and from the wire and switches DE. [`Bench`] adds a
//! [`Master`](clino_bus::Master) and asks one question at a time.
//!
//! Tests only: it panics where the rig itself is used wrongly.

mod bench;
mod port;

pub use bench::{Bench, sensor};
pub use port::Port;

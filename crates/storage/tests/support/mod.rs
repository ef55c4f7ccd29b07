//! Flash that enforces the rules of the part, and configurations to put into it.
#![allow(dead_code)]

pub mod configurations;
pub mod flash;
pub mod random;

/// A buffer to copy.
pub const BUFFER: clino_storage::Buffer = [0; clino_storage::record::LONGEST];

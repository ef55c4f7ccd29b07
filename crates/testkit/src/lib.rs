//! Tools for tests: what more than one crate's tests need.
//!
//! Each tool is a feature, so that a test gets the crates that its tool needs, and no others.

#[cfg(feature = "programs")]
pub mod programs;
#[cfg(feature = "rig")]
pub mod rig;

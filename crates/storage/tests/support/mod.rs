//! Flash that enforces the rules of the part, and configurations to put into it.
#![allow(dead_code)]

pub mod configurations;
pub mod flash;
pub mod random;

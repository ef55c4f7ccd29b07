//! Flash that enforces the rules of the part, configurations to put into it, and other writers of it.
#![allow(dead_code)]

pub mod configurations;
pub mod flash;
pub mod other;
pub mod random;

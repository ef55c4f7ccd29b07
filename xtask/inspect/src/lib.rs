//! What can be asked of a firmware image: how deep its stack gets at worst, and which panics are left in it.
//!
//! - [`elf`]: functions, instructions' bytes, constants, vectors
//! - [`instruction`]: what one instruction does to the flow of control and to the stack
//! - [`frames`]: all ways through one function: its frame, its calls with the depth at each
//! - [`cfi`]: the same depths as the compiler notes them for debuggers, to compare
//! - [`calls`]: who calls whom, indirect calls included
//! - [`annotations`]: what no analysis can know: callees of indirect calls, bounds of recursion, priorities
//! - [`stack`]: the deepest chain of every priority level, and their sum
//! - [`report`]: all of these together
//! - [`source`]: the line of the source an instruction comes from
//! - [`panics`]: who calls what ends in the panic handler
//!
//! For Thumb-2 (ARMv7-M) only. The program is one whose image has its symbols.

pub mod annotations;
pub mod budget;
pub mod calls;
pub mod cfi;
pub mod elf;
pub mod frames;
pub mod instruction;
pub mod panics;
pub mod report;
pub mod source;
pub mod stack;

use std::fmt;

/// Why an image cannot be analysed, or does not keep what it promises.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(String);

impl Error {
    /// With what is to be said.
    pub fn new(message: impl Into<String>) -> Error {
        Error(message.into())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

macro_rules! from {
    ($($what:ty),* $(,)?) => {
        $(impl From<$what> for Error {
            fn from(error: $what) -> Error {
                Error(error.to_string())
            }
        })*
    };
}

from!(object::Error, capstone::Error, gimli::Error, toml::de::Error, std::io::Error);

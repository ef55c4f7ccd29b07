//! The virtual board: the shipped ELF on an emulated STM32F407, with real bit timing on its pins.

pub mod wire;

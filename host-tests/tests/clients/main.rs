//! Stock clients against the image in real time: what people and programs have at hand, on pseudo-terminals.
//!
//! The clients are installed by the tests below the target directory: pyserial and pymodbus from the package index, into
//! a Python of their own; `mbpoll` from the distribution. Without Python or the network the tests fail and say so;
//! where `mbpoll`, `sigrok-cli` or one of the other masters (`strangers.rs`) cannot be had, its test says SKIPPED on standard error.
//!
//! The computer may be slower than real time, and the tests may run side by side: waits are generous. Each test ends its
//! board as a person does, and looks whether the board has anything to complain about.
#![cfg(target_os = "linux")]

mod bench;
mod board;
mod console;
mod hil;
mod modbus;
mod scripts;
mod sigrok;
mod strangers;

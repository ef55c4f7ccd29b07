//! The virtual board: the shipped ELF on an emulated STM32F407 or STM32F446, with real bit timing on its pins.

pub mod analysis;
pub mod checker;
pub mod console;
pub mod edges;
pub mod gaps;
pub mod impairment;
pub mod incident;
pub mod injection;
pub mod modbus;
pub mod reception;
pub mod run;
pub mod scenario;
pub mod summary;
pub mod vcd;

// The emulator half.
mod cpu;
mod crystal;
pub mod elf;
pub mod flash;
mod machine;
mod model;
pub mod oscillators;
mod ports;
pub mod pwm;
mod rtt;
mod timeline;
mod usart;
mod watchdog;
mod wrapped;

pub use cpu::{BareCore, CpuStats, Fault};
pub use machine::{Board, BuildError, Stopped};
pub use model::{BoardModel, NoSuchBoard};
pub use ports::{HostPorts, Ports, SerialPort};

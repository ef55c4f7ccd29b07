//! The parts of the gateway that a build can leave out: its Cargo features, which are read here.
//!
//! What is left out is in none of the lists from which the doors are made: [`Bus::ALL`](crate::Bus::ALL), the names of the
//! kinds, the commands, the blocks of the register map. Code behind a constant that is `false` is not in the image.

/// Tasks that find, set up and repair sensors.
pub const COMMISSIONING: bool = cfg!(feature = "commissioning");
/// ISUs on a serial line, and their bus.
pub const ISU: bool = cfg!(feature = "isu");
/// The PWM inputs.
pub const PWM: bool = cfg!(feature = "pwm");

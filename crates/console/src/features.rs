//! The parts of the gateway that this build serves: what is left out is in no command, no help and no completion.

pub use clino_gateway::features::{COMMISSIONING, ISU};

/// The Modbus port.
pub const MODBUS: bool = cfg!(feature = "modbus");

/// A text if the build has ISUs.
#[cfg(feature = "isu")]
macro_rules! if_isu {
    ($text:literal) => {
        $text
    };
}
#[cfg(not(feature = "isu"))]
macro_rules! if_isu {
    ($text:literal) => {
        ""
    };
}

/// A text if the build has PWM inputs.
#[cfg(feature = "pwm")]
macro_rules! if_pwm {
    ($text:literal) => {
        $text
    };
}
#[cfg(not(feature = "pwm"))]
macro_rules! if_pwm {
    ($text:literal) => {
        ""
    };
}

/// A text if the build has the Modbus port.
#[cfg(feature = "modbus")]
macro_rules! if_modbus {
    ($text:literal) => {
        $text
    };
}
#[cfg(not(feature = "modbus"))]
macro_rules! if_modbus {
    ($text:literal) => {
        ""
    };
}

pub(crate) use {if_isu, if_modbus, if_pwm};

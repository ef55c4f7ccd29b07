//! In the place of `pwm.rs` in an image without PWM inputs: the timers and the pins stay as a reset leaves them.

use clino_bus::Instant;
use clino_gateway::Capture;
use heapless::spsc::Producer;
use stm32f4xx_hal::rcc::Rcc;

use crate::board::{Pwm1Line, Pwm2Line};

/// No port.
pub struct Port;

pub type Port1 = Port;
pub type Port2 = Port;

/// Takes nothing into service.
pub fn start(
    _: Pwm1Line,
    _: Pwm2Line,
    _: &mut Rcc,
    _: Producer<'static, Capture>,
    _: Producer<'static, Capture>,
) -> (Port1, Port2) {
    (Port, Port)
}

impl Port {
    pub fn poll(&mut self, _: Instant) -> Instant {
        Instant::NEVER
    }

    /// Its interrupt is not switched on.
    pub fn on_interrupt(&mut self) -> bool {
        false
    }
}

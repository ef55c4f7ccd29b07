//! In the place of `isu.rs` in an image without ISUs: the USART and the pins stay as a reset leaves them.

use clino_bus::{DriverEnable, Instant, Timing};
use clino_gateway::Action;
use stm32f4xx_hal::rcc::Rcc;

use crate::board::IsuLine;
use crate::events::Producer;
use crate::uart::BusPort;

/// No port.
pub struct Port;

/// Takes nothing into service.
pub fn start(_: IsuLine, _: &mut Rcc, _: &Timing, _: u32, _: Producer) -> Port {
    Port
}

impl BusPort for Port {
    fn act(&mut self, _: Action<'_>) {}

    fn poll(&mut self, _: Instant) -> Option<Instant> {
        None
    }
}

impl Port {
    pub fn is_driving(&self) -> bool {
        false
    }

    pub fn driver_enable(&self) -> DriverEnable {
        DriverEnable::default()
    }

    /// Its interrupt is not switched on.
    pub fn on_interrupt(&mut self) -> bool {
        false
    }
}

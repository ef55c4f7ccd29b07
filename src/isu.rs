//! The port of the ISU bus.

use clino_bus::Timing;
use stm32f4xx_hal::rcc::Rcc;

use crate::board::{IsuDe, IsuLine, IsuUsart};
use crate::events::Producer;
use crate::uart::Rs485;

pub type Port = Rs485<IsuUsart, IsuDe>;

/// Takes the line into service, with a core at `core_hz`.
pub fn start(line: IsuLine, rcc: &mut Rcc, timing: &Timing, core_hz: u32, events: Producer) -> Port {
    let (usart, de, clock_hz) = line.start(rcc);
    Rs485::new(usart, de, timing, clock_hz, core_hz, events)
}

//! In the place of `console.rs` in an image without a console: its USART and its pins stay as a reset leaves them.

use stm32f4xx_hal::rcc::Rcc;

use crate::board::ConsoleLine;

/// Characters received: none.
pub type Keys = ();
/// Where text would be written to.
pub type Writer = ();

/// No queues.
pub struct Queues;

impl Queues {
    pub const fn new() -> Queues {
        Queues
    }
}

/// No port.
pub struct Port;

/// Takes nothing into service.
pub fn start(_: ConsoleLine, _: &mut Rcc, _: &'static mut Queues) -> (Port, Keys, Writer) {
    (Port, (), ())
}

impl Port {
    /// Nothing is ever written.
    pub fn is_drained(&self) -> bool {
        true
    }

    /// Its interrupt is not switched on.
    pub fn on_interrupt(&mut self) {}
}

//! In the place of `modbus.rs` in an image without Modbus: its level has nothing to do, its USART and its pins stay as a reset
//! leaves them.

use core::cell::RefCell;

use clino_modbus::Settings;
use clino_recovery::Start;
use stm32f4xx_hal::rcc::Rcc;

use crate::app::modbus_level::SharedResources;
use crate::board::ModbusLine;

/// No server.
pub struct Server;

/// No characters.
pub struct Lines;

/// No level.
pub struct Level;

pub mod port {
    //! No port.

    /// No port.
    pub struct Port;

    /// No queues.
    pub struct Queues;

    impl Queues {
        pub const fn new() -> Queues {
            Queues
        }
    }

    impl Port {
        pub fn is_driving(&self) -> bool {
            false
        }

        /// Its interrupt is not switched on.
        pub fn on_interrupt(&mut self) -> bool {
            false
        }
    }
}

/// Takes nothing into service.
pub fn start(_: ModbusLine, _: &mut Rcc, _: &Settings, _: &'static mut port::Queues) -> (port::Port, Lines) {
    (port::Port, Lines)
}

/// No server.
pub fn server(_: Settings) -> Server {
    Server
}

impl Level {
    pub fn new(_: &mut Lines, _: &mut Server, _: &'static Start, _: &RefCell<SharedResources<'_>>) -> Level {
        Level
    }

    pub fn run(&mut self) -> bool {
        false
    }
}

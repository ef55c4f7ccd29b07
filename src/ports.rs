//! The ports of the sensors: which register blocks and pins each of them is made of, and what the bus level asks of
//! them.
//!
//! Each port is a resource of its own (`main.rs`): a lock of it holds off the interrupts of its priority and below.

use clino_bus::{DriverEnable, Instant};
use clino_gateway::{Action, Bus};
use embedded_hal::digital::OutputPin;
use rtic::Mutex;

use crate::board::{T7De, T7Usart};
use crate::isu;
use crate::log::log;
use crate::uart::{Rs485, Usart};

pub type T7Port = Rs485<T7Usart, T7De>;

/// The port of a bus, as the bus level sees it.
pub trait BusPort {
    /// Has the line do this: a frame to be sent, or other settings, which come between two exchanges.
    fn act(&mut self, action: Action<'_>);
    /// Lets time pass; returns when it wants it again.
    fn poll(&mut self) -> Option<Instant>;
}

impl<U: Usart, D: OutputPin> BusPort for Rs485<U, D> {
    fn act(&mut self, action: Action<'_>) {
        match action {
            Action::Send(frame) => {
                if let Err(error) = self.submit(frame) {
                    // The master's own deadline ends the exchange.
                    log!(warn, "frame not accepted: {}", error);
                }
            }
            Action::Run(timing, line) => self.run(&timing, line),
        }
    }

    fn poll(&mut self) -> Option<Instant> {
        // The port looks at the clock itself: how long a driver may be on counts from the instant it is switched on.
        Rs485::poll(self);
        self.poll_at()
    }
}

/// Has a bus's line do this.
pub fn act<P: BusPort>(port: &mut impl Mutex<T = P>, action: Action<'_>) {
    port.lock(|port| port.act(action));
}

/// Lets time pass in a bus's port; returns when it wants it again.
pub fn poll<P: BusPort>(port: &mut impl Mutex<T = P>) -> Option<Instant> {
    port.lock(BusPort::poll)
}

/// How a bus's driver enable behaved since reset.
pub fn driver_enable(
    bus: Bus,
    t7: &mut impl Mutex<T = T7Port>,
    isu: &mut impl Mutex<T = isu::Port>,
) -> DriverEnable {
    match bus {
        Bus::T7 => t7.lock(|port| port.driver_enable()),
        Bus::Isu => isu.lock(|port| port.driver_enable()),
    }
}

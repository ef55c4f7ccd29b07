//! The ports of the sensors: which register blocks and pins each of them is made of, and what the bus level asks of
//! them.
//!
//! Each port is a resource of its own (`main.rs`): a lock of it holds off the interrupts of its priority and below.

use clino_bus::{DriverEnable, Instant};
use clino_gateway::{Action, Bus};
use embedded_hal::digital::OutputPin;
use rtic::Mutex;

use crate::board::{IsuDe, IsuUsart, Pwm1Pin, Pwm1Timer, Pwm2Pin, Pwm2Timer, T7De, T7Usart};
use crate::capture::PwmCapture;
use crate::log::log;
use crate::uart::{Rs485, Usart};

pub type T7Port = Rs485<T7Usart, T7De>;
pub type IsuPort = Rs485<IsuUsart, IsuDe>;
pub type Pwm1Port = PwmCapture<Pwm1Timer, Pwm1Pin>;
pub type Pwm2Port = PwmCapture<Pwm2Timer, Pwm2Pin>;

/// Has a bus's line do this: a frame to be sent, or other settings, which come between two exchanges.
pub fn act<U: Usart, D: OutputPin>(port: &mut impl Mutex<T = Rs485<U, D>>, action: Action<'_>) {
    match action {
        Action::Send(frame) => {
            if let Err(error) = port.lock(|port| port.submit(frame)) {
                // The master's own deadline ends the exchange.
                log!(warn, "frame not accepted: {}", error);
            }
        }
        Action::Run(timing, line) => port.lock(|port| port.run(&timing, line)),
    }
}

/// Lets time pass in a bus's port; returns when it wants it again.
pub fn poll<U: Usart, D: OutputPin>(port: &mut impl Mutex<T = Rs485<U, D>>) -> Option<Instant> {
    // The port looks at the clock itself: how long a driver may be on counts from the instant it is switched on.
    port.lock(|port| {
        port.poll();
        port.poll_at()
    })
}

/// How a bus's driver enable behaved since reset.
pub fn driver_enable(
    bus: Bus,
    t7: &mut impl Mutex<T = T7Port>,
    isu: &mut impl Mutex<T = IsuPort>,
) -> DriverEnable {
    match bus {
        Bus::T7 => t7.lock(|port| port.driver_enable()),
        Bus::Isu => isu.lock(|port| port.driver_enable()),
    }
}

//! The ports of the sensors: which register blocks and pins each of them is made of, and what the bus level asks of
//! them.
//!
//! Each port is a resource of its own (`main.rs`): a lock of it holds off the interrupts of its priority and below.

use clino_bus::{DriverEnable, Instant};
use clino_gateway::{Action, Bus};
use rtic::Mutex;

use crate::board::{T7De, T7Usart};
use crate::isu;
use crate::uart::{BusPort, Rs485};

pub type T7Port = Rs485<T7Usart, T7De>;

/// Has a bus's line do this.
pub fn act<P: BusPort>(port: &mut impl Mutex<T = P>, action: Action<'_>) {
    port.lock(|port| port.act(action));
}

/// Lets time pass in a bus's port, if it wants that at `now`; returns when it wants it next.
pub fn poll<P: BusPort>(port: &mut impl Mutex<T = P>, now: Instant) -> Option<Instant> {
    port.lock(|port| port.poll(now))
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

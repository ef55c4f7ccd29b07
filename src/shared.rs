//! How the levels wake each other: a note that there may be something to print, and how a task waits to be woken.

use core::pin::Pin;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::{Context, Poll};

use clino_gateway::Bus;
use clino_recovery::MonitoredTask;

use crate::app::{bus_level, modbus_level};
use crate::watchdog;

/// The buses of this image.
pub const BUSES: [Bus; Bus::COUNT] = Bus::ALL;

static WORK: AtomicBool = AtomicBool::new(true);

/// There may be something to print.
pub fn note_work() {
    WORK.store(true, Ordering::Relaxed);
}

/// Sleeps until there may be something to print.
pub fn sleep_until_work() {
    // With interrupts masked, an interrupt that comes between the look and the sleep still ends the sleep.
    while !critical_section::with(|_| {
        watchdog::check_in(MonitoredTask::Console);
        if !WORK.load(Ordering::Relaxed) {
            cortex_m::asm::dsb();
            cortex_m::asm::wfi();
        }
        WORK.swap(false, Ordering::Relaxed)
    }) {}
}

/// Wakes the bus level.
#[inline(never)]
pub fn wake_bus() {
    bus_level::waker().wake_by_ref();
}

/// Wakes the Modbus level.
#[inline(never)]
pub fn wake_modbus() {
    modbus_level::waker().wake_by_ref();
}

/// Ends when the task is woken.
pub fn woken() -> Woken {
    Woken { is_over: false }
}

/// See [`woken`].
pub struct Woken {
    is_over: bool,
}

impl Future for Woken {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<()> {
        if core::mem::replace(&mut self.is_over, true) { Poll::Ready(()) } else { Poll::Pending }
    }
}

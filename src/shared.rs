//! What the bus level publishes and the people level reads: the snapshot of all slots, the state of every bus, and a
//! note that something has changed.
//!
//! The snapshot needs no lock. The state of a bus is copied whole, in a critical section: no interrupt waits for more than
//! one copy.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};

use clino_console::BusState;
use clino_gateway::{Bus, Reading, Snapshot};
use critical_section::Mutex;

/// The buses.
pub const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

/// All slots at one instant. The bus level has its publisher.
pub static SNAPSHOT: Snapshot = Snapshot::new();
static BUS_STATES: Mutex<RefCell<[Option<BusState>; BUSES.len()]>> =
    Mutex::new(RefCell::new([None; BUSES.len()]));
static WORK: AtomicBool = AtomicBool::new(true);

/// Replaces what is known of a bus.
pub fn publish_bus(bus: Bus, state: BusState) {
    critical_section::with(|cs| BUS_STATES.borrow_ref_mut(cs)[index(bus)] = Some(state));
}

/// The last reading of a slot.
pub fn reading(slot: usize) -> Option<Reading> {
    SNAPSHOT.read(|view| view.reading(slot))
}

/// What is known of a bus.
pub fn bus(bus: Bus) -> Option<BusState> {
    critical_section::with(|cs| BUS_STATES.borrow_ref(cs)[index(bus)])
}

const fn index(bus: Bus) -> usize {
    match bus {
        Bus::T7 => 0,
        Bus::Isu => 1,
    }
}

/// There may be something to print.
pub fn note_work() {
    WORK.store(true, Ordering::Relaxed);
}

/// Sleeps until there may be something to print.
pub fn sleep_until_work() {
    // With interrupts masked, an interrupt that comes between the look and the sleep still ends the sleep.
    while !critical_section::with(|_| {
        if !WORK.load(Ordering::Relaxed) {
            cortex_m::asm::dsb();
            cortex_m::asm::wfi();
        }
        WORK.swap(false, Ordering::Relaxed)
    }) {}
}

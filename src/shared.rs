//! What the bus level publishes and the people level reads: the last reading of every slot, the state of
//! every bus, and a note that something has changed.
//!
//! Everything is copied whole, one reading to a critical section: no reader sees half a reading, and no interrupt
//! waits for more than one copy.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};

use clino_console::BusState;
use clino_gateway::{Bus, MAX_SLOTS, Reading};
use critical_section::Mutex;
use heapless::Vec;

/// The buses.
pub const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

static READINGS: Mutex<RefCell<Vec<Reading, MAX_SLOTS>>> = Mutex::new(RefCell::new(Vec::new()));
static BUS_STATES: Mutex<RefCell<[Option<BusState>; BUSES.len()]>> =
    Mutex::new(RefCell::new([None; BUSES.len()]));
static WORK: AtomicBool = AtomicBool::new(true);

/// Replaces the reading of its slot. Slots are published in order at first.
pub fn publish(reading: Reading) {
    critical_section::with(|cs| {
        let mut readings = READINGS.borrow_ref_mut(cs);
        match readings.get_mut(usize::from(reading.slot)) {
            Some(place) => *place = reading,
            None => _ = readings.push(reading),
        }
    });
    note_work();
}

/// Replaces what is known of a bus.
pub fn publish_bus(bus: Bus, state: BusState) {
    critical_section::with(|cs| BUS_STATES.borrow_ref_mut(cs)[index(bus)] = Some(state));
}

/// The last reading of a slot.
pub fn reading(slot: usize) -> Option<Reading> {
    critical_section::with(|cs| READINGS.borrow_ref(cs).get(slot).copied())
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

//! What the bus level publishes and the people level reads: the last reading of every slot, the statistics of
//! every bus, and a note that something has changed.
//!
//! Everything is copied whole, one reading to a critical section: no reader sees half a reading, and no interrupt
//! waits for more than one copy.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};

use clino_bus::Counters;
use clino_gateway::json::DriverEnable;
use clino_gateway::{Bus, MAX_SLOTS, Reading};
use critical_section::Mutex;
use heapless::Vec;

/// The buses, in the order of their statistics.
pub const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

pub type BusStatistics = (Bus, Counters, DriverEnable);

static READINGS: Mutex<RefCell<Vec<Reading, MAX_SLOTS>>> = Mutex::new(RefCell::new(Vec::new()));
static STATISTICS: Mutex<RefCell<Vec<BusStatistics, { BUSES.len() }>>> = Mutex::new(RefCell::new(Vec::new()));
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

/// Replaces the statistics of a bus.
pub fn publish_statistics(statistics: BusStatistics) {
    critical_section::with(|cs| {
        let mut all = STATISTICS.borrow_ref_mut(cs);
        match all.iter_mut().find(|(bus, ..)| *bus == statistics.0) {
            Some(place) => *place = statistics,
            None => _ = all.push(statistics),
        }
    });
}

/// The last reading of a slot.
pub fn reading(slot: usize) -> Option<Reading> {
    critical_section::with(|cs| READINGS.borrow_ref(cs).get(slot).copied())
}

/// Statistics number `index`.
pub fn statistics(index: usize) -> Option<BusStatistics> {
    critical_section::with(|cs| STATISTICS.borrow_ref(cs).get(index).copied())
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

//! The bus level keeps nothing per node but two bits: its state does not grow with the bus.

use std::mem::size_of;

use clino_bus::{Event, Isu, Line, Master, T7};

/// A pointer-sized number has 8 bytes here and 4 on the target: what is counted here is an upper bound for there.
#[test]
fn state_is_small() {
    let (t7, isu) = (size_of::<Master<T7>>(), size_of::<Master<Isu>>());
    let (line, event) = (size_of::<Line>(), size_of::<Event>());
    println!("master {t7} B (T7), {isu} B (ISU), line {line} B, event {event} B");
    // With a queue of 64 events between the interrupt and the bus level.
    assert!(t7 + line + 64 * event <= 3 * 1_024, "{t7} + {line} + 64 * {event}");
}

//! Queues of line events, from the interrupt of a port to the level that takes them.
//!
//! An event waits in half of its size (`QueuedEvent`), and both ways are in the image once.

use clino_bus::{Event, Instant};
use clino_gateway::QueuedEvent;
use heapless::spsc;

/// A queue of `N` events, one place of which stays empty.
pub type Queue<const N: usize> = spsc::Queue<QueuedEvent, N>;
/// The end of a port.
pub type Producer = spsc::Producer<'static, QueuedEvent>;
/// The end of a level.
pub type Consumer = spsc::Consumer<'static, QueuedEvent>;

/// Puts an event into its queue. Returns whether there was room.
#[inline(never)]
pub fn put(events: &mut Producer, event: Event) -> bool {
    events.enqueue(event.into()).is_ok()
}

/// Takes the next event at `now`.
#[inline(never)]
pub fn take(events: &mut Consumer, now: Instant) -> Option<Event> {
    events.dequeue().map(|event| event.event(now))
}

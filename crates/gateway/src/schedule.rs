//! Which slot of a bus is asked next, and when.
//!
//! Everything that may delay a request, and its file:
//!
//! | what delays a request | how long | file |
//! |---|---|---|
//! | the exchange under way | until its answer, or its deadline | `clino_bus`, `master.rs` |
//! | the gap between two frames of a protocol, a line that is not idle | as the documents say | `clino_bus`, `timing.rs`, `line.rs` |
//! | a late answer that is still awaited | until it cannot come any more | `clino_bus`, `master/engine/late.rs` |
//! | the period of the slot | one period after it was due | `schedule/turn.rs` |
//! | the refresh of an ISU | until it has a new angle | `schedule/refresh.rs` |
//! | a value that has to be confirmed | [`CONFIRM_AFTER`](queue::CONFIRM_AFTER) | `schedule/queue.rs` |
//! | a retry | as the fault and the protocol say | `clino_bus`, `retry.rs`; `bus_task/polling.rs` |
//! | other slots that are due for longer | one exchange each | `schedule/queue.rs` |
//! | a dead node: its pause, and the share of all dead nodes | up to 1.2 s, and the probes of others | `schedule/queue.rs` |
//! | nodes that may be deaf, a change of the bit rate | one silence | `schedule/silence.rs` |
//! | a bus that is out of order: no retries, each slot once in its period | until the first answer | `schedule/outage.rs` |
//! | a commissioning task | every other exchange, or all at a bit rate of its own | `bus_task.rs` |
//! | settings that change | until the exchange under way is over | `bus_task.rs` |
//! | settling: the answer comes, but its value is not used | until the sensor has its new numbers | `schedule/settling.rs` |

pub(crate) mod outage;
pub(crate) mod queue;
pub(crate) mod refresh;
pub(crate) mod settling;
mod silence;
mod turn;

pub use turn::Detail;
pub(crate) use turn::{Polled, Sensor, Turn};

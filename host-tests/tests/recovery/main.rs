//! The shipped image in failures: faults are planted from outside into the running core, crystals stop, the power
//! fails. It recovers without help, and reports afterwards what happened.

mod bring_up;
mod clocks;
mod crashes;
mod kept;
mod power;
mod power_ups;
mod safe_mode;

use clino_board::incident::{Event, ResetCause};
use clino_host_tests::Ran;

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;

/// When the chip was reset, and how.
fn resets(ran: &Ran) -> Vec<(u64, ResetCause)> {
    let resets = ran.incidents.iter().filter_map(|incident| match incident.event {
        Event::Reset(cause) => Some((incident.at, cause)),
        _ => None,
    });
    resets.collect()
}

/// When a fault was planted.
fn planted(ran: &Ran) -> u64 {
    let planted = ran.incidents.iter().find(|incident| matches!(incident.event, Event::Planted { .. }));
    planted.expect("the fault was planted").at
}

/// The answers at the console that begin like this, in order.
fn said<'a>(ran: &'a Ran, what: &str) -> Vec<&'a str> {
    let begin = format!("{{\"what\":\"{what}\",");
    ran.lines.iter().map(|line| line.text.as_str()).filter(|line| line.starts_with(&begin)).collect()
}

/// A line typed at an instant, as a scenario writes it.
fn typed(at_ms: u64, line: &str) -> String {
    format!("[[typed]]\nat = \"{at_ms}ms\"\nline = \"{line}\"\n")
}

//! What the program tells of itself while it runs: lines on standard error, which a journal takes.

use std::fmt::Display;

/// Says something.
pub fn say(what: impl Display) {
    eprintln!("clino: {what}");
}

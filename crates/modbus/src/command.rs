//! What can be commanded through the command block.

pub use clino_gateway::command::{Command, Description, Target};
use clino_gateway::task::Reason;

/// The arm key: without it in the same request, nothing is done that wears a sensor's memory or cannot be undone.
/// "NV" in ASCII.
pub const ARM_KEY: u16 = 0x4E56;

/// What has become of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Outcome {
    /// There was none since reset.
    #[default]
    None = 0,
    /// It is under way.
    Running = 1,
    /// It is done.
    Done = 2,
    /// It failed; [`Progress::reason`] tells why.
    Failed = 3,
    /// It was stopped; for a cancel: what was under way was.
    Cancelled = 4,
}

impl Outcome {
    /// The codes with names and meanings, for the documentation.
    pub const ALL: [(Outcome, &str, &str); 5] = [
        (Outcome::None, "none", "there was no command since reset"),
        (Outcome::Running, "running", "it is under way"),
        (Outcome::Done, "done", "it is done"),
        (Outcome::Failed, "failed", "it failed; *command_reason* tells why"),
        (Outcome::Cancelled, "cancelled", "it was stopped; for *cancel*: what was under way was"),
    ];
}

/// The last command that was accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Which one; `None` if there was none since reset.
    pub command: Option<Command>,
    /// What has become of it.
    pub outcome: Outcome,
    /// Counts the accepted commands; wraps.
    pub sequence: u16,
    /// Steps done,
    pub done: u16,
    /// of so many; zero if that is not known.
    pub of: u16,
    /// Other nodes that it leaves at another bit rate than their bus.
    pub silenced: u16,
    /// Why it failed, if it did.
    pub reason: Option<Reason>,
}

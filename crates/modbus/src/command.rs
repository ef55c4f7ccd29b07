//! Commands of the command block, and their outcome.

pub use clino_gateway::command::{Command, Description, Target};
use clino_gateway::task::Reason;

/// The arm key: without it in the same request, nothing is done that wears a sensor's memory or cannot be undone.
/// "NV" in ASCII.
pub const ARM_KEY: u16 = 0x4E56;

/// Outcome of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Outcome {
    /// No command since reset.
    #[default]
    None = 0,
    /// It is under way.
    Running = 1,
    /// It is done.
    Done = 2,
    /// It failed; [`Progress::reason`] tells why.
    Failed = 3,
    /// It was stopped; of a cancel: the task under way was stopped.
    Cancelled = 4,
}

impl Outcome {
    /// The codes with names and meanings, for the documentation.
    pub const ALL: [(Outcome, &str, &str); 5] = [
        (Outcome::None, "none", "no command since reset"),
        (Outcome::Running, "running", "the command is under way"),
        (Outcome::Done, "done", "the command is done"),
        (Outcome::Failed, "failed", "the command failed; *command_reason* gives the reason"),
        (
            Outcome::Cancelled,
            "cancelled",
            "the command was stopped; of *cancel*: the task under way was stopped",
        ),
    ];
}

/// The last command that was accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Which one; `None` if there was none since reset.
    pub command: Option<Command>,
    /// Its outcome.
    pub outcome: Outcome,
    /// Counts the accepted commands; wraps.
    pub sequence: u16,
    /// Steps done.
    pub done: u16,
    /// Steps in all; zero if the number is not known.
    pub of: u16,
    /// Other nodes that it leaves at another bit rate than their bus.
    pub silenced: u16,
    /// Why it failed, if it did.
    pub reason: Option<Reason>,
}

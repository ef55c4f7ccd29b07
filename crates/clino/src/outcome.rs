//! How a run ends, and the exit status that says so.

use std::io;
use std::process::ExitCode;

/// A frame is bad.
const BAD_FRAME: u8 = 1;
/// The arguments make no sense. Clap uses the same.
const BAD_USAGE: u8 = 2;
/// Input, output or a port failed.
const IO_FAILED: u8 = 3;
/// A person said no, or Ctrl-C stopped it.
const NOT_DONE: u8 = 4;

/// What the frames were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeVerdict {
    /// All of them good.
    Good,
    /// At least one of them bad.
    Bad,
}

impl DecodeVerdict {
    /// The verdict on these and other frames together.
    pub fn and(self, other: Self) -> Self {
        if self == Self::Good { other } else { self }
    }
}

/// Why there is no verdict.
pub enum Failure {
    /// The arguments fit their types, but not each other; the text says which and why.
    Usage(String),
    /// Input or output.
    Io(io::Error),
    /// It was told already; the exit status.
    Reported(u8),
}

impl Failure {
    /// A program did not say that it means what cannot be undone.
    pub const UNCONFIRMED: Self = Self::Reported(BAD_USAGE);
    /// A port cannot be used.
    pub const PORT: Self = Self::Reported(IO_FAILED);
    /// The user did not want it.
    pub const STOPPED: Self = Self::Reported(NOT_DONE);
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Says on standard error what went wrong, if anything did.
pub fn exit_code(outcome: Result<DecodeVerdict, Failure>) -> ExitCode {
    match outcome {
        Ok(DecodeVerdict::Good) => ExitCode::SUCCESS,
        Ok(DecodeVerdict::Bad) => BAD_FRAME.into(),
        Err(Failure::Usage(message)) => {
            eprintln!("error: {message}\n\nFor more information, try '--help'.");
            BAD_USAGE.into()
        }
        Err(Failure::Reported(status)) => status.into(),
        // The reader of the output has closed it, as in `clino … | head`.
        Err(Failure::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(Failure::Io(error)) => {
            eprintln!("error: {error}");
            IO_FAILED.into()
        }
    }
}

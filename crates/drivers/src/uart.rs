//! The UART below a line, whichever traits it implements: one adapter per family of traits.
//!
//! | adapter | UART implements | receiver errors |
//! |---|---|---|
//! | `Io` | `embedded_io` 0.7 `Read + ReadReady + Write`, or `embedded_io_async` 0.7 `Read + Write` | without a name, unless you give a translation |
//! | `Io06` | `embedded_io` 0.6 `Read + ReadReady + Write` | the same |
//! | `Nb` | `embedded_hal_nb::serial` `Read + Write` | by name |
//!
//! A receiver error never disappears and never ends an exchange: it becomes a character with [line
//! errors](clino_codec::character::LineErrors), so that stray characters at turnaround cost nothing and a frame that was hit is
//! refused. The byte itself is lost in most HALs; zero stands in for it.

#[cfg(feature = "embedded-io")]
mod io;
#[cfg(feature = "embedded-io-06")]
mod io06;
#[cfg(feature = "nb")]
mod nb;

use core::fmt::Debug;

use clino_codec::character::Character;
#[cfg(any(feature = "embedded-io", feature = "embedded-io-06", feature = "nb"))]
use clino_codec::character::LineErrors;

#[cfg(feature = "embedded-io")]
pub use io::Io;
#[cfg(feature = "embedded-io-06")]
pub use io06::Io06;
#[cfg(feature = "nb")]
pub use nb::Nb;

/// What a UART's transmitter fails with.
pub trait ErrorType {
    /// The error.
    type Error: Debug;
}

/// A UART that is polled.
pub trait Uart: ErrorType {
    /// Hands characters to the transmitter and says how many it took. May wait until it takes one; zero when it takes
    /// none now.
    ///
    /// # Errors
    /// The UART's own.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error>;

    /// Whether everything is *sent*: the last stop bit is on the line. May wait for that.
    ///
    /// A UART that only knows when its last character was *accepted* may say so here instead, if the line is set accordingly:
    /// [`Release::Held`](crate::rs485::Release::Held).
    ///
    /// # Errors
    /// The UART's own.
    fn flush(&mut self) -> Result<bool, Self::Error>;

    /// The next character received, if there is one. Does not wait.
    fn receive(&mut self) -> Option<Character>;
}

/// A character whose byte was lost to a receiver error.
#[cfg(any(feature = "embedded-io", feature = "embedded-io-06", feature = "nb"))]
fn spoilt(errors: LineErrors) -> Character {
    // An error that says nothing still means that something was wrong.
    let errors = if errors.is_none() { LineErrors::NOISE } else { errors };
    Character { byte: 0, errors }
}

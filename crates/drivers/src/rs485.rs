//! Any UART and a driver-enable pin, with the right turnaround.
//!
//! ```text
//!            ┌──────────────────────────────────────────────────┐
//! DE   ──────┘                                                  └────────
//!             before │ first start bit … last stop bit │ (hold) after
//! TX   ──────────────╲____╱‾‾╲____╱‾‾╲____╱‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//! ```
//!
//! - DE falls when the last stop bit is *sent*, never when the last character was merely accepted by the UART:
//!   the UART's `flush` has to wait for *transmission complete* (TC), not for *transmit register empty* (TXE). Where a
//!   HAL's does not, [`Release::Held`] adds the time of the characters it leaves behind.
//! - DE never stays high: every end of the sending (an error, a UART that is stuck, a future that is
//!   dropped) lowers it. Characters still in the UART then do not reach the line; DE rises again only after they are out.
//! - Nothing received is ever flushed: an answer may begin with the bit after ours.
//! - Own echo, on a transceiver whose receiver is always on, is compared with what was sent and removed
//!   ([`Echo::Expected`]); a difference means that another node transmitted.

#[cfg(feature = "async")]
mod asynch;
mod blocking;
mod driving;
mod echo;
mod error;
mod settings;

use core::convert::Infallible;

use clino_codec::character::Character;
use embedded_hal::digital::{ErrorType, OutputPin};

pub use error::Error;
pub use settings::{Echo, PortSettings, Release};

/// A half-duplex line: a UART behind a line driver.
///
/// | type | is |
/// |---|---|
/// | `U` | a UART in its [adapter](crate::uart) |
/// | `DE` | an output pin, high while we send; [`NoPin`] for RS232 and for transceivers that switch by themselves |
/// | `D` | a delay, of `embedded_hal` (blocking) or of `embedded_hal_async` |
///
/// It is a [`Port`](crate::Port) (with the feature `async`, an `AsyncPort`) for the drivers, and
/// implements `embedded_io::{Read, ReadReady, Write}` (`embedded_io_async::{Read, Write}`) for anything else. There,
/// one call of `write` is one turn on the line: all of it is sent before the call returns, and DE is low again. So
/// hand over a frame in one piece; `flush` has nothing to do.
#[derive(Debug)]
pub struct Rs485<U, DE, D> {
    uart: U,
    de: DE,
    delay: D,
    settings: PortSettings,
    /// A character that was received and not yet taken.
    peeked: Option<Character>,
    /// The UART may still hold characters of a frame whose sending was broken off.
    unfinished: bool,
    /// DE could not be driven low yet.
    refused: bool,
}

impl<U, DE: OutputPin, D> Rs485<U, DE, D> {
    /// A line that listens. A pin that cannot be driven low is reported when the first frame is to be sent.
    pub fn new(uart: U, mut de: DE, delay: D, settings: PortSettings) -> Self {
        let refused = de.set_low().is_err();
        Self { uart, de, delay, settings, peeked: None, unfinished: false, refused }
    }

    /// The settings in force.
    pub const fn settings(&self) -> &PortSettings {
        &self.settings
    }

    /// Other settings from the next call on, say for another bit rate, which is to be set in the UART as well.
    pub fn set_settings(&mut self, settings: PortSettings) {
        self.settings = settings;
    }

    /// The UART in its adapter, whose own `uart` leads to the HAL's UART: to change what only that can, its bit rate, say.
    pub fn uart(&mut self) -> &mut U {
        &mut self.uart
    }

    /// The delay, for waits of your own.
    pub fn delay(&mut self) -> &mut D {
        &mut self.delay
    }

    /// Its parts.
    pub fn release(self) -> (U, DE, D) {
        (self.uart, self.de, self.delay)
    }
}

/// The pin of a line that needs none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoPin;

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

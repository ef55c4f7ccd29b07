//! A half-duplex line, as a driver needs it.
//!
//! [`Rs485`](crate::Rs485) offers both; anything else that can send a frame and listen with a deadline may, too: a
//! serial port of an operating system, a radio.

use core::ops::ControlFlow;

use clino_bus::Duration;
use clino_codec::character::Character;

/// A half-duplex line, blocking.
pub trait Port {
    /// Why a frame did not get out whole.
    type Error;

    /// Sends a frame, whole. Returns when its last stop bit is on the line and the driver is off: an answer may begin
    /// at that instant, and must not be lost.
    ///
    /// # Errors
    /// The frame was not sent whole, or that is unknown. The driver is off in any case.
    fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error>;

    /// Listens for `span`: hands over every character, and how long after the call it came, until the span is over
    /// ([`Continue`](ControlFlow::Continue)) or `take` has enough ([`Break`](ControlFlow::Break)).
    ///
    /// Characters received since the last call come first, even if the span is zero. The span may be longer than asked
    /// for, never shorter; times may be understated, never overstated.
    fn listen(
        &mut self,
        span: Duration,
        take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()>;
}

/// A half-duplex line, async. The contract is that of [`Port`], but for the times of characters: nothing tells the
/// time when one comes, so that they are given the end of the span.
///
/// Dropping a future of either method switches the driver off; see [`Rs485`](crate::Rs485).
#[cfg(feature = "async")]
pub trait AsyncPort {
    /// Why a frame did not get out whole.
    type Error;

    /// As [`Port::send`].
    ///
    /// # Errors
    /// As [`Port::send`].
    fn send(&mut self, frame: &[u8]) -> impl Future<Output = Result<(), Self::Error>>;

    /// As [`Port::listen`].
    fn listen(
        &mut self,
        span: Duration,
        take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> impl Future<Output = ControlFlow<()>>;
}

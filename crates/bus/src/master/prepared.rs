//! A request that can be sent.

use crate::{ExpectedReply, Protocol};

/// A request as a frame, and what its answer has to be: made once, sent as often as it takes.
pub struct Prepared<P: Protocol> {
    frame: P::Frame,
    pub(super) expected: P::Expected,
    writes: bool,
}

impl<P: Protocol> Prepared<P> {
    /// This request to this node.
    ///
    /// # Errors
    /// The request cannot be put into a frame.
    #[inline]
    pub fn new(address: P::Address, request: &P::Request) -> Result<Self, P::EncodeError> {
        let frame = P::encode(address, request)?;
        Ok(Prepared { frame, expected: P::expected(address, request), writes: P::writes(request) })
    }

    /// The frame to send.
    pub fn frame(&self) -> &[u8] {
        self.frame.as_ref()
    }

    /// What its answer has to be, as far as that tells one answer from another.
    pub fn reply(&self) -> ExpectedReply {
        P::reply(&self.expected)
    }

    /// Whether it changes the sensor's non-volatile memory.
    pub fn writes(&self) -> bool {
        self.writes
    }
}

//! A complete message, ready for the line. Source: AN #201 table 1.

use crate::bytes::{Buffer, sum};

/// Bytes that the length byte does not count: itself and the checksum.
pub(super) const OVERHEAD: usize = 2;
/// Longest message that a length byte can describe.
pub(super) const LONGEST: usize = u8::MAX as usize + OVERHEAD;

/// One encoded message.
#[derive(Clone, Copy)]
pub struct Frame(Buffer<LONGEST>);

impl Frame {
    /// Starts a message: length, then address, function and direction in one byte.
    pub(super) fn start(length: u8, head: u8) -> Self {
        let mut buffer = Buffer::new();
        buffer.extend(&[length, head]);
        Self(buffer)
    }

    // Not inlined: messages are put together from many small fields.
    #[inline(never)]
    pub(super) fn extend(&mut self, field: &[u8]) {
        self.0.extend(field);
    }

    /// Ends the message with the plain sum of all bytes but the length.
    pub(super) fn seal(mut self) -> Self {
        let checksum = sum(self.as_bytes().get(1..).unwrap_or(&[]));
        self.0.push(checksum);
        self
    }

    /// The message as it goes over the line.
    pub fn as_bytes(&self) -> &[u8] {
        self.0.as_slice()
    }
}

impl AsRef<[u8]> for Frame {
    fn as_ref(&self) -> &[u8] {
        self.as_bytes()
    }
}

impl PartialEq for Frame {
    fn eq(&self, other: &Self) -> bool {
        self.as_bytes() == other.as_bytes()
    }
}

impl Eq for Frame {}

impl core::fmt::Debug for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Frame({:02X?})", self.as_bytes())
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Frame {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Frame({=[u8]:02X})", self.as_bytes());
    }
}

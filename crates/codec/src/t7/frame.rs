//! A complete message, ready for the line.

use super::Address;
use crate::bytes::{Buffer, sum};

/// Bytes before what the length byte counts: address and the length byte itself.
pub(super) const OVERHEAD: usize = 2;
/// Longest message: the answer to Get All Data. Source: T7 guide §2.3.
pub(super) const LONGEST: usize = OVERHEAD + 0x20;

/// One encoded message.
#[derive(Clone, Copy)]
pub struct Frame(Buffer<LONGEST>);

impl Frame {
    /// Starts a message: address, length, command.
    pub(super) fn start(address: Address, length: u8, command: u8) -> Self {
        let mut buffer = Buffer::new();
        buffer.extend(&[address.get(), length, command]);
        Self(buffer)
    }

    // Not inlined: messages are put together from many small fields.
    #[inline(never)]
    pub(super) fn extend(&mut self, field: &[u8]) {
        self.0.extend(field);
    }

    /// Ends the message: all bytes together now sum to zero. Source: §1.
    pub(super) fn seal(mut self) -> Self {
        let checksum = sum(self.as_bytes()).wrapping_neg();
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

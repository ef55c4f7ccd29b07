//! A complete message, ready for the line. Source: AN #201 table 1.

use super::data::MAX_DATA;
use crate::bytes::{Buffer, sum};

/// Bytes that the length byte does not count: itself and the checksum.
pub(super) const OVERHEAD: usize = 2;
/// Longest message: [`MAX_DATA`], head and address, and what the length byte does not count.
pub(super) const LONGEST: usize = MAX_DATA + 2 + OVERHEAD;

/// One encoded message.
#[derive(Clone, Copy)]
pub struct Frame(Buffer<LONGEST>);

impl Frame {
    /// A whole message; `head` is address, function and direction, the rest its payload in two parts.
    #[inline(never)]
    pub(super) fn new(head: u8, first: &[u8], data: &[u8]) -> Self {
        // At most head, address and `MAX_DATA` bytes: fits.
        let length = first.len().wrapping_add(data.len()).wrapping_add(1) as u8;
        let mut buffer = Buffer::new();
        buffer.push(length);
        buffer.push(head);
        buffer.extend(first);
        buffer.extend(data);
        // The plain sum of all bytes but the length.
        buffer.push(sum(buffer.as_slice()).wrapping_sub(length));
        Self(buffer)
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

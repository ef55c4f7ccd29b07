//! A complete message, ready for the line, and the sizes of its parts.

use super::Address;
use crate::bytes::{Writer, put, sum};

/// Bytes before what the length byte counts: address and the length byte itself.
pub(super) const OVERHEAD: usize = 2;
/// Longest message: the answer to Get All Data. Source: T7 guide §2.3.
pub(super) const LONGEST: usize = OVERHEAD + 0x20;
/// Bytes before the body: address, length, command. They tell what follows.
pub(super) const HEADER: usize = 3;
/// Longest body, the checksum behind it included.
pub(super) const BODY: usize = LONGEST - HEADER;

/// One encoded message.
#[derive(Clone, Copy)]
pub struct Frame {
    bytes: [u8; LONGEST],
    length: u8,
}

impl Frame {
    /// A message with an empty body.
    #[inline(always)]
    pub(super) fn new(address: Address, length: u8, command: u8) -> Self {
        let mut bytes = [0; LONGEST];
        Writer::new(&mut bytes).put([address.get(), length, command]);
        Self { bytes, length: length.wrapping_add(OVERHEAD as u8) }
    }

    /// Where parameters, data or status go.
    #[inline(always)]
    pub(super) fn body(&mut self) -> &mut [u8; BODY] {
        let [_, _, _, body @ ..] = &mut self.bytes;
        body
    }

    /// Another length byte in a sealed message, which stays sealed and as long as it is.
    pub(super) fn set_length_byte(&mut self, length: u8) {
        put(&mut self.bytes, 1, length);
        put(&mut self.bytes, usize::from(self.length).wrapping_sub(1), 0);
        self.seal();
    }

    /// Ends the message: all bytes together now sum to zero. Source: §1.
    #[inline(never)]
    pub(super) fn seal(&mut self) {
        let checksum = sum(&self.bytes).wrapping_neg();
        put(&mut self.bytes, usize::from(self.length).wrapping_sub(1), checksum);
    }

    /// The message as it goes over the line.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
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

//! A complete message, ready for the line, and the sizes of its parts.

use super::Address;
use crate::bytes::{Writer, put, sum};

/// Bytes before what the length byte counts: address and the length byte itself.
pub(super) const OVERHEAD: usize = 2;
/// Longest message: the answer to Get All Data. Source: T7 guide §2.3.
pub(super) const LONGEST: usize = OVERHEAD + 0x20;
/// Longest command: Set Address. Source: T7 guide §2.8.
const LONGEST_COMMAND: usize = OVERHEAD + 0x08;
/// Bytes before the body: address, length, command. They tell what follows.
pub(super) const HEADER: usize = 3;

/// One encoded message of at most `N` bytes.
#[derive(Clone, Copy)]
pub struct Frame<const N: usize> {
    bytes: [u8; N],
    length: u8,
}

/// One encoded command. Small, for every request on a line is one.
pub type CommandFrame = Frame<LONGEST_COMMAND>;
/// One encoded answer.
pub type AnswerFrame = Frame<LONGEST>;

impl<const N: usize> Frame<N> {
    /// A message with an empty body.
    #[inline(always)]
    pub(super) fn new(address: Address, length: u8, command: u8) -> Self {
        let mut bytes = [0; N];
        Writer::new(&mut bytes).put([address.get(), length, command]);
        Self { bytes, length: length.wrapping_add(OVERHEAD as u8) }
    }

    /// Where parameters, data or status go.
    #[inline(always)]
    pub(super) fn body(&mut self) -> &mut [u8] {
        self.bytes.get_mut(HEADER..).unwrap_or(&mut [])
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

impl<const N: usize> AsRef<[u8]> for Frame<N> {
    fn as_ref(&self) -> &[u8] {
        self.as_bytes()
    }
}

impl<const N: usize> PartialEq for Frame<N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_bytes() == other.as_bytes()
    }
}

impl<const N: usize> Eq for Frame<N> {}

impl<const N: usize> core::fmt::Debug for Frame<N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Frame({:02X?})", self.as_bytes())
    }
}

#[cfg(feature = "defmt")]
impl<const N: usize> defmt::Format for Frame<N> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Frame({=[u8]:02X})", self.as_bytes());
    }
}

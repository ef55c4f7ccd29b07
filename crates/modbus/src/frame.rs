//! The one buffer of the server: a request comes into it, and its answer takes the request's place.

use heapless::Vec;

use crate::crc;

/// Longest frame (MODBUS over Serial Line V1.02, section 2.5.1).
pub const MAX_FRAME: usize = 256;

/// Bytes of a frame.
#[derive(Debug)]
pub struct Frame(Vec<u8, MAX_FRAME>);

impl Frame {
    pub const fn new() -> Frame {
        Frame(Vec::new())
    }

    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    pub fn truncate(&mut self, length: usize) {
        self.0.truncate(length);
    }

    /// Puts a byte at the end; says whether it fits.
    pub fn byte(&mut self, byte: u8) -> bool {
        self.0.push(byte).is_ok()
    }

    /// Puts these bytes at the end. What does not fit is left out; the functions answer within the limit.
    pub fn extend(&mut self, bytes: &[u8]) {
        _ = self.0.extend_from_slice(bytes);
    }

    /// Puts a register at the end, high byte first.
    pub fn word(&mut self, word: u16) {
        let [high, low] = word.to_be_bytes();
        _ = self.byte(high) && self.byte(low);
    }

    /// Changes a byte that is there.
    pub fn set(&mut self, index: usize, byte: u8) {
        if let Some(place) = self.0.get_mut(index) {
            *place = byte;
        }
    }

    /// Puts the checksum at the end, low byte first.
    pub fn seal(&mut self) {
        let crc = crc::over(&self.0);
        self.extend(&crc.to_le_bytes());
    }
}

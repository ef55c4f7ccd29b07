//! CRC-32/ISO-HDLC: polynomial 0x04C11DB7 (IEEE 802.3), reflected, begins with ones, ends inverted.
//!
//! Not the polynomial that `sequential-storage` guards its items with (Castagnoli): what one of them cannot see, the
//! other can. It finds every error of up to three bits in a record, and every burst of up to 32.

/// The polynomial, reflected: the lowest bit of a byte goes first.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// A checksum in the making.
#[derive(Clone, Copy, Debug)]
pub struct Crc(u32);

impl Crc {
    /// Of nothing yet.
    pub const fn new() -> Crc {
        Crc(!0)
    }

    /// Takes a byte. Bit by bit: a record is checked once a boot, a table would be larger than it.
    pub fn byte(&mut self, byte: u8) {
        self.0 ^= u32::from(byte);
        for _ in 0..u8::BITS {
            let carry = self.0 & 1 != 0;
            self.0 >>= 1;
            if carry {
                self.0 ^= POLYNOMIAL;
            }
        }
    }

    /// Of all that was taken.
    pub const fn value(self) -> u32 {
        !self.0
    }

    /// Of these bytes.
    pub fn of(bytes: &[u8]) -> u32 {
        let mut crc = Crc::new();
        bytes.iter().for_each(|byte| crc.byte(*byte));
        crc.value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value that the catalogue of CRC algorithms gives for this one.
    #[test]
    fn check_value() {
        assert_eq!(Crc::of(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn of_nothing() {
        assert_eq!(Crc::of(b""), 0);
    }
}

//! Bit rate of a line, and how long its characters take.

use crate::Micros;

/// Start bit, eight data bits, stop bit (T7 guide section 1, AN #201 section 4).
const BITS_PER_CHARACTER: u64 = 10;
const MICROS_PER_SECOND: u64 = 1_000_000;

/// Bit rate and framing of a line. Both vendors use 8N1: ten bits a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Serial {
    /// Bit rate in bit/s.
    pub baud: u32,
}

impl Serial {
    /// US Digital T7, factory setting (T7 guide section 1).
    pub const T7_DEFAULT: Serial = Serial { baud: 115_200 };
    /// STT ISU, the only rate it has (AN #201 section 4).
    pub const ISU: Serial = Serial { baud: 9_600 };

    /// Time of `bits` bits, rounded up to a microsecond.
    pub const fn bits(self, bits: u64) -> Micros {
        let baud = if self.baud == 0 { 1 } else { self.baud as u64 };
        Micros(bits.saturating_mul(MICROS_PER_SECOND).div_ceil(baud))
    }

    /// Half a bit, rounded up: from the centre of a stop bit to its end.
    pub const fn half_bit(self) -> Micros {
        Micros(self.bits(1).0.div_ceil(2))
    }

    /// Time of `n` characters sent back to back, rounded up to a microsecond.
    pub const fn characters(self, n: u64) -> Micros {
        self.bits(n.saturating_mul(BITS_PER_CHARACTER))
    }
}

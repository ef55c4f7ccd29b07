//! Bit rate of a line, and how long its characters take.

use crate::Duration;

/// Start bit, eight data bits, stop bit (T7 guide section 1, AN #201 section 4).
const BITS_PER_CHARACTER: u32 = 10;
const MICROS_PER_SECOND: u32 = 1_000_000;

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

    /// Time of `bits` bits, rounded up to a microsecond; at most [`Duration::MAX`].
    pub const fn bits(self, bits: u32) -> Duration {
        let baud = if self.baud == 0 { 1 } else { self.baud };
        // Whole microseconds and the rest apart: 32 bits suffice, which a Cortex-M4 divides in one instruction.
        let whole = MICROS_PER_SECOND.checked_div(baud);
        let (Some(whole), Some(rest)) = (whole, MICROS_PER_SECOND.checked_rem(baud)) else {
            return Duration::MAX;
        };
        match rest.checked_mul(bits) {
            Some(rest) => {
                Duration::from_micros(whole.saturating_mul(bits).saturating_add(rest.div_ceil(baud)))
            }
            None => longer(bits, baud),
        }
    }

    /// Half a bit, rounded up: from the centre of a stop bit to its end.
    pub const fn half_bit(self) -> Duration {
        Duration::from_micros(self.bits(1).as_micros().div_ceil(2))
    }

    /// Time of `n` characters sent back to back, rounded up to a microsecond.
    pub const fn characters(self, n: u32) -> Duration {
        self.bits(n.saturating_mul(BITS_PER_CHARACTER))
    }
}

/// The same for more than 4294 bits, which no frame has.
#[cold]
const fn longer(bits: u32, baud: u32) -> Duration {
    let us = (bits as u64).saturating_mul(MICROS_PER_SECOND as u64).div_ceil(baud as u64);
    Duration::from_micros(if us > u32::MAX as u64 { u32::MAX } else { us as u32 })
}

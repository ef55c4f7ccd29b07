//! How long things take on the Modbus port, and the two silences that frames are told apart by.
//!
//! Source: MODBUS over Serial Line V1.02, section 2.5.1 (characters of eleven bits; even parity and 19200 bit/s are the
//! default, no parity asks for a second stop bit) and section 2.5.1.1 (t1.5 and t3.5 in characters up to 19200 bit/s;
//! above, fixed: 750 µs and 1.750 ms).

use clino_bus::Duration;

use super::{Parity, PortSettings};

/// Above this bit rate the two silences do not shrink any further, bit/s.
const FIXED_ABOVE: u32 = 19_200;
/// t1.5 above that.
const FIXED_T1_5: Duration = Duration::from_micros(750);
/// t3.5 above that.
const FIXED_T3_5: Duration = Duration::from_micros(1_750);

const MICROS_PER_SECOND: u32 = 1_000_000;

impl PortSettings {
    /// Bits of a character on the line: start bit, eight data bits, parity, stop bits.
    pub const fn bits_per_character(&self) -> u32 {
        let parity = match self.parity {
            Parity::None => 0_u32,
            Parity::Even | Parity::Odd => 1,
        };
        parity.saturating_add(9).saturating_add(self.stop_bits as u32)
    }

    /// Time of at most 4294 bits, a third more than the longest frame has, rounded up to a microsecond.
    #[inline(never)]
    pub const fn bits(&self, bits: u32) -> Duration {
        let baud = if self.baud == 0 { 1 } else { self.baud };
        Duration::from_micros(bits.wrapping_mul(MICROS_PER_SECOND).div_ceil(baud))
    }

    /// Time of at most 357 characters sent back to back, rounded up to a microsecond.
    pub const fn characters(&self, n: u32) -> Duration {
        self.bits(n.wrapping_mul(self.bits_per_character()))
    }

    /// The longest silence within a frame, by [`Pauses::Strict`](super::Pauses::Strict).
    pub const fn t1_5(&self) -> Duration {
        if self.baud > FIXED_ABOVE {
            return FIXED_T1_5;
        }
        Duration::from_micros(self.characters(3).as_micros().div_ceil(2))
    }

    /// The silence that ends a frame.
    pub const fn t3_5(&self) -> Duration {
        if self.baud > FIXED_ABOVE {
            return FIXED_T3_5;
        }
        Duration::from_micros(self.characters(7).as_micros().div_ceil(2))
    }
}

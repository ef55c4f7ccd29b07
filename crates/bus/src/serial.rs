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

    /// Time of `bits` bits, rounded up to a microsecond; at most [`Duration::MAX`]. Of more bits than 4294, which no frame has,
    /// each is rounded up to a microsecond.
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
            None => longer(bits, whole),
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

/// The time of more bits than any frame has, each of them rounded up. A function of its own, so that the usual case is worked
/// out by the compiler where the bit rate is known, and in one place where it is not.
#[cold]
#[inline(never)]
const fn longer(bits: u32, whole: u32) -> Duration {
    Duration::from_micros(whole.saturating_add(1).saturating_mul(bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a division of 64 bits, at rates up to 1 Gbit/s and lengths on both sides of what 32 bits hold: exact as far as
    /// 4294 bits; above that never shorter, and at most a microsecond longer for each bit.
    #[test]
    fn long_times_are_divided_right() {
        for baud in [1, 50, 300, 9_600, 115_200, 999_983, 3_000_000, 1 << 30] {
            for bits in [0, 1, 10, 4_294, 4_295, 100_000, 1_000_000, 1 << 24, u32::MAX] {
                let exact = (u64::from(bits) * 1_000_000).div_ceil(u64::from(baud));
                let us = u64::from(Serial { baud }.bits(bits).as_micros());
                let longest = if bits <= 4_294 { exact } else { exact + u64::from(bits) };
                let in_a_duration = |us: u64| us.min(u32::MAX.into());
                assert!(
                    us >= in_a_duration(exact),
                    "{us} us for {bits} bits at {baud} are less than {exact}"
                );
                assert!(
                    us <= in_a_duration(longest),
                    "{us} us for {bits} bits at {baud} are more than {longest}"
                );
            }
        }
    }
}

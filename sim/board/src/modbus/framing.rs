//! Characters of a Modbus line: "MODBUS over Serial Line", V1.02, sections 2.5.1 and 2.5.1.1.

use std::fmt;

use clino_segment::log::PS_PER_S;
use clino_segment::wire::Format;
use clino_sim::node::Ns;

const PS_PER_NS: u64 = 1_000;
const DATA_BITS: u8 = 8;
/// A frame ends with a silence of three and a half characters, …
const SILENCE_HALF_CHARACTERS: u64 = 7;
/// … above this bit rate with a fixed one.
const FIXED_SILENCE_ABOVE: u32 = 19_200;
const FIXED_SILENCE: Ns = 1_750_000;

/// What stands between the eighth data bit and the stop bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parity {
    /// Nothing.
    None,
    /// A bit that makes the number of ones even.
    #[default]
    Even,
    /// A bit that makes the number of ones odd.
    Odd,
}

/// Bit rate and framing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Framing {
    /// In bit/s, not 0.
    pub baud: u32,
    /// Parity bit.
    pub parity: Parity,
    /// 1 or 2.
    pub stop_bits: u8,
}

impl Default for Framing {
    /// 19200 8E1, the standard's default.
    fn default() -> Self {
        Self { baud: 19_200, parity: Parity::Even, stop_bits: 1 }
    }
}

impl Framing {
    /// In the terms of the wire.
    pub fn format(self) -> Format {
        let data_bits = DATA_BITS + u8::from(self.parity != Parity::None);
        Format { bit_ps: PS_PER_S / u64::from(self.baud.max(1)), data_bits, stop_halves: 2 * self.stop_bits }
    }

    /// Length of a character.
    pub fn character(self) -> Ns {
        (self.bit_ps() * u64::from(self.bits())).div_ceil(PS_PER_NS)
    }

    /// The silence that ends a frame, t3.5.
    pub fn silence(self) -> Ns {
        if self.baud > FIXED_SILENCE_ABOVE {
            return FIXED_SILENCE;
        }
        (self.bit_ps() * u64::from(self.bits()) * SILENCE_HALF_CHARACTERS).div_ceil(2 * PS_PER_NS)
    }

    /// A byte with its parity bit.
    pub(super) fn put_together(self, byte: u8) -> u16 {
        let odd_ones = byte.count_ones() % 2 == 1;
        let parity = match self.parity {
            Parity::None => false,
            Parity::Even => odd_ones,
            Parity::Odd => !odd_ones,
        };
        u16::from(byte) | u16::from(parity) << DATA_BITS
    }

    /// The byte in a character, and whether its parity bit is right.
    pub(super) fn take_apart(self, word: u16) -> (u8, bool) {
        let byte = word as u8;
        (byte, self.put_together(byte) == word)
    }

    /// First start bit and end of the last stop bit of a character whose first stop bit has its centre at `centre`.
    pub(super) fn around(self, centre: Ns) -> (Ns, Ns) {
        let Format { bit_ps, data_bits, stop_halves } = self.format();
        let half_bits = |count: u64| (count * bit_ps / 2).div_ceil(PS_PER_NS);
        let before = half_bits(3 + 2 * u64::from(data_bits));
        (centre.saturating_sub(before), centre + half_bits(u64::from(stop_halves) - 1))
    }

    /// Start bit, data bits, parity bit, stop bits.
    fn bits(self) -> u8 {
        1 + DATA_BITS + u8::from(self.parity != Parity::None) + self.stop_bits
    }

    fn bit_ps(self) -> u64 {
        self.format().bit_ps
    }
}

impl fmt::Display for Framing {
    /// As people write it: `19200 8E1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parity = match self.parity {
            Parity::None => 'N',
            Parity::Even => 'E',
            Parity::Odd => 'O',
        };
        write!(f, "{} {DATA_BITS}{parity}{}", self.baud, self.stop_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_and_silences_are_the_standards() {
        // 11 bits at 19200 bit/s are 572.92 µs, three and a half of them 2.005 ms.
        let default = Framing::default();
        assert_eq!((default.to_string().as_str(), default.character()), ("19200 8E1", 572_917));
        assert_eq!(default.silence(), 2_005_209);
        let fast = Framing { baud: 115_200, parity: Parity::None, stop_bits: 1 };
        assert_eq!((fast.to_string().as_str(), fast.silence()), ("115200 8N1", 1_750_000));
        let slow = Framing { baud: 9_600, parity: Parity::None, stop_bits: 2 };
        assert_eq!((slow.to_string().as_str(), slow.character()), ("9600 8N2", 1_145_834));
    }

    #[test]
    fn a_parity_bit_is_made_and_checked() {
        let framing = |parity| Framing { parity, ..Framing::default() };
        for (parity, byte, word) in [
            (Parity::Even, 0x07, 0x107),
            (Parity::Even, 0x03, 0x003),
            (Parity::Odd, 0x07, 0x007),
            (Parity::Odd, 0x00, 0x100),
            (Parity::None, 0x07, 0x007),
        ] {
            assert_eq!(framing(parity).put_together(byte), word);
            assert_eq!(framing(parity).take_apart(word), (byte, true));
            assert_eq!(framing(parity).take_apart(word ^ 0x100), (byte, false));
        }
    }

    #[test]
    fn the_ends_of_a_character_are_found_from_the_centre_of_its_stop_bit() {
        // 8N2 at 10 kbit/s: start bit at 1 ms, eight data bits, first stop bit from 1.9 to 2.0 ms, second to 2.1 ms.
        let framing = Framing { baud: 10_000, parity: Parity::None, stop_bits: 2 };
        assert_eq!(framing.around(1_950_000), (1_000_000, 2_100_000));
    }
}

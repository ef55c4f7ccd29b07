//! How the port runs, and the two silences that frames are told apart by.
//!
//! Source: MODBUS over Serial Line V1.02, section 2.5.1 (characters of eleven bits; even parity and 19200 bit/s are the
//! default, no parity asks for a second stop bit) and section 2.5.1.1 (t1.5 and t3.5 in characters up to 19200 bit/s;
//! above, fixed: 750 µs and 1.750 ms).

use clino_bus::Micros;
use clino_bus::line::EchoMode;

/// Above this bit rate the two silences do not shrink any further, bit/s.
const FIXED_ABOVE: u32 = 19_200;
/// t1.5 above that.
const FIXED_T1_5: Micros = Micros(750);
/// t3.5 above that.
const FIXED_T3_5: Micros = Micros(1_750);

const MICROS_PER_SECOND: u32 = 1_000_000;

/// How the port runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// The address this server answers to, 1 to 247.
    pub address: u8,
    /// Bit rate, one of [`BIT_RATES`].
    pub baud: u32,
    /// Parity.
    pub parity: Parity,
    /// Stop bits.
    pub stop_bits: StopBits,
    /// Whether the port hears what it sends.
    pub echo: EchoMode,
    /// Which pauses a frame may have.
    pub pauses: Pauses,
    /// The port is read-only: requests that change anything are refused. Only another door can unlock it.
    pub locked: bool,
}

/// Bit rates of the port, bit/s.
pub const BIT_RATES: [u32; 7] = [2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];

/// Lowest and highest address of a server (section 2.2).
pub const ADDRESSES: (u8, u8) = (1, 247);

/// The parity bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Parity {
    /// There is none.
    None = 0,
    /// It makes the number of ones even.
    Even = 1,
    /// It makes the number of ones odd.
    Odd = 2,
}

/// How many stop bits there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopBits {
    /// One.
    One = 1,
    /// Two.
    Two = 2,
}

/// Which pauses a frame may have. Below t3.5, both say that it goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pauses {
    /// All of them: a USB adapter hands its characters over in packets, 1 ms apart and more.
    #[default]
    Tolerant = 0,
    /// At most t1.5, as the specification has it: a frame with a longer pause is dropped.
    Strict = 1,
}

impl Settings {
    /// Address 1, 19200 bit/s, 8E1; no echo, tolerant of pauses, not locked.
    pub const DEFAULT: Settings = Settings {
        address: 1,
        baud: 19_200,
        parity: Parity::Even,
        stop_bits: StopBits::One,
        echo: EchoMode::Off,
        pauses: Pauses::Tolerant,
        locked: false,
    };

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
    pub const fn bits(&self, bits: u32) -> Micros {
        let baud = if self.baud == 0 { 1 } else { self.baud };
        Micros(bits.wrapping_mul(MICROS_PER_SECOND).div_ceil(baud) as u64)
    }

    /// Time of at most 357 characters sent back to back, rounded up to a microsecond.
    pub const fn characters(&self, n: u32) -> Micros {
        self.bits(n.wrapping_mul(self.bits_per_character()))
    }

    /// The longest silence within a frame, by [`Pauses::Strict`].
    pub const fn t1_5(&self) -> Micros {
        if self.baud > FIXED_ABOVE {
            return FIXED_T1_5;
        }
        Micros(self.characters(3).0.div_ceil(2))
    }

    /// The silence that ends a frame.
    pub const fn t3_5(&self) -> Micros {
        if self.baud > FIXED_ABOVE {
            return FIXED_T3_5;
        }
        Micros(self.characters(7).0.div_ceil(2))
    }

    /// Whether the port can run like this.
    pub fn is_valid(&self) -> bool {
        (ADDRESSES.0..=ADDRESSES.1).contains(&self.address) && BIT_RATES.contains(&self.baud)
    }
}

//! The chip's oscillators: their errors, and the faults of the crystal.

use clino_sim::node::Ns;

/// Frequency of the low-speed internal oscillator, Hz: the watchdog's. Typical, and its range (DS8626 table 40).
pub const LSI_HZ: u32 = 32_000;
/// Its range over parts and temperature.
pub const LSI_RANGE: std::ops::RangeInclusive<u32> = 17_000..=47_000;
/// Frequency of the high-speed internal oscillator, Hz, as it should be.
pub const HSI_HZ: u32 = 16_000_000;

/// The chip's oscillators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Oscillators {
    /// Low-speed internal oscillator, Hz.
    pub lsi_hz: u32,
    /// High-speed internal oscillator, Hz.
    pub hsi_hz: u32,
    /// What the crystal does.
    pub crystal: CrystalLife,
}

/// When the crystal swings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CrystalLife {
    /// When it stops; 0 if it never starts.
    pub stops_at: Option<Ns>,
    /// When it can swing again.
    pub returns_at: Option<Ns>,
}

impl Default for Oscillators {
    /// All as they should be.
    fn default() -> Oscillators {
        Oscillators { lsi_hz: LSI_HZ, hsi_hz: HSI_HZ, crystal: CrystalLife::default() }
    }
}

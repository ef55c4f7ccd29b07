//! What can be set through the map, in the map's own units.

use clino_bus::line::EchoMode;

use crate::host::Kind;

/// How a slot is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SlotConfig {
    /// It is read.
    pub enabled: bool,
    /// What it reads.
    pub kind: Kind,
    /// Address on the bus, or number of the PWM input (1 or 2).
    pub address: u8,
    /// Axis of a T7.
    pub axis: u8,
    /// From one reading to the next, ms; zero is as often as the bus can.
    pub period_ms: u32,
    /// A value older than this is stale, ms.
    pub stale_ms: u32,
    /// Longest wait for an answer, ms; zero is what the sensor's document says.
    pub timeout_ms: u16,
    /// Further tries within one reading.
    pub retries: u8,
    /// This much is subtracted from what the sensor says, mdeg.
    pub zero_mdeg: i32,
    /// The angle counts the other way.
    pub reversed: bool,
    /// The angle is told as 0° to 360° instead of −180° to 180°.
    pub unidirectional: bool,
    /// What smooths the angle.
    pub filter: Filter,
    /// Over so many readings.
    pub filter_length: u8,
    /// First values, values after an error and jumps are confirmed by a second reading.
    pub confirm: bool,
    /// What counts as a jump, mdeg/s; zero: nothing does.
    pub jump_mdeg_s: u32,
}

impl BusConfig {
    /// Of a bus that is not there yet.
    pub const NONE: BusConfig =
        BusConfig { baud: 0, guard_us: 0, pre_delay_us: 0, post_delay_us: 0, echo: EchoMode::Off };
}

/// What smooths an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Filter {
    /// Nothing.
    #[default]
    None = 0,
    /// The circular mean.
    Mean = 1,
    /// The circular median.
    Median = 2,
}

/// How a bus is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusConfig {
    /// Bit rate, bit/s.
    pub baud: u32,
    /// Silence before our driver is switched on, µs.
    pub guard_us: u16,
    /// From there to the first start bit, µs.
    pub pre_delay_us: u16,
    /// From the last stop bit until the driver is switched off, µs.
    pub post_delay_us: u16,
    /// Whether our own characters come back.
    pub echo: EchoMode,
}

/// The code of an echo mode.
pub(crate) const fn echo_code(echo: EchoMode) -> u32 {
    match echo {
        EchoMode::Off => 0,
        EchoMode::Expected => 1,
        EchoMode::Detect => 2,
    }
}

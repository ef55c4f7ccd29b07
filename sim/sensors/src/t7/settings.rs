//! The factory data of a T7, and the settings in its non-volatile memory.
//!
//! Source: "T7 Communication User Guide" 1.7, sections 1 to 1.3 and the tables of section 2.

/// Axes of a T7; the single-axis model has them all in its messages.
pub const AXES: usize = 3;

/// The axis of a single-axis T7 (section 1).
pub const SINGLE_AXIS: usize = 2;

/// The factory default address (section 1.1).
pub const DEFAULT_ADDRESS: u8 = 127;

/// Addresses that Set Address may give (section 2.8).
pub const SETTABLE_ADDRESSES: core::ops::RangeInclusive<u8> = 1..=100;

/// Damping times in ms (section 2.5).
pub const DAMPING_MS: core::ops::RangeInclusive<u16> = 2..=5000;

/// Bit rates in bit/s by baud rate index (section 2.7.2).
pub const BAUD_RATES: [u32; 5] = [115_200, 57_600, 38_400, 19_200, 9_600];

/// The two models; the discriminant is the device type of Set Address (section 2.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Model {
    /// Three axes.
    T73 = 1,
    /// One axis, numbered 2.
    T71 = 4,
}

/// What the factory burnt in (section 2.7.1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Single or three axis.
    pub model: Model,
    /// Serial number.
    pub serial: u32,
    /// Firmware version, ASCII padded with spaces.
    pub firmware: [u8; 6],
    /// Product type, ASCII padded with spaces.
    pub product: [u8; 6],
    /// Calibration state, reserved.
    pub calibration: u16,
}

impl Default for Identity {
    /// The device of the document's example, with the product type that the example's text gives.
    fn default() -> Self {
        Self {
            model: Model::T71,
            serial: 25_033,
            firmware: *b"0.32  ",
            product: *b"T7-1  ",
            calibration: 0x002C,
        }
    }
}

/// Range of reported angles (section 2.6); the discriminant is the value on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum OutputRange {
    /// −180.000° … 179.999°.
    #[default]
    Bidirectional = 0,
    /// 0.000° … 359.999°.
    Unidirectional = 1,
}

/// Sense of rotation of an axis (section 2.4); the discriminant is the value on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Direction {
    /// As the sensor measures it.
    #[default]
    Normal = 0,
    /// Negated.
    Reversed = 1,
}

/// Whether the non-volatile memory takes what is stored. The discriminant of a failure is the status of a Set
/// command that stores nothing because of it (section 1.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Flash {
    /// It does.
    #[default]
    Sound = 0,
    /// "Command failed", without a reason.
    Fails = 5,
    /// "Flash erase error".
    EraseFails = 7,
    /// "Flash program error".
    ProgramFails = 8,
}

/// The settings that survive a power cut. A command writes one of them, and either it has been written or it
/// has not: half-written flash is not modelled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredSettings {
    /// Own address: 1 to 100, or 127.
    pub address: u8,
    /// Index into [`BAUD_RATES`] that holds from the next power-up on.
    pub baud_index: u8,
    /// Offset per axis in 0.001°, as it was set; any multiple of a turn apart means the same.
    pub offsets: [i32; AXES],
    /// Direction per axis.
    pub directions: [Direction; AXES],
    /// Damping time in ms.
    pub damping_ms: u16,
    /// Range of reported angles.
    pub range: OutputRange,
}

impl Default for StoredSettings {
    /// Factory defaults. The document gives none for damping: 1000 ms is the value of its example, and the
    /// output range is the first.
    fn default() -> Self {
        Self {
            address: DEFAULT_ADDRESS,
            baud_index: 0,
            offsets: [0; AXES],
            directions: [Direction::Normal; AXES],
            damping_ms: 1000,
            range: OutputRange::Bidirectional,
        }
    }
}

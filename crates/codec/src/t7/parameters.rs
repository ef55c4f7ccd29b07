//! The small enumerations that T7 messages carry with their codes, and the limits of the damping time.

use crate::angle::Range;

/// Shortest damping time in milliseconds. Source: §2.5.2.
pub const MIN_DAMPING_MS: u16 = 2;
/// Longest damping time in milliseconds. Source: §2.5.2.
pub const MAX_DAMPING_MS: u16 = 5_000;

/// One of the three axes; a single-axis T7 (T7-1) uses axis 2, and its axes 0 and 1 read zero.
///
/// Source: T7 guide §1, §2.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Axis {
    /// Axis 0.
    Zero = 0,
    /// Axis 1.
    One = 1,
    /// Axis 2, the only one of a T7-1.
    Two = 2,
}

impl Axis {
    /// All axes, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Zero, Self::One, Self::Two];

    /// The axis of that number.
    pub const fn new(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::Zero),
            1 => Some(Self::One),
            2 => Some(Self::Two),
            _ => None,
        }
    }

    /// The number of the axis.
    pub const fn get(self) -> u8 {
        self as u8
    }

    /// This axis' entry of a per-axis triple.
    pub const fn of<T: Copy>(self, triple: [T; 3]) -> T {
        let [x0, x1, x2] = triple;
        match self {
            Self::Zero => x0,
            Self::One => x1,
            Self::Two => x2,
        }
    }
}

/// Counting direction of an axis. Source: §2.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Direction {
    /// The factory default.
    Normal = 0,
    /// Reversed.
    Reversed = 1,
}

impl Direction {
    /// The direction of that code.
    pub const fn new(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Normal),
            1 => Some(Self::Reversed),
            _ => None,
        }
    }

    /// Its code.
    pub const fn get(self) -> u8 {
        self as u8
    }
}

/// Bit rate of the serial line. Source: §1, §2.7.2.
///
/// The guide's example says "9600 bytes per second"; it means bit/s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum BaudRate {
    /// 115 200 bit/s, the factory default.
    B115200 = 0,
    /// 57 600 bit/s.
    B57600 = 1,
    /// 38 400 bit/s.
    B38400 = 2,
    /// 19 200 bit/s.
    B19200 = 3,
    /// 9600 bit/s.
    B9600 = 4,
}

impl BaudRate {
    /// All rates, fastest first.
    pub const ALL: [Self; 5] = [Self::B115200, Self::B57600, Self::B38400, Self::B19200, Self::B9600];

    /// The rate of that index.
    pub const fn new(index: u8) -> Option<Self> {
        match index {
            0 => Some(Self::B115200),
            1 => Some(Self::B57600),
            2 => Some(Self::B38400),
            3 => Some(Self::B19200),
            4 => Some(Self::B9600),
            _ => None,
        }
    }

    /// Its index.
    pub const fn get(self) -> u8 {
        self as u8
    }

    /// The rate of this many bit/s.
    #[inline(never)]
    pub const fn from_bits_per_second(rate: u32) -> Option<Self> {
        match rate {
            115_200 => Some(Self::B115200),
            57_600 => Some(Self::B57600),
            38_400 => Some(Self::B38400),
            19_200 => Some(Self::B19200),
            9_600 => Some(Self::B9600),
            _ => None,
        }
    }

    /// The rate in bit/s.
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::B115200 => 115_200,
            Self::B57600 => 57_600,
            Self::B38400 => 38_400,
            Self::B19200 => 19_200,
            Self::B9600 => 9_600,
        }
    }
}

/// Kind of device, as Set Address names it. Source: §2.8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum DeviceType {
    /// T7-3, three axes.
    T7_3 = 1,
    /// T7-1, one axis.
    T7_1 = 4,
}

impl DeviceType {
    /// The type of that code.
    pub const fn new(code: u8) -> Option<Self> {
        match code {
            1 => Some(Self::T7_3),
            4 => Some(Self::T7_1),
            _ => None,
        }
    }

    /// Its code.
    pub const fn get(self) -> u8 {
        self as u8
    }
}

/// Code of an output range. Source: §2.6.
pub(super) const fn range_code(range: Range) -> u8 {
    match range {
        Range::Bidirectional => 0,
        Range::Unidirectional => 1,
    }
}

/// The output range of a code that was checked.
pub(super) const fn range(code: u8) -> Range {
    if code == 0 { Range::Bidirectional } else { Range::Unidirectional }
}

/// The direction of a code that was checked.
pub(super) const fn direction(code: u8) -> Direction {
    if code == 0 { Direction::Normal } else { Direction::Reversed }
}

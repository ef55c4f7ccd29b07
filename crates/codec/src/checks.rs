//! Which checks an answer has to pass, and how often each one refused.
//!
//! An 8-bit sum lets one damaged frame in a few hundred through. Each further check removes most of what the
//! one before it let pass; all are on by default, and each can be switched off for a look at a bad line.

use crate::angle::Range;
use crate::character::LineErrors;

/// The checks that an answer has to pass.
///
/// What a frame cannot do without (enough bytes, a command whose layout is known, an address a device can
/// have) is always checked, because there would be no value to hand out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Checks {
    /// No character of the frame carried a UART error flag.
    pub line_errors: bool,
    /// The checksum fits.
    pub checksum: bool,
    /// The answer comes from the address that was asked.
    pub address: bool,
    /// The answer is to the command that was sent (for the ISU, memory address and count included).
    pub command: bool,
    /// The length byte has the one right value. When off, the length follows from the expected command.
    pub length: bool,
    /// Numbers lie within the documented range. The ISU's angle uses all its codes and has none.
    pub values: ValueRange,
}

impl Checks {
    /// Every check on; angles may be of either output range.
    pub const ALL: Self = Self {
        line_errors: true,
        checksum: true,
        address: true,
        command: true,
        length: true,
        values: ValueRange::AnyMode,
    };

    /// Every check off that can be.
    pub const NONE: Self = Self {
        line_errors: false,
        checksum: false,
        address: false,
        command: false,
        length: false,
        values: ValueRange::Off,
    };

    /// The receiver errors of a frame's characters, if there are any and they matter.
    pub(crate) fn complaint(&self, errors: &[LineErrors]) -> Option<LineErrors> {
        let errors = LineErrors::all(errors);
        (self.line_errors && !errors.is_none()).then_some(errors)
    }
}

impl Default for Checks {
    fn default() -> Self {
        Self::ALL
    }
}

/// Where a decoder has its checks from: [`Checks`] that are chosen when it is made, or [`AllChecks`].
pub trait CheckSet: Copy {
    /// The checks.
    fn checks(self) -> Checks;
}

impl CheckSet for Checks {
    #[inline(always)]
    fn checks(self) -> Checks {
        self
    }
}

/// [`Checks::ALL`], for good: the compiler leaves out the way around each check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AllChecks;

impl CheckSet for AllChecks {
    #[inline(always)]
    fn checks(self) -> Checks {
        Checks::ALL
    }
}

/// How narrowly numbers are checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ValueRange {
    /// Not at all.
    Off,
    /// Angles within −180.000°…359.999°: one of the output modes, whichever it is.
    AnyMode,
    /// Angles within the output mode that the device is known to be in.
    Mode(Range),
}

/// The check that refused a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Check {
    /// [`Checks::line_errors`].
    LineErrors,
    /// [`Checks::checksum`].
    Checksum,
    /// [`Checks::address`], wrong or impossible addresses.
    Address,
    /// [`Checks::command`], wrong or unknown commands.
    Command,
    /// [`Checks::length`], and frames of too few or too many bytes.
    Length,
    /// [`Checks::values`], and codes without a meaning.
    Value,
}

/// How often each check refused a frame. All counters stop at their maximum instead of wrapping.
///
/// ```
/// use clino_codec::checks::CheckCounters;
/// use clino_codec::t7::{Answer, DecodeError};
///
/// let mut counters = CheckCounters::new();
/// let damaged = [0x05, 0x06, 0x81, 0xFF, 0xFF, 0x4E, 0xFF, 0x28];
/// match Answer::decode(&damaged) {
///     Ok(_) => counters.accept(),
///     Err(error) => counters.refuse(error.failed_check()),
/// }
/// assert_eq!((counters.good, counters.checksum), (0, 1));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CheckCounters {
    /// Frames that passed.
    pub good: u32,
    /// Refused for a UART error flag.
    pub line_errors: u32,
    /// Refused for the checksum.
    pub checksum: u32,
    /// Refused for the address.
    pub address: u32,
    /// Refused for the command.
    pub command: u32,
    /// Refused for the length.
    pub length: u32,
    /// Refused for a value.
    pub value: u32,
}

impl CheckCounters {
    /// All zero.
    pub const fn new() -> Self {
        Self { good: 0, line_errors: 0, checksum: 0, address: 0, command: 0, length: 0, value: 0 }
    }

    /// Counts a frame that passed.
    pub const fn accept(&mut self) {
        self.good = self.good.saturating_add(1);
    }

    /// Counts a frame that was refused.
    pub const fn refuse(&mut self, check: Check) {
        let counter = match check {
            Check::LineErrors => &mut self.line_errors,
            Check::Checksum => &mut self.checksum,
            Check::Address => &mut self.address,
            Check::Command => &mut self.command,
            Check::Length => &mut self.length,
            Check::Value => &mut self.value,
        };
        *counter = counter.saturating_add(1);
    }

    /// Frames refused by any check.
    pub fn refused(&self) -> u32 {
        [self.line_errors, self.checksum, self.address, self.command, self.length, self.value]
            .into_iter()
            .fold(0, u32::saturating_add)
    }
}

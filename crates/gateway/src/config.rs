//! What the gateway is told to read. Data, not code: the firmware has a default table, later a stored one.

use clino_bus::Micros;
use clino_codec::{isu, t7};

/// 32 T7 on one bus (T7 guide section 1), 14 ISU on one line (AN #201 section 4), two PWM inputs.
pub const MAX_SLOTS: usize = 32 + 14 + 2;

/// An RS485 segment. One protocol per segment: T7 frames parse as ISU commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Bus {
    /// US Digital T7.
    T7,
    /// STT ISU, binary mode.
    Isu,
}

/// A timer input that captures an ISU's PWM output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PwmInput {
    /// First input.
    Pwm1,
    /// Second input.
    Pwm2,
}

/// Where a slot's angle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// From nowhere: the slot is switched off.
    Off,
    /// One axis of a T7.
    T7 {
        /// The node.
        address: t7::Address,
        /// A single-axis T7 measures axis 2.
        axis: t7::Axis,
    },
    /// The angle in an ISU's RAM.
    Isu {
        /// The node.
        address: isu::Address,
    },
    /// The duty cycle at a timer input.
    Pwm {
        /// The input.
        input: PwmInput,
    },
}

impl Source {
    /// The segment to ask on; a PWM input is not asked, it speaks.
    pub const fn bus(&self) -> Option<Bus> {
        match self {
            Source::T7 { .. } => Some(Bus::T7),
            Source::Isu { .. } => Some(Bus::Isu),
            Source::Pwm { .. } | Source::Off => None,
        }
    }
}

/// One line of the slot table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotConfig {
    /// What to read.
    pub source: Source,
    /// From one reading to the next; zero is as often as the bus can. For PWM, the nominal period of the signal.
    pub period: Micros,
    /// Further tries within one reading before it counts as failed.
    pub retries: u8,
    /// A value older than this is not *ok* any more, whatever happened since.
    pub stale_after: Micros,
    /// Least time between two printed lines of this slot while its status does not change.
    pub report_every: Micros,
}

/// From one reading of a T7 to the next: 50 a second, three times what its 8 Hz bandwidth needs.
pub const T7_PERIOD: Micros = Micros::from_millis(20);

/// From one reading of an ISU to the next: half its 533 ms refresh (AN #201 section 4), so that a new angle is
/// seen at most 267 ms after the module has it.
pub const ISU_PERIOD: Micros = Micros::from_millis(266);

/// Nominal period of an ISU's PWM output: 30 Hz (AN #201 section 5).
pub const PWM_PERIOD: Micros = Micros(33_333);

/// A value is stale when two readings after it have failed.
const STALE_PERIODS: u64 = 3;

impl SlotConfig {
    /// A slot that reads nothing.
    pub const OFF: SlotConfig = SlotConfig {
        source: Source::Off,
        period: Micros::ZERO,
        retries: 0,
        stale_after: Micros::ZERO,
        report_every: Micros::ZERO,
    };

    /// A slot that reads this as it usually is read.
    pub const fn usual(source: Source) -> SlotConfig {
        let (period, retries, report_every) = match source {
            Source::Off => return SlotConfig::OFF,
            Source::T7 { .. } => (T7_PERIOD, 1, Micros::from_millis(100)),
            Source::Isu { .. } => (ISU_PERIOD, 1, Micros::ZERO),
            Source::Pwm { .. } => (PWM_PERIOD, 0, Micros::ZERO),
        };
        SlotConfig { source, period, retries, stale_after: period.times(STALE_PERIODS), report_every }
    }
}

//! What the gateway is told to read. Data, not code: the firmware has a default table, later a stored one.

use clino_bus::Micros;
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};

pub use clino_codec::t7::Direction;

use crate::maths::MOST_SAMPLES;

mod span;

pub use span::Span;

/// 32 T7 on one bus (T7 guide section 1), 14 ISU on one line (AN #201 section 4), two PWM inputs.
pub const MAX_SLOTS: usize = 32 + 14 + 2;

/// An RS485 segment. One protocol per segment, by construction: T7 frames parse as ISU commands, and a slot cannot be
/// told to look for a sensor on the other segment.
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
    /// From nowhere: there is nothing in the slot.
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

    /// The segment and the address on it.
    pub const fn node(&self) -> Option<(Bus, u8)> {
        match self {
            Source::T7 { address, .. } => Some((Bus::T7, address.get())),
            Source::Isu { address } => Some((Bus::Isu, address.get())),
            Source::Pwm { .. } | Source::Off => None,
        }
    }
}

/// What a T7 is asked for. Others have one question only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// The angle of the slot's axis: 8 characters of answer.
    Angle,
    /// All it knows (T7 guide section 2.3): temperature and accelerations besides, 34 characters of answer.
    Everything,
}

/// What is made of the last few angles. Both work across the seam of the turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The last one counts.
    Off,
    /// The mean of so many: less noise.
    Mean(u8),
    /// The median of so many: no outliers.
    Median(u8),
}

impl Filter {
    /// Most angles that are kept.
    pub const MOST: u8 = MOST_SAMPLES as u8;

    /// How many angles are kept.
    pub const fn samples(self) -> u8 {
        match self {
            Filter::Off => 1,
            Filter::Mean(samples) | Filter::Median(samples) => samples,
        }
    }
}

/// One line of the slot table. 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotConfig {
    /// What to read.
    pub source: Source,
    /// Whether it is read at all.
    pub enabled: bool,
    /// What a T7 is asked for.
    pub ask: Ask,
    /// Further tries within one reading before it counts as failed.
    pub retries: u8,
    /// Whether the first value, a jump, and a value after a line error are published only when a second one agrees.
    pub confirm: bool,
    /// What is made of the last few angles.
    pub filter: Filter,
    /// [`Direction::Reversed`] counts the other way round.
    pub direction: Direction,
    /// How the published angle counts a turn, whatever the sensor does.
    pub range: Range,
    /// For a PWM input: the slot that reads the same ISU over its serial line, to be compared with.
    pub partner: Option<u8>,
    /// What is still healthy: for a PWM input the difference to its partner in 0.01°, for a T7 that is asked for
    /// everything the deviation of its acceleration from 1 g in 0.001 g.
    pub tolerance: u16,
    /// From one reading to the next; zero is as often as the bus can. For PWM, the nominal period of the signal.
    pub period: Span,
    /// Longest time from the request to the answer; zero is what the sensor's document says.
    pub timeout: Span,
    /// A value older than this is not *ok* any more, whatever happened since.
    pub stale_after: Span,
    /// Least time between two printed lines of this slot while its status does not change.
    pub report_every: Span,
    /// Where the sensor says this, the slot says zero.
    pub soft_zero: Angle,
    /// An angle that is further from the last one than this allows is a jump, in 0.001°/s; zero allows any.
    pub max_rate: u32,
}

/// From one reading of a T7 to the next: 50 a second, three times what its 8 Hz bandwidth needs.
pub const T7_PERIOD: Span = Span::from_millis(20);

/// From one reading of an ISU to the next, at most: half its 533 ms refresh (AN #201 section 4). Within that the
/// readings follow the refresh.
pub const ISU_PERIOD: Span = Span::from_millis(266);

/// Nominal period of an ISU's PWM output: 30 Hz (AN #201 section 5).
pub const PWM_PERIOD: Span = Span::from_micros(33_333);

/// A value is stale when two readings after it have failed.
const STALE_PERIODS: u32 = 3;

/// Faster than anybody tilts what is worth reading at 8 Hz: half a turn a second.
const T7_MAX_RATE: u32 = 180_000;
/// From one refresh of an ISU to the next, an eighth of a turn.
const ISU_MAX_RATE: u32 = 90_000;

/// Six steps of the PWM output (0.088° each), and the 0.03° by which its printed law differs from its own.
const PWM_TOLERANCE: u16 = 56;
/// The T7 guide's own example (section 2.3) shows 0.956 g.
const T7_TOLERANCE: u16 = 100;

impl SlotConfig {
    /// A slot that reads nothing.
    pub const OFF: SlotConfig = SlotConfig {
        source: Source::Off,
        enabled: false,
        ask: Ask::Angle,
        retries: 0,
        confirm: false,
        filter: Filter::Off,
        direction: Direction::Normal,
        range: Range::Bidirectional,
        partner: None,
        tolerance: 0,
        period: Span::ZERO,
        timeout: Span::ZERO,
        stale_after: Span::from_millis(1_000),
        report_every: Span::ZERO,
        soft_zero: Angle::ZERO,
        max_rate: 0,
    };

    /// A slot that reads this as it usually is read.
    ///
    /// A PWM cycle is not confirmed: it is no message whose checksum may fail to see an error, its period and duty are
    /// checked, and a second cycle would be 33 ms late.
    pub const fn usual(source: Source) -> SlotConfig {
        let usual = SlotConfig { source, enabled: true, retries: 1, confirm: true, ..SlotConfig::OFF };
        match source {
            Source::Off => SlotConfig::OFF,
            Source::T7 { .. } => SlotConfig {
                report_every: Span::from_millis(100),
                max_rate: T7_MAX_RATE,
                tolerance: T7_TOLERANCE,
                ..usual.every(T7_PERIOD)
            },
            Source::Isu { .. } => {
                SlotConfig { range: Range::Unidirectional, max_rate: ISU_MAX_RATE, ..usual.every(ISU_PERIOD) }
            }
            Source::Pwm { .. } => SlotConfig {
                range: Range::Unidirectional,
                retries: 0,
                confirm: false,
                tolerance: PWM_TOLERANCE,
                ..usual.every(PWM_PERIOD)
            },
        }
    }

    /// The same with this period, and stale three periods after; with a period of zero, a second after.
    #[must_use]
    pub const fn every(self, period: Span) -> SlotConfig {
        let stale_after = match period {
            Span::ZERO => Span::from_millis(1_000),
            period => period.times(STALE_PERIODS),
        };
        SlotConfig { period, stale_after, ..self }
    }

    /// The segment to ask on, if this slot asks.
    pub const fn bus(&self) -> Option<Bus> {
        if self.enabled { self.source.bus() } else { None }
    }

    /// Whether the slot reads anything.
    pub fn is_on(&self) -> bool {
        self.enabled && self.source != Source::Off
    }

    /// Time to the next reading, at most.
    pub(crate) fn period(&self) -> Micros {
        self.period.into()
    }
}

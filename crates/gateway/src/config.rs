//! The configuration of the slots. Data, not code: the firmware has a default table, later a stored one.
//!
//! [`SlotConfig::usual`] is the only place that defines the default of a setting.

use clino_bus::Duration;
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};

use crate::features;

pub use clino_codec::t7::Direction;

mod alarm;
mod name;

pub use alarm::{AlarmConfig, AlarmLimits};
pub use name::Name;
pub(crate) use name::are_characters;

/// 32 T7 on one bus (T7 guide section 1), 14 ISU on one line (AN #201 section 4), two PWM inputs.
pub const MAX_SLOTS: usize = 32 + 14 + 2;

/// An RS485 segment. One protocol per segment, by construction: T7 frames parse as ISU commands, and no slot can be
/// set to read a sensor on the other segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Bus {
    /// US Digital T7. Number 0 in every numeric interface.
    T7 = 0,
    /// STT ISU, binary mode. Number 1.
    Isu = 1,
}

impl Bus {
    /// How many this build has.
    pub const COUNT: usize = 1 + features::ISU as usize;

    /// Those of this build, by their numbers.
    pub const ALL: [Bus; Bus::COUNT] = [
        Bus::T7,
        #[cfg(feature = "isu")]
        Bus::Isu,
    ];

    /// Whether this build has it.
    pub const fn is_built(self) -> bool {
        match self {
            Bus::T7 => true,
            Bus::Isu => features::ISU,
        }
    }

    /// The name used in every text interface.
    #[inline(never)]
    pub const fn name(self) -> &'static str {
        match self {
            Bus::T7 => "t7",
            Bus::Isu => "isu",
        }
    }

    /// The bus with this number.
    pub fn from_number(number: u16) -> Option<Bus> {
        Bus::ALL.get(usize::from(number)).copied()
    }
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

/// Kind of a slot's source. The codes are those of every interface and of the stored record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Kind {
    /// The slot is unused.
    #[default]
    Off = 0,
    /// An axis of a T7.
    T7 = 1,
    /// An ISU on its serial line.
    Isu = 2,
    /// The PWM output of an ISU.
    Pwm = 3,
}

impl Kind {
    /// All kinds, by their codes.
    pub const ALL: [Kind; 4] = [Kind::Off, Kind::T7, Kind::Isu, Kind::Pwm];

    /// The names used in every text interface, by their codes; those that this build does not have are empty.
    pub const NAMES: &'static [&'static str] = &[
        Kind::Off.name(),
        Kind::T7.name(),
        if Kind::Isu.is_built() { Kind::Isu.name() } else { "" },
        if Kind::Pwm.is_built() { Kind::Pwm.name() } else { "" },
    ];

    /// Whether this build has it.
    pub const fn is_built(self) -> bool {
        match self {
            Kind::Off | Kind::T7 => true,
            Kind::Isu => features::ISU,
            Kind::Pwm => features::PWM,
        }
    }

    /// What it means, for the documentation.
    pub const fn meaning(self) -> &'static str {
        match self {
            Kind::Off => "the slot is unused",
            Kind::T7 => "an axis of a US Digital T7",
            Kind::Isu => "an STT ISU on its serial line",
            Kind::Pwm => "the PWM output of an STT ISU",
        }
    }

    /// The kind with this code.
    pub fn from_code(code: u8) -> Option<Kind> {
        Kind::ALL.get(usize::from(code)).copied()
    }

    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Off => "off",
            Kind::T7 => "t7",
            Kind::Isu => "isu",
            Kind::Pwm => "pwm",
        }
    }
}

/// Where a slot's angle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// From nowhere: the slot is unused.
    Off,
    /// From a source that is not complete: its kind has no such address. Held and shown, never read.
    Incomplete {
        /// The kind; [`Kind::Off`] while only the address is known.
        kind: Kind,
        /// The address.
        address: u8,
    },
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
    /// The source of this kind at this address (of a PWM: its input, 1 or 2); [`Source::Incomplete`] if the kind has no
    /// such address.
    pub fn of(kind: Kind, address: u8, axis: t7::Axis) -> Source {
        let source = match (kind, address) {
            _ if !kind.is_built() => None,
            (Kind::Off, 0) => Some(Source::Off),
            (Kind::Off, _) => None,
            (Kind::T7, _) => t7::Address::of_request(address).map(|address| Source::T7 { address, axis }),
            (Kind::Isu, _) => isu::Address::new(address).map(|address| Source::Isu { address }),
            (Kind::Pwm, 1) => Some(Source::Pwm { input: PwmInput::Pwm1 }),
            (Kind::Pwm, 2) => Some(Source::Pwm { input: PwmInput::Pwm2 }),
            (Kind::Pwm, _) => None,
        };
        source.unwrap_or(Source::Incomplete { kind, address })
    }

    /// The source of this kind with an address that was not set for this kind. An address that was never set is 0,
    /// which is an address of an ISU, too.
    pub fn held(kind: Kind, address: u8, axis: t7::Axis) -> Source {
        match (kind, address) {
            (Kind::Isu, 0) => Source::Incomplete { kind, address },
            _ => Source::of(kind, address, axis),
        }
    }

    /// Its kind.
    pub const fn kind(&self) -> Kind {
        match *self {
            Source::Off => Kind::Off,
            Source::Incomplete { kind, .. } => kind,
            Source::T7 { .. } => Kind::T7,
            Source::Isu { .. } => Kind::Isu,
            Source::Pwm { .. } => Kind::Pwm,
        }
    }

    /// Its address; of a PWM its input, 1 or 2.
    pub const fn address(&self) -> u8 {
        match *self {
            Source::Off => 0,
            Source::Incomplete { address, .. } => address,
            Source::T7 { address, .. } => address.get(),
            Source::Isu { address } => address.get(),
            Source::Pwm { input: PwmInput::Pwm1 } => 1,
            Source::Pwm { input: PwmInput::Pwm2 } => 2,
        }
    }

    /// Whether it cannot be read: a kind without an address; an axis of a T7 that cannot be asked whether it measures
    /// it, because all answer to its address.
    pub fn is_faulty(&self) -> bool {
        match self {
            Source::Incomplete { kind, .. } => *kind != Kind::Off,
            Source::T7 { address, axis } => address.is_all() && *axis != SINGLE_AXIS,
            Source::Off | Source::Isu { .. } | Source::Pwm { .. } => false,
        }
    }

    /// The segment to ask on; a PWM input sends without being asked.
    pub const fn bus(&self) -> Option<Bus> {
        match self {
            Source::T7 { .. } => Some(Bus::T7),
            Source::Isu { .. } => Some(Bus::Isu),
            Source::Pwm { .. } | Source::Incomplete { .. } | Source::Off => None,
        }
    }

    /// The segment and the address on it.
    pub const fn node(&self) -> Option<(Bus, u8)> {
        match self {
            Source::T7 { address, .. } => Some((Bus::T7, address.get())),
            Source::Isu { address } => Some((Bus::Isu, address.get())),
            Source::Pwm { .. } | Source::Incomplete { .. } | Source::Off => None,
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

/// How the last [`samples`](SlotConfig::samples) angles are combined. Both work across the seam of the turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The last one counts.
    Off,
    /// Their mean: less noise.
    Mean,
    /// Their median: no outliers.
    Median,
}

impl Filter {
    /// Most angles that are kept.
    pub const MOST: u8 = MOST_SAMPLES as u8;
}

/// Most angles that a filter goes over.
pub(crate) const MOST_SAMPLES: usize = 8;

/// One line of the slot table. What can be set of it, and within which limits, is in
/// [`settings::slot`](crate::settings::slot).
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
    /// How the last few angles are combined.
    pub filter: Filter,
    /// How many angles the filter goes over.
    pub samples: u8,
    /// The axis that is held while the slot reads no T7.
    pub held_axis: t7::Axis,
    /// [`Direction::Reversed`] counts the other way round.
    pub direction: Direction,
    /// How the published angle counts a turn, whatever the sensor does.
    pub range: Range,
    /// For a PWM input: the slot that reads the same ISU over its serial line, to be compared with.
    pub partner: Option<u8>,
    /// The greatest deviation that a cross-check accepts: for a PWM input the difference to its partner in 0.001°, for
    /// a T7 that is asked for everything the deviation of its acceleration from 1 g in 0.001 g.
    pub tolerance: u16,
    /// From one reading to the next; zero is as often as the bus can. For PWM, the nominal period of the signal.
    pub period: Duration,
    /// Longest time from the request to the answer; zero is what the sensor's document says.
    pub timeout: Duration,
    /// A value older than this is not *ok* any more, whatever happened since; zero follows the period:
    /// [`SlotConfig::stale_after`].
    pub stale: Duration,
    /// Least time between two printed lines of this slot while its status does not change.
    pub report_every: Duration,
    /// Where the sensor says this, the slot says zero.
    pub soft_zero: Angle,
    /// The name that users give it.
    pub name: Name,
    /// An angle that is further from the last one than this allows is a jump, in 0.001°/s; zero allows any.
    pub max_rate: u32,
    /// What its alarms watch.
    pub alarm: AlarmConfig,
}

/// What a single-axis T7 measures (T7 guide section 1).
pub const SINGLE_AXIS: t7::Axis = t7::Axis::Two;

/// From one reading of a T7 to the next: 50 a second, three times what its 8 Hz bandwidth needs.
pub const T7_PERIOD: Duration = Duration::from_millis(20);

/// From one reading of an ISU to the next, at most: half its 533 ms refresh (AN #201 section 4). Within that the
/// readings follow the refresh.
pub const ISU_PERIOD: Duration = Duration::from_millis(266);

/// Nominal period of an ISU's PWM output: 30 Hz (AN #201 section 5).
pub const PWM_PERIOD: Duration = Duration::from_micros(33_333);

/// A value is stale when two readings after it have failed.
const STALE_PERIODS: u32 = 3;
/// The stale limit of a slot that is read as often as its bus can.
const STALE_WITHOUT_PERIOD: Duration = Duration::from_millis(1_000);
/// The least stale limit that follows a period: ten exchanges of 3.04 ms (T7) and 13.5 ms (ISU), see `lint.rs`; three
/// cycles of a PWM output.
const T7_STALE: Duration = Duration::from_millis(30);
const ISU_STALE: Duration = Duration::from_millis(150);
const PWM_STALE: Duration = PWM_PERIOD.times(STALE_PERIODS);

/// Half a turn a second: faster than any motion that a sensor with a bandwidth of 8 Hz can follow usefully.
const T7_MAX_RATE: u32 = 180_000;
/// From one refresh of an ISU to the next, an eighth of a turn.
const ISU_MAX_RATE: u32 = 90_000;

/// Six steps of the PWM output (0.088° each), and the 0.03° by which its printed law differs from its own.
const PWM_TOLERANCE: u16 = 560;
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
        samples: 1,
        held_axis: SINGLE_AXIS,
        direction: Direction::Normal,
        range: Range::Bidirectional,
        partner: None,
        tolerance: 0,
        period: Duration::ZERO,
        timeout: Duration::ZERO,
        stale: Duration::ZERO,
        report_every: Duration::ZERO,
        soft_zero: Angle::ZERO,
        name: Name::NONE,
        max_rate: 0,
        alarm: AlarmConfig::OFF,
    };

    /// A slot that reads this as it usually is read.
    ///
    /// A PWM cycle is not confirmed: it has no checksum that may miss an error, its period and duty are
    /// checked, and a second cycle would be 33 ms late.
    pub const fn usual(source: Source) -> SlotConfig {
        let usual = SlotConfig { source, enabled: true, retries: 1, confirm: true, ..SlotConfig::OFF };
        match source.kind() {
            Kind::Off => SlotConfig { source, ..SlotConfig::OFF },
            Kind::T7 => SlotConfig {
                report_every: Duration::from_millis(100),
                max_rate: T7_MAX_RATE,
                tolerance: T7_TOLERANCE,
                ..usual.every(T7_PERIOD)
            },
            Kind::Isu => {
                SlotConfig { range: Range::Unidirectional, max_rate: ISU_MAX_RATE, ..usual.every(ISU_PERIOD) }
            }
            Kind::Pwm => SlotConfig {
                range: Range::Unidirectional,
                retries: 0,
                confirm: false,
                tolerance: PWM_TOLERANCE,
                ..usual.every(PWM_PERIOD)
            },
        }
    }

    /// The same with this period.
    #[must_use]
    pub const fn every(self, period: Duration) -> SlotConfig {
        SlotConfig { period, ..self }
    }

    /// The age at which a value is stale: as it was set, or three times the longer of period and timeout, so that two
    /// readings in a row may fail.
    pub const fn stale_after(&self) -> Duration {
        if self.stale.as_micros() > 0 {
            return self.stale;
        }
        let longest = self.period.longer(self.timeout).times(STALE_PERIODS);
        let least = match self.source.kind() {
            Kind::Off => Duration::ZERO,
            Kind::T7 => T7_STALE,
            Kind::Isu => ISU_STALE,
            Kind::Pwm => PWM_STALE,
        };
        if self.period.as_micros() > 0 { longest.longer(least) } else { longest.longer(STALE_WITHOUT_PERIOD) }
    }

    /// The segment to ask on, if this slot asks.
    pub fn bus(&self) -> Option<Bus> {
        if self.is_on() { self.source.bus() } else { None }
    }

    /// The segment and the address that this slot asks, if it asks.
    pub fn node(&self) -> Option<(Bus, u8)> {
        if self.is_on() { self.source.node() } else { None }
    }

    /// Whether the slot reads anything.
    pub fn is_on(&self) -> bool {
        self.enabled
            && !matches!(self.source, Source::Off | Source::Incomplete { .. })
            && !self.source.is_faulty()
    }
}

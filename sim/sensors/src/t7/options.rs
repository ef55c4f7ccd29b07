//! Everything about a simulated T7 that is not in its own memory: what it measures, how long it takes, and
//! how it behaves where the document leaves a choice.

use super::settings::{AXES, BAUD_RATES, DAMPING_MS, DEFAULT_ADDRESS, SETTABLE_ADDRESSES, StoredSettings};
use crate::latency::Latency;
use crate::motion::Motion;
use crate::node::Ns;

const MICROSECOND: Ns = 1_000;
const MILLISECOND: Ns = 1_000_000;

/// Longest documented time to answer a Get command (section 1).
pub const GET_LIMIT: Ns = 2 * MILLISECOND;

/// Longest documented time to answer a Set command (section 1).
pub const SET_LIMIT: Ns = 25 * MILLISECOND;

/// What damping does to the angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Damping {
    /// Nothing: the reported angle is the true one at the instant of the answer. Checkers stay simple.
    #[default]
    Ignored,
    /// The reported angle is the mean over the damping time before the answer, so it lags a motion by half of
    /// that and has settled one damping time after a step.
    Averaged,
}

/// How a device treats an answer that carries its own address, sent by a device with the same address.
///
/// Answers have the form of commands; the document does not say how a device tells them apart. No device can tell
/// the answers to Set Angle Output Range and Set Baud Rate: they are byte for byte commands to set value 0, and are
/// carried out either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TwinsAnswers {
    /// Known by their length, which their command cannot have, and dropped.
    #[default]
    Dropped,
    /// Taken for commands of a wrong length and answered with a status: twins of different latencies never stop.
    TakenForCommands,
}

/// Everything about a simulated T7 that is not in its own memory.
#[derive(Clone, Debug)]
pub struct Options {
    /// True angle per axis; a T7-1 uses axis 2 only.
    pub motion: [Motion; AXES],
    /// What damping does.
    pub damping: Damping,
    /// Temperature in 0.01 °C; documented −500 to 19000.
    pub temperature: i16,
    /// End of a Get command to first start bit; at most [`GET_LIMIT`].
    pub get_latency: Latency,
    /// End of a Set command to first start bit; at most [`SET_LIMIT`].
    pub set_latency: Latency,
    /// End of a Set command to the setting being stored; counted to the answer if that comes earlier.
    pub write_time: Ns,
    /// How long before the first start bit the line driver is on.
    pub drive_lead: Ns,
    /// How long after the last stop bit the line driver stays on. The document does not say.
    pub hold: Ns,
    /// Power-up to the first character heard. The document does not say.
    pub boot_time: Ns,
    /// Answers Get All Angles with the length byte 0A, as the document's example prints it.
    pub length_quirk: bool,
    /// How it treats the answers of a device with its address.
    pub twins_answers: TwinsAnswers,
    /// Seed of the latency jitter.
    pub seed: u64,
}

impl Default for Options {
    /// A device as slow as the document allows.
    fn default() -> Self {
        Self {
            motion: [const { Motion::Constant(0) }; AXES],
            damping: Damping::Ignored,
            temperature: 2300,
            get_latency: Latency::fixed(GET_LIMIT),
            set_latency: Latency::fixed(SET_LIMIT),
            write_time: 20 * MILLISECOND,
            drive_lead: MICROSECOND,
            // About half a character at 115200: an interrupt on transmission complete that is not the only
            // one, and less than the one character that masters customarily wait.
            hold: 40 * MICROSECOND,
            boot_time: 20 * MILLISECOND,
            length_quirk: false,
            twins_answers: TwinsAnswers::default(),
            seed: 0,
        }
    }
}

/// Why a T7 cannot be made like that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadOption {
    /// An answer could take longer than documented (use a fault for that).
    Latency {
        /// Longest time asked for, in ns.
        longest: Ns,
        /// Longest documented time, in ns.
        limit: Ns,
    },
    /// No T7 has this address.
    Address(u8),
    /// There is no such baud rate index.
    BaudIndex(u8),
    /// The damping time is outside 2 … 5000 ms.
    Damping(u16),
}

impl core::fmt::Display for BadOption {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Latency { longest, limit } => {
                write!(f, "latency {longest} ns is above the documented limit of {limit} ns")
            }
            Self::Address(address) => write!(f, "address {address} is not 1 to 100 or 127"),
            Self::BaudIndex(index) => write!(f, "baud rate index {index} is not 0 to 4"),
            Self::Damping(ms) => write!(f, "damping {ms} ms is not 2 to 5000 ms"),
        }
    }
}

impl core::error::Error for BadOption {}

/// Whether there can be such a device.
pub(super) fn check(settings: &StoredSettings, options: &Options) -> Result<(), BadOption> {
    for (latency, limit) in [(options.get_latency, GET_LIMIT), (options.set_latency, SET_LIMIT)] {
        let longest = latency.max.max(latency.min);
        if longest > limit {
            return Err(BadOption::Latency { longest, limit });
        }
    }
    if !SETTABLE_ADDRESSES.contains(&settings.address) && settings.address != DEFAULT_ADDRESS {
        return Err(BadOption::Address(settings.address));
    }
    if usize::from(settings.baud_index) >= BAUD_RATES.len() {
        return Err(BadOption::BaudIndex(settings.baud_index));
    }
    if !DAMPING_MS.contains(&settings.damping_ms) {
        return Err(BadOption::Damping(settings.damping_ms));
    }
    Ok(())
}

//! What people and programs may ask of the running gateway.
//!
//! [`Order::check`] says what is wrong with an order, with the limit that it breaks; an order that passes is carried
//! out whole.

use clino_bus::Micros;
use clino_codec::t7;

use crate::config::{Bus, Filter, MAX_SLOTS, SlotConfig, Source, Span};
use crate::restraint::Restraint;
use crate::settings::BusChange;
use crate::task;

/// Something to be done by the bus level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// From now on the slot reads this. Its last value is forgotten.
    Slot {
        /// Number of the slot.
        slot: u8,
        /// What it reads.
        config: SlotConfig,
    },
    /// These fields of a bus change, as soon as no exchange is in hand. A bit rate is refused as [`Refusal::Busy`] while a
    /// task needs the present one.
    Bus {
        /// The bus.
        bus: Bus,
        /// What changes.
        change: BusChange,
    },
    /// A task on the T7 bus.
    T7(task::t7::Task),
    /// A task on the ISU bus.
    Isu(task::isu::Task),
    /// The task on this bus shall stop at its next consistent point.
    Cancel(Bus),
}

/// Why an order is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A number is out of its range.
    Range {
        /// Which one, with its unit.
        what: &'static str,
        /// What was asked for.
        value: u64,
        /// Smallest allowed.
        least: u64,
        /// Largest allowed.
        most: u64,
    },
    /// The sensors of the bus do not have this bit rate.
    BitRate {
        /// What was asked for, bit/s.
        value: u32,
        /// What they have, bit/s.
        allowed: &'static [u32],
    },
    /// A T7 cannot be told this.
    T7(t7::EncodeError),
    /// An ISU cannot be told this.
    Isu(clino_commissioning::isu::Cause),
    /// A task under way does not leave room for it: another task, or a change of what the task works on. Ask again.
    Busy,
    /// It is right, but not done in times like these.
    Restrained(Restraint),
}

/// Bit rates of a T7 (T7 guide section 2.7.2), bit/s.
pub const T7_BIT_RATES: [u32; 5] = [115_200, 57_600, 38_400, 19_200, 9_600];
/// The bit rate of an ISU (AN #201 section 4), bit/s.
pub const ISU_BIT_RATES: [u32; 1] = [9_600];
/// Longest period: twenty minutes.
pub const LONGEST_PERIOD: Micros = Micros::from_millis(1_200_000);
/// Longest age of a good value: an hour, three of the longest periods.
pub const LONGEST_STALE: Micros = Micros::from_millis(3_600_000);
/// Longest time allowed for an answer to begin: the only one an ISU's document knows, 400 ms (AN #201 section 4), and room.
pub const LONGEST_TIMEOUT: Micros = Micros::from_millis(500);
/// Shortest age at which a value may be called stale: a slower T7 answers within 25 ms.
pub const SHORTEST_STALE: Micros = Micros::from_millis(10);
/// Most tries of one reading after the first.
pub const MOST_RETRIES: u8 = 10;
/// Longest turnaround guard.
pub const LONGEST_GUARD: Micros = Micros::from_millis(20);

/// Longest driver-enable delay, before and after a frame.
pub const LONGEST_DELAY: Micros = Micros::from_millis(5);

impl Order {
    /// Whether it can be carried out.
    pub fn check(&self) -> Result<(), Refusal> {
        match self {
            Order::Slot { slot, config } => {
                range("slot", u64::from(*slot), 0, LAST_SLOT)?;
                if config.source == Source::Off {
                    return Ok(());
                }
                check(config)
            }
            Order::Bus { bus, change } => {
                change.baud.map_or(Ok(()), |baud| bit_rate(*bus, baud))?;
                let wait = |what, wait: Option<Micros>, most: Micros| {
                    wait.map_or(Ok(()), |wait| range(what, wait.0, 0, most.0))
                };
                wait("guard_us", change.guard, LONGEST_GUARD)?;
                wait("pre_us", change.pre_delay, LONGEST_DELAY)?;
                wait("post_us", change.post_delay, LONGEST_DELAY)
            }
            Order::T7(task) => task::t7::Work::check(task).map_err(Refusal::T7),
            Order::Isu(task) => task::isu::Work::check(task).map_err(Refusal::Isu),
            Order::Cancel(_) => Ok(()),
        }
    }
}

/// A period of so many milliseconds.
///
/// # Errors
/// It is longer than [`LONGEST_PERIOD`].
pub fn period(ms: u32) -> Result<Span, Refusal> {
    range("period_us", Micros::from_millis(ms).0, 0, LONGEST_PERIOD.0)?;
    Ok(Span::from_millis(ms))
}

/// An age of so many milliseconds after which a value is stale.
///
/// # Errors
/// It is shorter than [`SHORTEST_STALE`] or longer than [`LONGEST_STALE`].
pub fn stale_after(ms: u32) -> Result<Span, Refusal> {
    range("stale_us", Micros::from_millis(ms).0, SHORTEST_STALE.0, LONGEST_STALE.0)?;
    Ok(Span::from_millis(ms))
}

/// The last slot.
const LAST_SLOT: u64 = MAX_SLOTS.saturating_sub(1) as u64;

/// Whether a slot can be read like this.
fn check(config: &SlotConfig) -> Result<(), Refusal> {
    range("period_us", micros(config.period), 0, LONGEST_PERIOD.0)?;
    range("timeout_us", micros(config.timeout), 0, LONGEST_TIMEOUT.0)?;
    range("stale_us", micros(config.stale_after), SHORTEST_STALE.0, LONGEST_STALE.0)?;
    range("report_us", micros(config.report_every), 0, LONGEST_STALE.0)?;
    range("retries", u64::from(config.retries), 0, u64::from(MOST_RETRIES))?;
    range("filter_samples", u64::from(config.filter.samples()), 1, u64::from(Filter::MOST))?;
    range("partner", u64::from(config.partner.unwrap_or(0)), 0, LAST_SLOT)
}

fn micros(span: Span) -> u64 {
    span.as_micros().into()
}

fn range(what: &'static str, value: u64, least: u64, most: u64) -> Result<(), Refusal> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => Err(Refusal::Range { what, value, least, most }),
    }
}

fn bit_rate(bus: Bus, baud: u32) -> Result<(), Refusal> {
    let allowed: &'static [u32] = match bus {
        Bus::T7 => &T7_BIT_RATES,
        Bus::Isu => &ISU_BIT_RATES,
    };
    match allowed.contains(&baud) {
        true => Ok(()),
        false => Err(Refusal::BitRate { value: baud, allowed }),
    }
}

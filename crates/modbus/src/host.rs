//! What the server needs of the rest of the gateway: what it reads from, and whom it asks for changes.

use clino_bus::{Counters, DriverEnable, Micros};
use clino_gateway::summary::Summary;
use clino_gateway::{BusChange, BusHealth};
use clino_recovery::Start;

use crate::command::{Command, Progress};
use crate::config::{BusConfig, SlotConfig};
use crate::settings::Settings;
use crate::status::Status;

/// Slots of the map. A gateway with fewer answers for the rest with [`Status::Disabled`].
pub const SLOTS: usize = 48;

/// The gateway as the server sees it.
///
/// A request is answered from one state: the server calls [`Host::snapshot`] before it reads anything for it, and all
/// methods answer as of then until the next call, whatever an interrupt publishes in between. If a host cannot hold its
/// state still for that long, it says so in the end, and the server begins again.
pub trait Host {
    /// Turns to the state that the next request is answered from.
    fn snapshot(&mut self);

    /// Whether all that was answered since is of that state.
    fn held_still(&self) -> bool;

    /// The gateway as a whole.
    fn gateway(&self) -> GatewayView;

    /// Its slots and faults, summed up.
    fn summary(&self) -> Summary;

    /// Why, how often and how it has started. The same all the time.
    fn start(&self) -> Start;

    /// The value of a slot.
    fn reading(&self, slot: usize) -> SlotReading;

    /// The rest of what is known of a slot.
    fn detail(&self, slot: usize) -> SlotDetail;

    /// What happened on a bus since reset.
    fn counters(&self, bus: Bus) -> Counters;

    /// Whether a bus is out of order.
    fn health(&self, bus: Bus) -> BusHealth;

    /// How a bus's line driver behaved.
    fn driver_enable(&self, bus: Bus) -> DriverEnable;

    /// How a slot is set, writes included that were accepted and not carried out yet: a write to one register goes on
    /// from what the last one left in the others.
    fn slot_config(&self, slot: usize) -> SlotConfig;

    /// How a bus is set; writes included, as above.
    fn bus_config(&self, bus: Bus) -> BusConfig;

    /// Checks a change, and makes it if nothing is wrong with it: whole or not at all. Changes hold until reset,
    /// unless [`Command::Save`] follows.
    ///
    /// # Errors
    /// [`Refusal`]; nothing has changed then.
    fn write(&mut self, write: &Write) -> Result<(), Refusal>;
}

/// A segment with sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Bus {
    /// US Digital T7; number 0 in the map.
    T7 = 0,
    /// STT ISU; number 1.
    Isu = 1,
}

/// Something that is to change. One request changes one thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Write {
    /// How a slot is set.
    Slot {
        /// Its number.
        slot: u8,
        /// All of it.
        config: SlotConfig,
    },
    /// How a bus is set.
    Bus {
        /// Which one.
        bus: Bus,
        /// The registers that are written.
        change: BusChange,
    },
    /// How this server's port runs. Valid already; in force as soon as the answer is out.
    Port(Settings),
    /// Something to do. The arm key was there if it takes one.
    Command {
        /// What.
        command: Command,
        /// The slot, or the bus, that it is about.
        target: u16,
        /// With this value.
        value: i32,
        /// The arm key was there.
        armed: bool,
    },
}

/// Why a change is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// A value is out of its range, or does not go with another: exception 03.
    Value,
    /// It cannot be done: exception 04.
    Failed,
    /// Something else is under way: exception 06.
    Busy,
}

/// The gateway as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatewayView {
    /// Version of the firmware: major, minor, patch.
    pub version: (u8, u8, u16),
    /// Time since reset.
    pub uptime: Micros,
    /// [`Signals`](clino_gateway::summary::Signals), as bits.
    pub status: u16,
    /// Counts the states that were published; wraps.
    pub sequence: u16,
    /// What has become of the last command.
    pub progress: Progress,
}

/// The value of a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotReading {
    /// What the value is worth.
    pub status: Status,
    /// The angle in millidegrees; only with [`Status::Ok`], the server drops it otherwise.
    pub angle: Option<i32>,
    /// Time since the last good value was received, if there was one.
    pub age: Option<Micros>,
}

/// The rest of what is known of a slot. `None` is what the slot's sensor does not have, or nobody has asked for yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotDetail {
    /// A set of [`slot_bits`].
    pub flags: u16,
    /// The angle as the sensor said it, in millidegrees.
    pub raw: Option<i32>,
    /// The angle with the turns since the first value, in millidegrees.
    pub unwrapped: Option<i32>,
    /// Temperature in hundredths of a degree Celsius.
    pub temperature: Option<i16>,
    /// Counts the outcomes, good or bad; wraps.
    pub sequence: u16,
    /// The status of the last reading that failed.
    pub last_error: Option<Status>,
    /// What the slot reads.
    pub kind: Kind,
    /// Where: address on the bus, or number of the PWM input.
    pub address: u8,
    /// What happened to its requests.
    pub counters: SlotCounters,
}

/// The bits of [`SlotDetail::flags`].
pub mod slot_bits {
    /// The value is the one before, read again: the sensor had no new one.
    pub const REPEATED: u16 = 1 << 0;
    /// A second reading is awaited before the value is published.
    pub const UNCONFIRMED: u16 = 1 << 1;
    /// A second way to know the angle disagrees with it.
    pub const CROSS_CHECK: u16 = 1 << 2;
    /// The slot is asked less often because it does not answer.
    pub const QUARANTINE: u16 = 1 << 3;
    /// The accelerations of a T7 do not add up to 1 g.
    pub const GRAVITY: u16 = 1 << 4;
    /// So many requests fail that checksums of eight bits are not to be relied upon.
    pub const NOISY: u16 = 1 << 5;
    /// The bits with names and meanings, for the documentation.
    pub const ALL: [(u16, &str, &str); 6] = [
        (REPEATED, "repeated", "the value is the one before, read again: the sensor had no new one"),
        (UNCONFIRMED, "unconfirmed", "a second reading is awaited before the value is published"),
        (CROSS_CHECK, "cross_check", "a second way to know the angle disagrees with it"),
        (QUARANTINE, "quarantine", "the slot is asked less often because it does not answer"),
        (GRAVITY, "gravity", "the accelerations of a T7 do not add up to 1 g"),
        (
            NOISY,
            "noisy",
            "more than one request in 200 fails: checksums of eight bits are not to be relied upon",
        ),
    ];
}

/// What happened to a slot's requests since reset. All wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotCounters {
    /// Requests, retries included.
    pub requests: u32,
    /// Good answers to the first try.
    pub first_try: u32,
    /// Repetitions.
    pub retries: u16,
    /// Requests without an answer in time.
    pub timeouts: u16,
    /// Answers with a wrong checksum.
    pub checksum: u16,
    /// Answers of a wrong length, address or command.
    pub length: u16,
    /// Good answers that came too late.
    pub late: u16,
    /// Writes to the sensor's non-volatile memory.
    pub writes: u16,
    /// Response time of the last good answer.
    pub response_last: Micros,
    /// The longest of these.
    pub response_max: Micros,
}

/// What a slot reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// Nothing.
    #[default]
    None = 0,
    /// An axis of a T7.
    T7 = 1,
    /// An ISU on its serial line.
    Isu = 2,
    /// An ISU's PWM output.
    Pwm = 3,
}

impl Kind {
    /// The kinds with names and meanings, for the documentation.
    pub const ALL: [(Kind, &str, &str); 4] = [
        (Kind::None, "none", "the slot reads nothing"),
        (Kind::T7, "t7", "an axis of a US Digital T7"),
        (Kind::Isu, "isu", "an STT ISU on its serial line"),
        (Kind::Pwm, "pwm", "the PWM output of an STT ISU"),
    ];

    /// The kind with this code.
    pub fn from_code(code: u16) -> Option<Kind> {
        [Kind::None, Kind::T7, Kind::Isu, Kind::Pwm].into_iter().find(|&kind| kind as u16 == code)
    }
}

//! What can be commanded through the command block.

use clino_gateway::task::Reason;

/// The arm key: without it in the same request, nothing is done that wears a sensor's memory or cannot be undone.
/// "NV" in ASCII.
pub const ARM_KEY: u16 = 0x4E56;

/// Something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u16)]
pub enum Command {
    /// Store the configuration in force in the gateway.
    Save = 1,
    /// What is stored is forgotten: from the next start on, the configuration is as delivered.
    FactoryReset = 2,
    /// All counters of slots and buses become zero.
    ClearCounters = 3,
    /// The slot reads zero as it stands, by its soft zero.
    SoftZero = 4,
    /// Stop what is under way on a bus at its next consistent point.
    Cancel = 5,
    /// Start again.
    Reboot = 6,
    /// The sensor reads zero as it stands.
    SensorZero = 16,
    /// T7 damping, ms.
    SensorDamping = 17,
    /// T7 direction.
    SensorDirection = 18,
    /// T7 offset, millidegrees.
    SensorOffset = 19,
    /// T7 output range.
    SensorRange = 20,
    /// Another address.
    SensorAddress = 21,
    /// Another bit rate of a T7 and its bus.
    SensorBaud = 22,
    /// Position that an ISU's null stands for.
    SensorNull = 23,
    /// Make an ISU's EEPROM checksum right.
    SensorRepair = 24,
}

/// A command for the documentation.
pub struct Description {
    /// The command.
    pub command: Command,
    /// Its name.
    pub name: &'static str,
    /// What the target register is for it.
    pub target: &'static str,
    /// What the value is for it.
    pub value: &'static str,
    /// What it does.
    pub text: &'static str,
}

impl Command {
    /// All commands.
    pub const ALL: [Command; 15] = [
        Command::Save,
        Command::FactoryReset,
        Command::ClearCounters,
        Command::SoftZero,
        Command::Cancel,
        Command::Reboot,
        Command::SensorZero,
        Command::SensorDamping,
        Command::SensorDirection,
        Command::SensorOffset,
        Command::SensorRange,
        Command::SensorAddress,
        Command::SensorBaud,
        Command::SensorNull,
        Command::SensorRepair,
    ];

    /// The command with this code.
    pub fn from_code(code: u16) -> Option<Command> {
        Command::ALL.iter().copied().find(|&command| command as u16 == code)
    }

    /// Whether it is never done without the [`ARM_KEY`].
    pub const fn takes_key(self) -> bool {
        matches!(self, Command::FactoryReset | Command::Reboot) || self as u16 >= Command::SensorZero as u16
    }

    /// For the documentation.
    pub const fn description(self) -> Description {
        let (name, target, value, text) = match self {
            Command::Save => (
                "save",
                "-",
                "-",
                "store the configuration in force in the gateway. If that replaces settings that were not read at this start \
                     (bare mode, or stored by another firmware), only with the key",
            ),
            Command::FactoryReset => {
                ("factory_reset", "-", "-", "forget what is stored: as delivered, from the next start on")
            }
            Command::ClearCounters => {
                ("clear_counters", "-", "-", "all counters of slots and buses become zero")
            }
            Command::SoftZero => (
                "soft_zero",
                "slot",
                "-",
                "the slot reads zero as it stands; nothing is written to the sensor",
            ),
            Command::Cancel => (
                "cancel",
                "bus",
                "-",
                "stop what is under way on a bus at its next consistent point; running until then. *Done*: there \
                     was nothing, or it was begun at the console; otherwise the outcome of what was under way",
            ),
            Command::Reboot => (
                "reboot",
                "-",
                "-",
                "start again, as soon as the answer is out; what is not saved is lost. Busy while a sensor is being set up",
            ),
            Command::SensorZero => (
                "sensor_zero",
                "slot",
                "-",
                "the sensor reads zero as it stands; *zero* of the slots that read it becomes 0. One that moves is refused",
            ),
            Command::SensorDamping => ("sensor_damping", "slot", "ms", "T7: time of the damping filter"),
            Command::SensorDirection => {
                ("sensor_direction", "slot", "0 normal, 1 reversed", "T7: sense of rotation")
            }
            Command::SensorOffset => ("sensor_offset", "slot", "mdeg", "T7: offset of the axis"),
            Command::SensorRange => {
                ("sensor_range", "slot", "0 for −180° to 180°, 1 for 0° to 360°", "T7: output range")
            }
            Command::SensorAddress => (
                "sensor_address",
                "slot",
                "new address",
                "the sensor moves, and the slots that read it follow; *save* keeps that",
            ),
            Command::SensorBaud => (
                "sensor_baud",
                "slot",
                "bit/s",
                "T7: another bit rate of the sensor, and of the bus with it; the other nodes stay at theirs and will \
                     not answer, see *command_silenced*. *Save* keeps the rate of the bus",
            ),
            Command::SensorNull => {
                ("sensor_null", "slot", "code 0 to 65535", "ISU: the position of its null")
            }
            Command::SensorRepair => {
                ("sensor_repair", "slot", "-", "ISU: make the checksum of its EEPROM right")
            }
        };
        Description { command: self, name, target, value, text }
    }
}

/// What has become of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Outcome {
    /// There was none since reset.
    #[default]
    None = 0,
    /// It is under way.
    Running = 1,
    /// It is done.
    Done = 2,
    /// It failed; [`Progress::reason`] tells why.
    Failed = 3,
    /// It was stopped; for a cancel: what was under way was.
    Cancelled = 4,
}

impl Outcome {
    /// The codes with names and meanings, for the documentation.
    pub const ALL: [(Outcome, &str, &str); 5] = [
        (Outcome::None, "none", "there was no command since reset"),
        (Outcome::Running, "running", "it is under way"),
        (Outcome::Done, "done", "it is done"),
        (Outcome::Failed, "failed", "it failed; *command_reason* tells why"),
        (Outcome::Cancelled, "cancelled", "it was stopped; for *cancel*: what was under way was"),
    ];
}

/// The last command that was accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Which one; `None` if there was none since reset.
    pub command: Option<Command>,
    /// What has become of it.
    pub outcome: Outcome,
    /// Counts the accepted commands; wraps.
    pub sequence: u16,
    /// Steps done,
    pub done: u16,
    /// of so many; zero if that is not known.
    pub of: u16,
    /// Other nodes that it leaves at another bit rate than their bus.
    pub silenced: u16,
    /// Why it failed, if it did.
    pub reason: Option<Reason>,
}

//! The commands of both text interfaces, the console and the Modbus port: one list.
//!
//! The console's table of commands, the Modbus codes and the documents read it; a test carries every command out through
//! both doors. Readings and settings are not here: settings have tables of their own.

use crate::features;

/// A command. Its number is the Modbus command code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u16)]
pub enum Command {
    /// Store the configuration in force in the gateway.
    Save = 1,
    /// Discard the stored settings: from the next start on, the configuration is as delivered.
    FactoryReset = 2,
    /// Set all counters of slots and buses to zero.
    ClearCounters = 3,
    /// Set the soft zero so that the slot reads zero in its present position.
    SoftZero = 4,
    /// Stop the task of a bus at its next consistent point.
    Cancel = 5,
    /// Restart the gateway.
    Reboot = 6,
    /// Find all T7s of a bus.
    Scan = 7,
    /// Read identity and settings of a sensor.
    SensorInfo = 8,
    /// Restart an ISU.
    SensorReset = 9,
    /// Acknowledge the alarms of a slot, or of all.
    Acknowledge = 10,
    /// Clear the lowest and the highest angle of a slot, or of all.
    ClearExtremes = 11,
    /// Set the sensor so that it reads zero in its present position.
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
    /// Correct the EEPROM checksum of an ISU.
    SensorRepair = 24,
}

/// Name, usage and help texts of a command.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Its name over Modbus.
    pub name: &'static str,
    /// How it is typed at the console: each of its forms.
    pub typed: &'static [&'static str],
    /// Its target.
    pub target: Target,
    /// Meaning of the value of the Modbus command; empty if it has none.
    pub value: &'static str,
    /// Its effect.
    pub text: &'static str,
    /// Further effects over Modbus; empty if there are none.
    pub modbus: &'static str,
}

/// The target of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The gateway.
    Gateway,
    /// A bus, by its number; at the console the tasks of all buses.
    Bus,
    /// A slot, by its number.
    Slot,
    /// A sensor. Over Modbus by a slot that reads it, at the console by kind and address.
    Sensor,
}

impl Command {
    /// All commands.
    pub const ALL: [Command; 20] = [
        Command::Save,
        Command::FactoryReset,
        Command::ClearCounters,
        Command::SoftZero,
        Command::Cancel,
        Command::Reboot,
        Command::Scan,
        Command::SensorInfo,
        Command::SensorReset,
        Command::Acknowledge,
        Command::ClearExtremes,
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

    /// The command with this code, if this build has it.
    pub fn from_code(code: u16) -> Option<Command> {
        Command::ALL.iter().copied().find(|&command| command as u16 == code && command.is_built())
    }

    /// Whether this build has it.
    pub const fn is_built(self) -> bool {
        match self {
            Command::Save
            | Command::FactoryReset
            | Command::ClearCounters
            | Command::SoftZero
            | Command::Reboot
            | Command::Acknowledge
            | Command::ClearExtremes => true,
            Command::Cancel
            | Command::Scan
            | Command::SensorInfo
            | Command::SensorZero
            | Command::SensorDamping
            | Command::SensorDirection
            | Command::SensorOffset
            | Command::SensorRange
            | Command::SensorAddress
            | Command::SensorBaud => features::COMMISSIONING,
            Command::SensorReset | Command::SensorNull | Command::SensorRepair => {
                features::COMMISSIONING && features::ISU
            }
        }
    }

    /// Whether it needs a confirmation: a person confirms it, a program says `--yes`, a Modbus master gives the
    /// arm key.
    pub const fn is_confirmed(self) -> bool {
        matches!(self, Command::FactoryReset | Command::Reboot) || self as u16 >= Command::SensorZero as u16
    }

    /// Its name, usage and help texts.
    pub const fn description(self) -> Description {
        match self {
            Command::Save => Description {
                name: "save",
                typed: &["save"],
                target: Target::Gateway,
                value: "",
                text: "store all settings so that they survive a reset; needs confirmation if that replaces settings \
                       that this start did not read",
                modbus: "That confirmation is the key: in bare mode, and after another firmware has stored settings",
            },
            Command::FactoryReset => Description {
                name: "factory_reset",
                typed: &["factory-reset"],
                target: Target::Gateway,
                value: "",
                text: "discard the saved settings; takes effect at the next start",
                modbus: "",
            },
            Command::ClearCounters => Description {
                name: "clear_counters",
                typed: &["counters clear"],
                target: Target::Gateway,
                value: "",
                text: "set all counters of slots and buses to zero",
                modbus: "",
            },
            Command::SoftZero => Description {
                name: "soft_zero",
                typed: &["zero SLOT"],
                target: Target::Slot,
                value: "",
                text: "set the soft zero of a slot so that it reads zero in its present position; nothing is written to \
                       the sensor",
                modbus: "",
            },
            Command::Cancel => Description {
                name: "cancel",
                typed: &["cancel"],
                target: Target::Bus,
                value: "",
                text: "stop the tasks of t7 and isu at the next safe point",
                modbus: "*running* until then. *done*: there was no task, or the console had begun it; otherwise the \
                         outcome of the task",
            },
            Command::Reboot => Description {
                name: "reboot",
                typed: &["reboot"],
                target: Target::Gateway,
                value: "",
                text: "restart the gateway",
                modbus: "Unsaved settings are lost. Busy while a sensor is being set up; waits until the answer is out",
            },
            Command::Scan => Description {
                name: "scan",
                typed: &["t7 scan", "t7 scan all"],
                target: Target::Bus,
                value: "0 the bit rate of the bus, 1 every bit rate",
                text: "find the T7s of the T7 bus, at its bit rate or at every one",
                modbus: "The findings are in *scan results*; polling at the bus's own bit rate goes on",
            },
            Command::SensorInfo => Description {
                name: "sensor_info",
                typed: &["t7 info A", "isu info A"],
                target: Target::Sensor,
                value: "",
                text: "read serial number, firmware and settings of a sensor; an ISU has neither serial number nor \
                       firmware to read",
                modbus: "The values are in *result*",
            },
            Command::SensorReset => Description {
                name: "sensor_reset",
                typed: &["isu reset A"],
                target: Target::Sensor,
                value: "",
                text: "ISU: restart the module; no angle for up to 5 s",
                modbus: "",
            },
            Command::Acknowledge => Description {
                name: "acknowledge",
                typed: &["acknowledge SLOT", "acknowledge"],
                target: Target::Slot,
                value: "0 this slot, 1 all slots",
                text: "acknowledge the alarms of a slot, or of all",
                modbus: "",
            },
            Command::ClearExtremes => Description {
                name: "clear_extremes",
                typed: &["extremes clear SLOT", "extremes clear"],
                target: Target::Slot,
                value: "0 this slot, 1 all slots",
                text: "clear the lowest and the highest angle of a slot, or of all",
                modbus: "",
            },
            Command::SensorZero => Description {
                name: "sensor_zero",
                typed: &["t7 zero A", "isu zero A"],
                target: Target::Sensor,
                value: "",
                text: "set the sensor so that it reads zero in its present position; *zero* of the slots that read it \
                       becomes 0. A moving sensor is refused",
                modbus: "",
            },
            Command::SensorDamping => Description {
                name: "sensor_damping",
                typed: &["t7 damping A MS"],
                target: Target::Sensor,
                value: "ms",
                text: "T7: set the time of the damping filter",
                modbus: "",
            },
            Command::SensorDirection => Description {
                name: "sensor_direction",
                typed: &["t7 direction A normal|reversed"],
                target: Target::Sensor,
                value: "0 normal, 1 reversed",
                text: "T7: set the sense of rotation",
                modbus: "",
            },
            Command::SensorOffset => Description {
                name: "sensor_offset",
                typed: &["t7 offset A MDEG"],
                target: Target::Sensor,
                value: "mdeg",
                text: "T7: set the offset of the axis",
                modbus: "",
            },
            Command::SensorRange => Description {
                name: "sensor_range",
                typed: &["t7 range A bidirectional|unidirectional"],
                target: Target::Sensor,
                value: "0 for −180° to 180°, 1 for 0° to 360°",
                text: "T7: set the output range",
                modbus: "",
            },
            Command::SensorAddress => Description {
                name: "sensor_address",
                typed: &["t7 address A NEW", "isu address A NEW"],
                target: Target::Sensor,
                value: "new address",
                text: "change the address of the sensor; the slots that read it follow, *save* keeps their new address",
                modbus: "",
            },
            Command::SensorBaud => Description {
                name: "sensor_baud",
                typed: &["t7 baud A RATE"],
                target: Target::Sensor,
                value: "bit/s",
                text: "T7: change the bit rate of the sensor and of its bus; the other nodes stay at theirs and will not \
                       answer. *save* keeps the bit rate of the bus",
                modbus: "*command_silenced* is their number",
            },
            Command::SensorNull => Description {
                name: "sensor_null",
                typed: &["isu null A POSITION"],
                target: Target::Sensor,
                value: "code 0 to 65535",
                text: "ISU: set the position of its null",
                modbus: "",
            },
            Command::SensorRepair => Description {
                name: "sensor_repair",
                typed: &["isu repair A"],
                target: Target::Sensor,
                value: "",
                text: "ISU: correct the checksum of its EEPROM",
                modbus: "",
            },
        }
    }
}

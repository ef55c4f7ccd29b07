//! What both doors, the console and the Modbus port, can tell the gateway to do: one list.
//!
//! The console's table of commands, the Modbus codes and the documents read it; a test carries every command out through
//! both doors. What is read and how things are set is not here: settings have tables of their own.

/// Something to do. Its number is the Modbus command code.
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
    /// Find all T7s of a bus.
    Scan = 7,
    /// Who a sensor is and how it is set up.
    SensorInfo = 8,
    /// An ISU starts again.
    SensorReset = 9,
    /// The alarms of a slot, or of all, are acknowledged.
    Acknowledge = 10,
    /// The lowest and the highest angle of a slot, or of all, are forgotten.
    ClearExtremes = 11,
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

/// A command for people and programs.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Its name over Modbus.
    pub name: &'static str,
    /// How it is typed at the console: each of its forms.
    pub typed: &'static [&'static str],
    /// What it is about.
    pub target: Target,
    /// What the value of the Modbus command is; empty if it has none.
    pub value: &'static str,
    /// What it does.
    pub text: &'static str,
    /// What is to be said of it over Modbus beside that; empty if there is nothing.
    pub modbus: &'static str,
}

/// What a command is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The gateway.
    Gateway,
    /// A bus, by its number; at the console what is under way on any.
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

    /// The command with this code.
    pub fn from_code(code: u16) -> Option<Command> {
        Command::ALL.iter().copied().find(|&command| command as u16 == code)
    }

    /// Whether it is never done unless it is meant: a person confirms it, a program says `--yes`, a Modbus master gives the
    /// arm key.
    pub const fn is_confirmed(self) -> bool {
        matches!(self, Command::FactoryReset | Command::Reboot) || self as u16 >= Command::SensorZero as u16
    }

    /// What there is to say of it.
    pub const fn description(self) -> Description {
        match self {
            Command::Save => Description {
                name: "save",
                typed: &["save"],
                target: Target::Gateway,
                value: "",
                text: "keep all settings over a reset; to be confirmed if that replaces settings that were not read at \
                       this start",
                modbus: "Then only with the key: in bare mode, and where another firmware has stored",
            },
            Command::FactoryReset => Description {
                name: "factory_reset",
                typed: &["factory-reset"],
                target: Target::Gateway,
                value: "",
                text: "forget what is saved; in force with the next start",
                modbus: "",
            },
            Command::ClearCounters => Description {
                name: "clear_counters",
                typed: &["counters clear"],
                target: Target::Gateway,
                value: "",
                text: "all counters of slots and buses become zero",
                modbus: "",
            },
            Command::SoftZero => Description {
                name: "soft_zero",
                typed: &["zero SLOT"],
                target: Target::Slot,
                value: "",
                text: "the slot reads zero as it stands; nothing is written to the sensor",
                modbus: "",
            },
            Command::Cancel => Description {
                name: "cancel",
                typed: &["cancel"],
                target: Target::Bus,
                value: "",
                text: "stop what t7 and isu have begun, at the next safe point",
                modbus: "Running until then. *Done*: there was nothing, or it was begun at the console; otherwise the \
                         outcome of what was under way",
            },
            Command::Reboot => Description {
                name: "reboot",
                typed: &["reboot"],
                target: Target::Gateway,
                value: "",
                text: "start again",
                modbus: "What is not saved is lost. Busy while a sensor is being set up; it waits until the answer is out",
            },
            Command::Scan => Description {
                name: "scan",
                typed: &["t7 scan", "t7 scan all"],
                target: Target::Bus,
                value: "0 the bit rate of the bus, 1 every bit rate",
                text: "find the T7s of the T7 bus, at its bit rate or at every one",
                modbus: "What is found is in *scan results*; polling at the bus's own bit rate goes on",
            },
            Command::SensorInfo => Description {
                name: "sensor_info",
                typed: &["t7 info A", "isu info A"],
                target: Target::Sensor,
                value: "",
                text: "serial number, firmware and settings of a sensor; an ISU has neither serial number nor \
                       firmware to read",
                modbus: "They are in *result*",
            },
            Command::SensorReset => Description {
                name: "sensor_reset",
                typed: &["isu reset A"],
                target: Target::Sensor,
                value: "",
                text: "ISU: the module starts again; no angle for up to 5 s",
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
                text: "forget the lowest and the highest angle of a slot, or of all",
                modbus: "",
            },
            Command::SensorZero => Description {
                name: "sensor_zero",
                typed: &["t7 zero A", "isu zero A"],
                target: Target::Sensor,
                value: "",
                text: "the sensor reads zero as it stands; *zero* of the slots that read it becomes 0. One that \
                       moves is refused",
                modbus: "",
            },
            Command::SensorDamping => Description {
                name: "sensor_damping",
                typed: &["t7 damping A MS"],
                target: Target::Sensor,
                value: "ms",
                text: "T7: time of the damping filter",
                modbus: "",
            },
            Command::SensorDirection => Description {
                name: "sensor_direction",
                typed: &["t7 direction A normal|reversed"],
                target: Target::Sensor,
                value: "0 normal, 1 reversed",
                text: "T7: sense of rotation",
                modbus: "",
            },
            Command::SensorOffset => Description {
                name: "sensor_offset",
                typed: &["t7 offset A MDEG"],
                target: Target::Sensor,
                value: "mdeg",
                text: "T7: offset of the axis",
                modbus: "",
            },
            Command::SensorRange => Description {
                name: "sensor_range",
                typed: &["t7 range A bidirectional|unidirectional"],
                target: Target::Sensor,
                value: "0 for −180° to 180°, 1 for 0° to 360°",
                text: "T7: output range",
                modbus: "",
            },
            Command::SensorAddress => Description {
                name: "sensor_address",
                typed: &["t7 address A NEW", "isu address A NEW"],
                target: Target::Sensor,
                value: "new address",
                text: "the sensor moves, and the slots that read it follow; *save* keeps that",
                modbus: "",
            },
            Command::SensorBaud => Description {
                name: "sensor_baud",
                typed: &["t7 baud A RATE"],
                target: Target::Sensor,
                value: "bit/s",
                text: "T7: another bit rate of the sensor, and of the bus with it; the other nodes stay at theirs \
                       and will not answer. *Save* keeps the rate of the bus",
                modbus: "How many they are is in *command_silenced*",
            },
            Command::SensorNull => Description {
                name: "sensor_null",
                typed: &["isu null A POSITION"],
                target: Target::Sensor,
                value: "code 0 to 65535",
                text: "ISU: the position of its null",
                modbus: "",
            },
            Command::SensorRepair => Description {
                name: "sensor_repair",
                typed: &["isu repair A"],
                target: Target::Sensor,
                value: "",
                text: "ISU: make the checksum of its EEPROM right",
                modbus: "",
            },
        }
    }
}

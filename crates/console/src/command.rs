//! The command language: commands, their usage, their help texts.

use clino_gateway::command::Command as Shared;

use crate::features::{if_isu, if_modbus, if_pwm};
use crate::split::split_before;

/// The verb of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verb {
    List,
    Read,
    Watch,
    Slot,
    Show,
    Set,
    Zero,
    Bus,
    #[cfg(feature = "commissioning")]
    T7,
    #[cfg(all(feature = "commissioning", feature = "isu"))]
    Isu,
    #[cfg(feature = "commissioning")]
    Cancel,
    Alarms,
    Acknowledge,
    Extremes,
    Counters,
    Trace,
    Load,
    Export,
    #[cfg(feature = "modbus")]
    Modbus,
    Save,
    FactoryReset,
    Reboot,
    ResetCause,
    Version,
    Json,
    Help,
}

/// A command.
pub struct Command {
    pub verb: Verb,
    /// Its name, and what follows it.
    usage: &'static str,
    /// What it does.
    pub help: &'static str,
}

const fn command(verb: Verb, usage: &'static str, help: &'static str) -> Command {
    Command { verb, usage, help }
}

/// A command that the Modbus port has, too: its help text is that of the common list.
const fn shared(verb: Verb, usage: &'static str, command: Shared) -> Command {
    Command { verb, usage, help: command.description().text }
}

/// All commands.
static COMMANDS: &[Command] = &[
    command(Verb::List, "list", "show the last value of every slot in use"),
    command(Verb::Read, "read SLOT", "show the value of a slot with all details"),
    command(Verb::Watch, "watch", "show values as they come, until Enter or Ctrl-C"),
    command(
        Verb::Slot,
        concat!(
            "slot SLOT t7 ADDRESS [-a AXIS] | ",
            if_isu!("SLOT isu ADDRESS | "),
            if_pwm!("SLOT pwm INPUT | "),
            "SLOT off; [-p PERIOD_MS] [-r RETRIES] [-s STALE_MS]"
        ),
        "set the source of a slot; other settings become the defaults of its kind",
    ),
    command(
        Verb::Show,
        concat!("show SLOT|t7|", if_isu!("isu|"), if_modbus!("modbus|"), "console"),
        "show settings",
    ),
    command(
        Verb::Set,
        concat!("set SLOT|t7|", if_isu!("isu|"), if_modbus!("modbus|"), "console SETTING VALUE ..."),
        "change settings, up to five at once",
    ),
    shared(Verb::Zero, "zero SLOT", Shared::SoftZero),
    command(
        Verb::Bus,
        concat!(
            "bus t7",
            if_isu!("|isu"),
            " [-b BAUD] [-g GUARD_US] [--pre US] [--post US] [-e off|expected|detect]"
        ),
        "show or set a bus",
    ),
    #[cfg(feature = "commissioning")]
    command(
        Verb::T7,
        "t7 scan [all] | info A | zero A | offset A MDEG | direction A normal|reversed | damping A MS | \
         range A bidirectional|unidirectional | address A NEW | baud A RATE; [-a AXIS] [--yes]",
        "find and set up T7s",
    ),
    #[cfg(all(feature = "commissioning", feature = "isu"))]
    command(
        Verb::Isu,
        "isu info A | reset A | zero A | null A POSITION | address A NEW | repair A; [--yes]",
        "set up and repair ISUs; reset, null, address and repair restart the module: no angle for up to 5 s",
    ),
    #[cfg(feature = "commissioning")]
    shared(Verb::Cancel, "cancel", Shared::Cancel),
    shared(Verb::Acknowledge, "acknowledge [SLOT]", Shared::Acknowledge),
    command(Verb::Alarms, "alarms", "show alarms that are active or wait for their acknowledgement"),
    command(
        Verb::Extremes,
        "extremes [SLOT] | clear [SLOT]",
        "show or clear the lowest and highest angle of a slot, or of all",
    ),
    command(
        Verb::Counters,
        "counters [SLOT] | clear",
        "show counters since reset; clear sets those of buses and slots to zero",
    ),
    command(Verb::Trace, "trace [N]", "show the last transactions, newest first"),
    command(Verb::Export, "export", "print the commands that make this configuration"),
    command(Verb::Load, "load", "show bus load, poll rates and configuration warnings"),
    #[cfg(feature = "modbus")]
    command(Verb::Modbus, "modbus [SETTING VALUE ...]", "show or set the Modbus port"),
    shared(Verb::Save, "save [--yes]", Shared::Save),
    shared(Verb::FactoryReset, "factory-reset [--yes]", Shared::FactoryReset),
    shared(Verb::Reboot, "reboot [--yes]", Shared::Reboot),
    command(Verb::ResetCause, "reset-cause", "show the cause of the start, and the last crash"),
    command(Verb::Version, "version", "show version, time since reset, mode and clock"),
    command(Verb::Json, "json on|off", "answer programs (JSON lines, no echo) or people"),
    command(Verb::Help, "help [COMMAND]", "list the commands, or show how to use one"),
];

/// The name of a command, by its place in the list.
pub fn name_at(place: usize) -> Option<&'static str> {
    COMMANDS.get(place).map(|command| command.parts().0)
}

impl Command {
    /// Its name, and what follows it, with a blank before it. Each part between two bars is a form of its own.
    pub fn parts(&self) -> (&'static str, &'static str) {
        split_before(self.usage, b' ')
    }

    /// The command of this name.
    #[inline(never)]
    pub fn named(name: &str) -> Option<&'static Command> {
        COMMANDS.iter().find(|command| command.parts().0 == name)
    }

    /// All of them.
    pub fn all() -> impl Iterator<Item = &'static Command> {
        COMMANDS.iter()
    }
}

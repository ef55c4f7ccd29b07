//! What can be typed is in the list of both doors, reads or sets what is a register, or has its reason here.

use std::collections::BTreeSet;

use clino_gateway::command::Command;

use crate::house::House;

/// Reads what is in registers (`fields.rs`), or sets what the tables of settings hold, which both doors read.
const READ_OR_SET: &[&str] = &[
    "list",
    "read SLOT",
    "slot SLOT t7 ADDRESS [-a AXIS]",
    "slot SLOT isu ADDRESS",
    "slot SLOT pwm INPUT",
    "slot SLOT off",
    "show SLOT|t7|isu|modbus|console",
    "set SLOT|t7|isu|modbus|console SETTING VALUE ...",
    "bus t7|isu [-b BAUD] [-g GUARD_US] [--pre US] [--post US] [-e off|expected|detect]",
    "counters",
    "counters SLOT",
    "alarms",
    "extremes",
    "extremes SLOT",
    "modbus",
    "modbus SETTING VALUE ...",
    "reset-cause",
    "version",
];

/// What the console has for itself.
const CONSOLE_ONLY: &[(&str, &str)] = &[
    ("watch", "values as they come: a master reads them as often as it likes"),
    ("trace", "for a person who looks for a fault of the wiring"),
    ("trace N", "for a person who looks for a fault of the wiring"),
    ("export", "settings as lines for another console; a master reads the registers of the settings"),
    ("load", "sentences and sums about settings and counters, which are registers"),
    ("json on|off", "how the console answers"),
    ("help", "of the console"),
    ("help COMMAND", "of the console"),
];

/// Each form of a line of `help`, without options that every form has.
fn forms(line: &str) -> Vec<String> {
    let object: serde_json::Value = serde_json::from_str(line).expect("an object");
    let (name, usage) =
        (object["command"].as_str().expect("a name"), object["usage"].as_str().expect("a text"));
    let usage = usage.split("; ").next().expect("a text");
    let mut forms = Vec::new();
    for form in usage.split(" | ") {
        let form = form.trim_end_matches("[--yes]").trim_end();
        match form.rsplit_once('[') {
            // A word that may be left out, and no option.
            Some((begin, end)) if !end.starts_with('-') && !form.contains("[-") => {
                forms.push(format!("{name} {begin}").trim_end().to_owned());
                forms.push(format!("{name} {begin}{}", end.trim_end_matches(']')));
            }
            _ => forms.push(format!("{name} {form}").trim_end().to_owned()),
        }
    }
    forms
}

#[test]
fn what_can_be_typed_is_in_the_list_or_has_its_reason() {
    let help = House::new().typed("help");
    let typed: BTreeSet<String> = help.iter().flat_map(|line| forms(line)).collect();
    let listed = Command::ALL.into_iter().flat_map(|command| command.description().typed.iter().copied());
    let only = CONSOLE_ONLY.iter().map(|(form, _)| *form);
    let known: BTreeSet<String> =
        listed.chain(READ_OR_SET.iter().copied()).chain(only).map(str::to_owned).collect();
    assert_eq!(typed, known);
}

/// Each has a code and a name of its own, and can be told apart at the console.
#[test]
fn no_two_commands_are_the_same() {
    let codes: BTreeSet<u16> = Command::ALL.iter().map(|&command| command as u16).collect();
    let names: BTreeSet<&str> = Command::ALL.iter().map(|command| command.description().name).collect();
    let typed: Vec<&str> =
        Command::ALL.iter().flat_map(|command| command.description().typed).copied().collect();
    assert_eq!([codes.len(), names.len()], [Command::ALL.len(); 2]);
    assert_eq!(typed.iter().collect::<BTreeSet<_>>().len(), typed.len());
    assert!(Command::ALL.iter().all(|&command| Command::from_code(command as u16) == Some(command)));
}

//! What `help` answers.

use crate::command::{Command, Verb};
use crate::reply::Reply;
use crate::settings;

/// Writes the usage of a command, and the settings that it can change.
#[inline(never)]
pub fn describe(reply: &mut Reply<'_>, command: &Command) {
    usage(reply, command, "{0} {1}\n{2}\n");
    match command.verb {
        Verb::Set => settings::describe(reply, true),
        #[cfg(feature = "modbus")]
        Verb::Modbus => settings::describe(reply, false),
        _ => {}
    }
}

/// Lists all commands.
#[inline(never)]
pub fn describe_all(reply: &mut Reply<'_>) {
    Command::all().for_each(|command| usage(reply, command, "  {0<14} {2}\n"));
}

/// Writes a command: for people as the template says.
#[inline(never)]
fn usage(reply: &mut Reply<'_>, command: &Command, template: &str) {
    let (name, usage) = command.parts();
    let values = [name.into(), usage.trim_ascii_start().into(), command.help.into()];
    if reply.is_for_people() {
        reply.print(template, &values);
    } else {
        let [name, rest @ ..] = values;
        reply.list("command usage help", name, &rest);
    }
}

//! The line editor, and what becomes of a line that is whole.

use core::convert::Infallible;
use core::fmt;

use embedded_cli::cli::{Cli, CliBuilder, CliHandle};
use embedded_cli::command::RawCommand;
use embedded_io::Write;

use crate::command::Names;
use crate::echo::Echo;
use crate::execute::execute;
use crate::host::Host;
use crate::meter::Meter;
use crate::pending::Next;
use crate::reply::{Audience, Reply};

/// Longest line that can be typed or sent.
pub const LONGEST_LINE: usize = 80;
/// Characters of former lines that are kept.
const HISTORY: usize = 256;

/// The editor of a line, with completion of commands and former lines.
pub type Editor<W> = Cli<Echo<W>, Infallible, [u8; LONGEST_LINE], [u8; HISTORY]>;

/// An editor that echoes to a port, or a silent one.
#[inline(never)]
pub fn editor<W: Write<Error = Infallible>>(out: Option<W>) -> Editor<W> {
    let builder = CliBuilder::default()
        .writer(Echo(out))
        .command_buffer([0; LONGEST_LINE])
        .history_buffer([0; HISTORY])
        .prompt("");
    match builder.build() {
        Ok(editor) => editor,
        Err(never) => match never {},
    }
}

/// Takes a character into the line. If it ends it, the answer goes to `out`, or to the editor's own port.
pub fn edit<W: Write<Error = Infallible>>(
    editor: &mut Editor<W>,
    byte: u8,
    audience: Audience,
    host: &mut dyn Host,
    meter: &Meter,
    mut out: Option<&mut dyn fmt::Write>,
) -> Next {
    let mut next = Next::Stay;
    let mut process =
        RawCommand::processor(|cli: &mut CliHandle<'_, Echo<W>, Infallible>, raw: RawCommand<'_>| {
            let out: &mut dyn fmt::Write = match &mut out {
                Some(out) => *out,
                None => cli.writer(),
            };
            execute(&raw, Reply { audience, out }, host, meter, &mut next);
            if next != Next::Stay {
                // No prompt before there is something to be typed.
                cli.set_prompt("");
            }
            Ok(())
        });
    _ = editor.process_byte::<Names, _>(byte, &mut process);
    drop(process);
    next
}

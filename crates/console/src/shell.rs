//! Who is at the console, and what a byte from them does.

use core::convert::Infallible;
use core::fmt;

use clino_bus::Micros;
use clino_commissioning::Progress;
use clino_gateway::Bus;
use clino_gateway::order::Order;
use embedded_cli::cli::{Cli, CliBuilder, CliHandle};
use embedded_cli::command::RawCommand;
use embedded_cli::service::FromRaw as _;
use embedded_io::Write;

use crate::command::Typed;
use crate::echo::Echo;
use crate::error::Error;
use crate::execute::{Failure, execute};
use crate::fields::line;
use crate::host::Host;
use crate::news;
use crate::stream::Stream;
use crate::text::Text;

/// Longest line that can be typed or sent.
const LONGEST_LINE: usize = 80;
/// Characters of former lines that are kept.
const HISTORY: usize = 256;
/// From one line of progress to the next.
const PROGRESS_EVERY: Micros = Micros::from_millis(1_000);
const PROMPT: &str = "clino> ";
/// Ctrl-C.
const INTERRUPT: u8 = 0x03;

/// Who reads the answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// A person at a terminal: echo, prompt, tables.
    People,
    /// A program: JSON lines.
    Programs,
}

/// What a command leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The next command.
    Stay,
    /// Readings as they come.
    Stream,
    /// Another audience.
    Speak(Audience),
    /// A task has begun on this bus.
    Task(Bus),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Readings as they come, for `audience`; then commands of `back`.
    Stream {
        audience: Audience,
        back: Audience,
    },
    Commands(Audience),
    /// A person waits for the end of a task.
    Task {
        bus: Bus,
        shown_at: Micros,
    },
}

impl Mode {
    fn audience(self) -> Audience {
        match self {
            Mode::Stream { audience, .. } | Mode::Commands(audience) => audience,
            Mode::Task { .. } => Audience::People,
        }
    }
}

/// The console. `W` is a handle to the port; its clones write to the same port.
pub struct Shell<W: Write<Error = Infallible> + Clone> {
    people: Editor<W>,
    /// The same editor without echo: what a program sends is a line that nobody corrects.
    programs: Editor<W>,
    /// Characters of the line that a program is sending.
    length: usize,
    /// The character before.
    last: u8,
    out: W,
    mode: Mode,
    stream: Stream,
}

type Editor<W> = Cli<Echo<W>, Infallible, [u8; LONGEST_LINE], [u8; HISTORY]>;

impl<W: Write<Error = Infallible> + Clone> Shell<W> {
    /// A console that streams JSON lines, as it does after power-up: a logger needs to type nothing.
    pub fn new(out: W) -> Shell<W> {
        Shell {
            people: editor(Some(out.clone())),
            programs: editor(None),
            length: 0,
            last: 0,
            out,
            mode: Mode::Stream { audience: Audience::Programs, back: Audience::People },
            stream: Stream::new(),
        }
    }

    /// Takes a character from the other end.
    pub fn input(&mut self, byte: u8, host: &mut impl Host) {
        let last = core::mem::replace(&mut self.last, byte);
        // The commands are ASCII; and the editor takes whatever looks like the length of a UTF-8 sequence for one.
        if !byte.is_ascii() {
            return;
        }
        if (last, byte) == (b'\r', b'\n') {
            return;
        }
        let alone = self.length == 0 && is_end(byte);
        match self.mode {
            Mode::Stream { back, .. } if alone || byte == INTERRUPT => self.speak(back),
            // A program need not stop the stream to say something.
            Mode::Stream { audience: Audience::Programs, .. } | Mode::Commands(Audience::Programs) => {
                self.program(byte, host);
            }
            Mode::Task { bus, .. } if byte == INTERRUPT => _ = host.order(Order::Cancel(bus)),
            Mode::Stream { audience: Audience::People, .. } | Mode::Task { .. } => {}
            Mode::Commands(Audience::People) => self.key(byte, host),
        }
    }

    /// Writes the next line that nobody has to ask for: news of a task, its progress, a line of a stream. To be called
    /// when the port has room for a line.
    pub fn poll(&mut self, host: &mut impl Host) -> bool {
        let mut out = Text(&mut self.out);
        if let Some(news) = host.news() {
            _ = news::write(&mut out, self.mode.audience(), &news);
            if matches!(self.mode, Mode::Task { .. }) && news.is_end() {
                self.speak(Audience::People);
            }
            return true;
        }
        match self.mode {
            Mode::Stream { audience, .. } => self.stream.next(host, audience, &mut out).unwrap_or(false),
            Mode::Task { bus, shown_at } if host.now() >= shown_at + PROGRESS_EVERY => {
                self.mode = Mode::Task { bus, shown_at: host.now() };
                let progress = host.bus(bus).and_then(|state| state.progress);
                if let Some(Progress { done, of }) = progress {
                    let fields = [("done", done.into()), ("of", of.into())];
                    _ = line(&mut out, Audience::People, "under way", &fields);
                }
                progress.is_some()
            }
            _ => false,
        }
    }

    fn key(&mut self, byte: u8, host: &mut impl Host) {
        let next = edit(&mut self.people, byte, Audience::People, host, None);
        self.follow(next, Audience::People);
    }

    fn program(&mut self, byte: u8, host: &mut impl Host) {
        let mut out = Text(&mut self.out);
        self.length = self.length.saturating_add(1);
        let length = if is_end(byte) { core::mem::take(&mut self.length) } else { 0 };
        if length > LONGEST_LINE {
            // The editor drops what does not fit; a command cut short must not be carried out.
            self.programs = editor(None);
            _ = Error::TooLong(LONGEST_LINE).write(&mut out, Audience::Programs);
            return;
        }
        let next = edit(&mut self.programs, byte, Audience::Programs, host, Some(&mut out));
        self.follow(next, Audience::Programs);
    }

    fn follow(&mut self, next: Next, audience: Audience) {
        match next {
            Next::Stay => {}
            Next::Stream => self.mode = Mode::Stream { audience, back: audience },
            Next::Speak(audience) => self.speak(audience),
            // A program is told when it comes, and may do something else meanwhile.
            Next::Task(bus) if audience == Audience::People => {
                self.mode = Mode::Task { bus, shown_at: Micros::ZERO }
            }
            Next::Task(_) => {}
        }
    }

    fn speak(&mut self, audience: Audience) {
        self.mode = Mode::Commands(audience);
        self.length = 0;
        if audience == Audience::People {
            _ = self.out.write_all(b"\r\n");
            _ = self.people.set_prompt(PROMPT);
        }
    }
}

fn is_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

fn editor<W: Write<Error = Infallible>>(out: Option<W>) -> Editor<W> {
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
fn edit<W: Write<Error = Infallible>>(
    editor: &mut Editor<W>,
    byte: u8,
    audience: Audience,
    host: &mut impl Host,
    mut out: Option<&mut dyn fmt::Write>,
) -> Next {
    let mut next = Next::Stay;
    let mut process =
        RawCommand::processor(|cli: &mut CliHandle<'_, Echo<W>, Infallible>, raw: RawCommand<'_>| {
            let out: &mut dyn fmt::Write = match &mut out {
                Some(out) => *out,
                None => cli.writer(),
            };
            match run(raw, audience, host, out) {
                Ok(then) => next = then,
                Err(Failure::Error(error)) => _ = error.write(out, audience),
                Err(Failure::Output) => {}
            }
            Ok(())
        });
    _ = editor.process_byte::<Typed<'_>, _>(byte, &mut process);
    drop(process);
    next
}

fn run<'a>(
    raw: RawCommand<'a>,
    audience: Audience,
    host: &mut impl Host,
    out: &mut dyn fmt::Write,
) -> Result<Next, Failure<'a>> {
    let typed = Typed::parse(raw).map_err(Error::Syntax)?;
    execute(&typed, audience, host, out)
}

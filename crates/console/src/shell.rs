//! Who is at the console, and what a byte from them does.

use core::convert::Infallible;

use clino_bus::Micros;
use clino_commissioning::Progress;
use clino_gateway::Bus;
use clino_gateway::order::Order;
use embedded_io::Write;

use crate::consequences;
use crate::editor::{Editor, LONGEST_LINE, edit, editor};
use crate::error::Error;
use crate::host::Host;
use crate::meter::{BUSES, Meter};
use crate::news;
use crate::pending::{Next, Pending};
use crate::reply::{Audience, Reply};
use crate::stream::Stream;
use crate::system;
use crate::text::Text;
use crate::words::Words as _;

const PROMPT: &str = "clino> ";
/// Ctrl-C.
const INTERRUPT: u8 = 0x03;
/// How long a question waits for its answer.
const PATIENCE: Micros = Micros::from_millis(30_000);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Readings as they come, for `audience`; then commands of `back`.
    Stream {
        audience: Audience,
        back: Audience,
    },
    Commands(Audience),
    /// A person waits for the end of a task.
    Task(Bus),
    /// A person is asked whether this is meant.
    Question {
        pending: Pending,
        until: Micros,
        answer: Answer,
    },
}

/// What was typed so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Nothing,
    Yes,
    SomethingElse,
}

impl Mode {
    fn audience(self) -> Audience {
        match self {
            Mode::Stream { audience, .. } | Mode::Commands(audience) => audience,
            Mode::Task(_) | Mode::Question { .. } => Audience::People,
        }
    }
}

/// The console. `W` is a handle to the port; its clones write to the same port.
pub struct Shell<W: Write<Error = Infallible> + Clone> {
    editor: Editor<W>,
    /// Who types into the editor: what a program sends is a line that nobody corrects, without echo.
    typing: Audience,
    /// Characters of the line that a program is sending.
    length: usize,
    /// The character before.
    last: u8,
    out: W,
    mode: Mode,
    stream: Stream,
    meter: Meter,
}

impl<W: Write<Error = Infallible> + Clone> Shell<W> {
    /// A console that streams JSON lines, as it does after power-up: a logger needs to type nothing.
    #[inline(never)]
    pub fn new(out: W) -> Shell<W> {
        Shell {
            editor: editor(None),
            typing: Audience::Programs,
            length: 0,
            last: 0,
            out,
            mode: Mode::Stream { audience: Audience::Programs, back: Audience::People },
            stream: Stream::new(),
            meter: Meter::new(),
        }
    }

    /// Takes a character from the other end.
    #[inline(never)]
    pub fn input(&mut self, byte: u8, host: &mut dyn Host) {
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
            Mode::Stream { back, .. } if alone || byte == INTERRUPT => {
                if back == Audience::People {
                    _ = self.out.write_all(system::greeting(host.start().mode).as_bytes());
                }
                if byte == INTERRUPT {
                    self.restart_line();
                }
                self.speak(back);
            }
            Mode::Commands(Audience::People) if byte == INTERRUPT => {
                _ = self.out.write_all(b"\r\n");
                self.restart_line();
                self.speak(Audience::People);
            }
            Mode::Commands(Audience::Programs) if byte == INTERRUPT => {
                self.restart_line();
                for bus in BUSES {
                    _ = host.order(Order::Cancel(bus));
                }
            }
            // A program need not stop the stream to say something.
            Mode::Stream { audience: Audience::Programs, .. } | Mode::Commands(Audience::Programs) => {
                self.program(byte, host);
            }
            Mode::Task(bus) if byte == INTERRUPT => _ = host.order(Order::Cancel(bus)),
            Mode::Stream { audience: Audience::People, .. } | Mode::Task(_) => {}
            Mode::Commands(Audience::People) => self.take(byte, host),
            Mode::Question { pending, until, answer } => {
                let ended = is_end(byte) || byte == INTERRUPT || host.now() >= until;
                if ended {
                    let yes = is_end(byte) && answer == Answer::Yes && host.now() < until;
                    return self.answered(yes.then_some(pending), host);
                }
                let first_yes = answer == Answer::Nothing && byte == b'y';
                let answer = if first_yes { Answer::Yes } else { Answer::SomethingElse };
                if byte.is_ascii_graphic() {
                    _ = self.out.write_all(&[byte]);
                }
                self.mode = Mode::Question { pending, until, answer };
            }
        }
    }

    /// Writes the next line that nobody has to ask for: news of a task, its progress, a line of a stream. To be called
    /// when the port has room for a line.
    #[inline(never)]
    pub fn poll(&mut self, host: &mut dyn Host) -> bool {
        if let Some(news) = host.news() {
            let mut reply = Reply { audience: self.mode.audience(), out: &mut Text(&mut self.out) };
            let waits = matches!(self.mode, Mode::Task(_));
            news::write(&mut reply, &news);
            if waits && news.is_end() {
                self.speak(Audience::People);
            }
            return true;
        }
        if self.meter.tick(host) && self.progress(host) {
            return true;
        }
        match self.mode {
            Mode::Stream { audience, .. } => {
                self.stream.next(host, &mut Reply { audience, out: &mut Text(&mut self.out) })
            }
            Mode::Question { until, .. } if host.now() >= until => {
                self.answered(None, host);
                true
            }
            _ => false,
        }
    }

    /// Says how far the tasks are, to whom it concerns. Returns whether there was something to say.
    #[inline(never)]
    fn progress(&mut self, host: &dyn Host) -> bool {
        let audience = self.mode.audience();
        let mut reply = Reply { audience, out: &mut Text(&mut self.out) };
        let mut said = false;
        for bus in BUSES {
            let Some(Progress { done, of }) = host.bus(bus).and_then(|state| state.progress) else {
                continue;
            };
            if audience == Audience::Programs {
                reply.list("progress", bus.name().into(), "done of", &[done.into(), of.into()]);
            } else if self.mode == Mode::Task(bus) {
                reply.line("under way", "done of", &[done.into(), of.into()]);
            } else {
                continue;
            }
            said = true;
        }
        said
    }

    #[inline(never)]
    fn program(&mut self, byte: u8, host: &mut dyn Host) {
        self.length = self.length.saturating_add(1);
        let length = if is_end(byte) { core::mem::take(&mut self.length) } else { 0 };
        if length > LONGEST_LINE {
            // The editor drops what does not fit; a command cut short must not be carried out.
            self.restart_line();
            let mut reply = Reply { audience: Audience::Programs, out: &mut Text(&mut self.out) };
            Error::TooLong(LONGEST_LINE).write(&mut reply);
            return;
        }
        self.take(byte, host);
    }

    /// Takes a character into the line.
    #[inline(never)]
    fn take(&mut self, byte: u8, host: &mut dyn Host) {
        let audience = self.typing;
        // The editor's own port is silent for programs.
        let mut out = self.out.clone();
        let mut out = Text(&mut out);
        let answers = (audience == Audience::Programs).then_some(&mut out as _);
        let next = edit(&mut self.editor, byte, audience, host, &self.meter, answers);
        match next {
            Next::CarryOut(pending) => {
                // Nobody was asked.
                let mut reply = Reply { audience, out: &mut Text(&mut self.out) };
                consequences::warn(&mut reply, pending.consequence());
                self.carry_out(pending, audience, host);
            }
            next => self.follow(next, audience, host.now()),
        }
    }

    #[inline(never)]
    fn follow(&mut self, next: Next, audience: Audience, now: Micros) {
        match next {
            // Carried out before, see `take`; nothing that is carried out leads to another of the kind.
            Next::Stay | Next::CarryOut(_) => {}
            Next::Stream => self.mode = Mode::Stream { audience, back: audience },
            Next::Speak(audience) => self.speak(audience),
            // A program is told when it comes, and may do something else meanwhile.
            Next::Task(bus) if audience == Audience::People => self.mode = Mode::Task(bus),
            Next::Task(_) => {}
            Next::Ask(pending) => {
                pending.ask(&mut Text(&mut self.out));
                self.mode = Mode::Question { pending, until: now + PATIENCE, answer: Answer::Nothing };
            }
        }
    }

    /// A question is answered: this is meant, or not.
    #[inline(never)]
    fn answered(&mut self, meant: Option<Pending>, host: &mut dyn Host) {
        let mut reply = Reply { audience: Audience::People, out: &mut Text(&mut self.out) };
        reply.say("\n");
        match meant {
            Some(pending) => self.carry_out(pending, Audience::People, host),
            None => {
                reply.say("not done\n");
                self.speak(Audience::People);
            }
        }
    }

    #[inline(never)]
    fn carry_out(&mut self, pending: Pending, audience: Audience, host: &mut dyn Host) {
        let mut reply = Reply { audience, out: &mut Text(&mut self.out) };
        match pending.carry_out(host, &mut reply) {
            Next::Stay if audience == Audience::People => self.speak(audience),
            next => self.follow(next, audience, host.now()),
        }
    }

    #[inline(never)]
    fn speak(&mut self, audience: Audience) {
        self.mode = Mode::Commands(audience);
        if self.typing != audience {
            self.typing = audience;
            self.restart_line();
        }
        self.length = 0;
        if audience == Audience::People {
            _ = self.editor.set_prompt(PROMPT);
        }
    }

    /// What was typed of a line is dropped, and former lines with it.
    #[inline(never)]
    fn restart_line(&mut self) {
        self.length = 0;
        self.editor = editor((self.typing == Audience::People).then(|| self.out.clone()));
    }
}

fn is_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

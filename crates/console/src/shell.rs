//! Modes of the console, and what a line does in each.
//!
//! Lines come whole or not at all (`line.rs`), in every mode:
//!
//! | mode | a line | Ctrl-C |
//! |---|---|---|
//! | stream of a program | is carried out; an empty one ends the stream | ends the stream |
//! | stream of a person (`watch`) | ends it, and is not carried out | ends it |
//! | commands | is carried out | drops the line; of a program, stops the tasks |
//! | task | is refused: a person waits for the end of the task | stops the task |
//! | question | `y` alone does it, anything else does not | does not |
//! | settling | is dropped | ends it |
//!
//! *Only characters typed after a question answer it*: when the last character of the question is out, all characters
//! received so far are dropped, and if there were any the answer is no. An answer that is neither `y` nor `n` was not meant as
//! one, but belongs to a text that was pasted: it, and all that comes until the port is silent for [`SILENCE`], is dropped and
//! counted. So a pasted script neither answers the question in its middle nor runs on behind it.

use clino_bus::{Duration, Instant};
use clino_commissioning::TaskProgress;
use clino_gateway::Bus;
use clino_gateway::order::Order;
use clino_gateway::summary::Signals;

use crate::audience::Audience;
use crate::consequences;
use crate::editor::{Editor, Event, Manner};
use crate::error::{self, WORKING};
use crate::execute::execute;
use crate::features::COMMISSIONING;
use crate::host::Host;
use crate::identity;
use crate::line::{Check, Damage, Reason, Verdict};
use crate::meter::Meter;
use crate::news;
use crate::out::Out;
use crate::pending::{Next, Pending};
use crate::presence::Presence;
use crate::received::Received;
use crate::reply::Reply;
use crate::stream::Stream;

/// How long a question waits for its answer.
const PATIENCE: Duration = Duration::from_millis(30_000);
/// A text that is being pasted has no longer pauses: a USB adapter's are 16 ms at most.
const SILENCE: Duration = Duration::from_millis(100);
/// More characters than a port has room for.
const MOST_WAITING: usize = 1_000;

#[derive(Clone, Copy, Debug)]
enum Mode {
    /// Readings as they come, for `audience`; then commands of `back`.
    Stream {
        audience: Audience,
        back: Audience,
    },
    Commands(Audience),
    /// A person waits for the end of a task.
    Task(Bus),
    /// A person is asked for confirmation.
    Question {
        pending: Pending,
        until: Instant,
    },
    /// Characters typed too early are dropped until then, or until some time after the last of them.
    Settling {
        until: Instant,
        dropped: u16,
    },
}

impl Mode {
    fn audience(self) -> Audience {
        match self {
            Mode::Stream { audience, .. } | Mode::Commands(audience) => audience,
            Mode::Task(_) | Mode::Question { .. } | Mode::Settling { .. } => Audience::People,
        }
    }

    fn manner(self) -> Manner {
        match self {
            Mode::Commands(Audience::People) => Manner::PROMPT,
            Mode::Question { .. } => Manner::ANSWER,
            Mode::Stream { audience: Audience::Programs, .. } | Mode::Commands(Audience::Programs) => {
                Manner::PROGRAM
            }
            Mode::Stream { .. } | Mode::Task(_) | Mode::Settling { .. } => Manner::AHEAD,
        }
    }
}

/// Why the stream of readings runs again.
#[derive(Clone, Copy, Debug)]
enum Resumed {
    /// Nothing was typed for long.
    Idle,
    /// The port echoes what it receives.
    Echo,
    /// A person or program asked for it.
    Left,
}

impl Resumed {
    const fn name(self) -> &'static str {
        match self {
            Resumed::Idle => "idle",
            Resumed::Echo => "echo",
            Resumed::Left => "left",
        }
    }
}

/// The console.
pub struct Shell<'o> {
    editor: Editor,
    out: &'o mut dyn Out,
    mode: Mode,
    stream: Stream,
    meter: Meter,
    presence: Presence,
    /// The line check that the lines of a program need: the strongest that one of them has had.
    check: Check,
}

impl<'o> Shell<'o> {
    /// A console that streams JSON lines, as it does after power-up: a logger needs to type nothing. A prompt at which nothing
    /// is typed for the idle time of the settings gives way to the stream.
    #[inline(never)]
    pub fn new(out: &'o mut dyn Out) -> Shell<'o> {
        Shell {
            editor: Editor::new(),
            out,
            mode: Mode::Stream { audience: Audience::Programs, back: Audience::People },
            stream: Stream::new(),
            meter: Meter::new(),
            presence: Presence::new(),
            check: Check::None,
        }
    }

    /// Takes a character from the other end.
    pub fn input(&mut self, received: Received, host: &mut dyn Host) {
        self.take(received, host);
        self.out.flush();
    }

    #[inline(never)]
    fn take(&mut self, received: Received, host: &mut dyn Host) {
        let now = host.now();
        if let Mode::Settling { until, dropped } = self.mode {
            let more = u16::from(received.lost()).saturating_add(1);
            if now < until && !received.is_interrupt() {
                // Noise does not keep a paste going.
                let until = if received.is_flawed() { until } else { now + SILENCE };
                self.mode = Mode::Settling { until, dropped: dropped.saturating_add(more) };
                return;
            }
            self.settle(dropped, host);
        }
        let manner = self.mode.manner();
        let line = &mut self.editor.line;
        let is_begun = line.length() > 0 && !line.is_damaged();
        let idle_ms = host.console().idle_ms();
        if is_begun && manner == Manner::PROGRAM && self.presence.is_gone(now, idle_ms, false) {
            line.spoil(Reason::Left, line.length() as u16);
        }
        if !received.is_flawed() {
            self.presence.is_here(now);
        }
        match self.editor.take(received, manner, self.out) {
            None => {}
            Some(Event::Line) => self.line(host),
            Some(Event::Interrupt) => self.interrupt(host),
            Some(Event::Leave) if manner == Manner::PROMPT => self.resume(Resumed::Left),
            Some(Event::Leave) => {}
            Some(Event::Endless) => self.resume(Resumed::Echo),
        }
    }

    /// Ctrl-C.
    #[inline(never)]
    fn interrupt(&mut self, host: &mut dyn Host) {
        self.check = Check::None;
        match self.mode {
            Mode::Stream { back, .. } => self.end_stream(back, host),
            Mode::Commands(Audience::People) => {
                self.say("\n");
                self.speak(Audience::People, host);
            }
            Mode::Commands(Audience::Programs) => {
                for bus in Bus::ALL {
                    _ = host.order(Order::Cancel(bus));
                }
            }
            Mode::Task(bus) => _ = host.order(Order::Cancel(bus)),
            Mode::Question { .. } => {
                self.say("\n");
                self.not_done(0, host);
            }
            Mode::Settling { .. } => {}
        }
    }

    /// A line is at its end.
    #[inline(never)]
    fn line(&mut self, host: &mut dyn Host) {
        let now = host.now();
        let mode = self.mode;
        if mode.manner().shows {
            self.say("\n");
        }
        let verdict = self.editor.line.judge();
        let length = self.editor.line.length() as u16;
        match (mode, verdict) {
            (_, Verdict::Own) => {
                self.presence.echo(now);
                self.editor.begin();
                match mode {
                    Mode::Commands(Audience::People) => self.resume(Resumed::Echo),
                    Mode::Question { .. } => self.not_done(length, host),
                    _ => {}
                }
            }
            (Mode::Stream { audience: Audience::Programs, back }, Verdict::Empty) => {
                self.editor.begin();
                if !self.presence.is_echoing(now) {
                    self.end_stream(back, host);
                }
            }
            (Mode::Commands(Audience::People), Verdict::Empty) => {
                self.editor.begin();
                if self.presence.is_echoing(now) {
                    self.resume(Resumed::Echo);
                } else {
                    self.speak(Audience::People, host);
                }
            }
            (Mode::Stream { audience: Audience::Programs, .. } | Mode::Commands(_), _) => {
                self.run(mode.audience(), host);
            }
            (Mode::Question { pending, until }, _) => {
                let answer = match verdict {
                    Verdict::Whole("y", Check::None) if now < until => Some(pending),
                    _ => None,
                };
                let is_answer = matches!(verdict, Verdict::Empty | Verdict::Whole("y" | "n" | "N" | "no", _));
                self.editor.begin();
                match answer {
                    Some(pending) => self.carry_out(&pending, Audience::People, host),
                    None => self.not_done(if is_answer { 0 } else { length.max(1) }, host),
                }
            }
            (Mode::Stream { audience: Audience::People, .. } | Mode::Task(_) | Mode::Settling { .. }, _) => {
                match verdict {
                    Verdict::Empty | Verdict::Own => {}
                    Verdict::Damaged(damage) => self.refuse(damage, Audience::People),
                    Verdict::Whole(..) if matches!(mode, Mode::Task(_)) => {
                        self.reply(Audience::People, |reply| reply.refuse(WORKING, &[]));
                    }
                    Verdict::Whole(..) => {
                        self.refuse(Damage { reason: Reason::Early, characters: length }, Audience::People);
                    }
                }
                self.editor.begin();
                if let Mode::Stream { back, .. } = mode {
                    self.end_stream(back, host);
                }
            }
        }
    }

    /// Carries out the line, if it is whole.
    #[inline(never)]
    fn run(&mut self, audience: Audience, host: &mut dyn Host) {
        let mut next = Next::Stay;
        let reply = Reply { audience, out: self.out };
        let required = if audience == Audience::Programs { self.check } else { Check::None };
        let damage = match self.editor.line.judge() {
            Verdict::Whole(text, proven) if proven >= required => {
                if audience == Audience::Programs {
                    self.check = proven;
                }
                execute(text, reply, host, &self.meter, &self.presence, &mut next);
                None
            }
            Verdict::Whole(text, _) => Some(Damage { reason: Reason::Check, characters: text.len() as u16 }),
            Verdict::Damaged(damage) => Some(damage),
            Verdict::Empty | Verdict::Own => None,
        };
        match damage {
            Some(damage) => self.refuse(damage, audience),
            None if audience == Audience::People => self.editor.keep(),
            None => {}
        }
        self.editor.begin();
        match &next {
            Next::CarryOut(pending) => {
                // No question was asked.
                let mut reply = Reply { audience, out: self.out };
                consequences::warn(&mut reply, pending.consequence());
                self.carry_out(pending, audience, host);
            }
            Next::Stay if audience == Audience::People => self.speak(audience, host),
            next => self.follow(next, audience, host),
        }
    }

    /// Says why a line is not carried out.
    #[inline(never)]
    fn refuse(&mut self, damage: Damage, audience: Audience) {
        self.presence.damaged = self.presence.damaged.saturating_add(1);
        self.reply(audience, |reply| error::damaged(reply, damage));
    }

    fn reply(&mut self, audience: Audience, write: impl FnOnce(&mut Reply<'_>)) {
        write(&mut Reply { audience, out: self.out });
    }

    /// Writes the next line that the gateway prints unasked: news of a task, its progress, a line of a stream. Call it when
    /// the port has room for a line.
    pub fn poll(&mut self, host: &mut dyn Host) -> bool {
        let has_written = self.next(host);
        self.out.flush();
        has_written
    }

    #[inline(never)]
    fn next(&mut self, host: &mut dyn Host) -> bool {
        if COMMISSIONING && let Some(news) = host.task_event() {
            self.presence.is_here(host.now());
            let at_prompt = matches!(self.mode, Mode::Commands(Audience::People));
            if at_prompt {
                self.say("\n");
            }
            news::write(&mut Reply { audience: self.mode.audience(), out: self.out }, &news);
            if at_prompt || matches!(self.mode, Mode::Task(_)) && news.is_end() {
                self.speak(Audience::People, host);
            }
            return true;
        }
        if self.meter.tick(host) && self.progress(host) {
            return true;
        }
        match self.mode {
            Mode::Stream { audience, .. } => self.stream.next(host, &mut Reply { audience, out: self.out }),
            Mode::Question { until, .. } if host.now() >= until => {
                let line = &mut self.editor.line;
                if !line.is_untouched() {
                    line.spoil(Reason::Early, line.length() as u16);
                }
                self.presence.is_here(host.now());
                self.say("\n");
                self.not_done(0, host);
                true
            }
            Mode::Settling { until, dropped } if host.now() >= until => {
                self.settle(dropped, host);
                true
            }
            Mode::Commands(Audience::People)
                if self.presence.is_gone(
                    host.now(),
                    host.console().idle_ms(),
                    self.editor.line.length() > 0,
                ) =>
            {
                self.resume(Resumed::Idle);
                true
            }
            _ => false,
        }
    }

    /// Writes the progress of the tasks. Returns whether there was any to write.
    #[inline(never)]
    fn progress(&mut self, host: &dyn Host) -> bool {
        let audience = self.mode.audience();
        let mut reply = Reply { audience, out: self.out };
        let mut said = false;
        for bus in Bus::ALL {
            let Some(TaskProgress { done, of }) = host.bus_work(bus).and_then(|work| work.progress) else {
                continue;
            };
            if audience == Audience::Programs {
                reply.list("progress done of", bus.name().into(), &[done.into(), of.into()]);
            } else if matches!(self.mode, Mode::Task(waited) if waited == bus) {
                reply.print("under way: done {0}, of {1}\n", &[done.into(), of.into()]);
            } else {
                continue;
            }
            said = true;
        }
        said
    }

    #[inline(never)]
    fn follow(&mut self, next: &Next, audience: Audience, host: &mut dyn Host) {
        match *next {
            // Carried out before, see `run`; nothing that is carried out leads to another of the kind.
            Next::Stay | Next::CarryOut(_) => {}
            Next::Stream => {
                self.stream.begin_table();
                self.mode = Mode::Stream { audience, back: audience };
            }
            Next::Speak(audience) => self.speak(audience, host),
            // A program gets the report when it comes, and may send other commands meanwhile.
            Next::Task(bus) if audience == Audience::People => self.mode = Mode::Task(bus),
            Next::Task(_) => {}
            Next::Ask(pending) => self.ask(pending, host),
        }
    }

    /// Asks for confirmation.
    #[inline(never)]
    fn ask(&mut self, pending: Pending, host: &mut dyn Host) {
        self.reply(Audience::People, |reply| pending.ask(reply));
        host.flush();
        let mut early = 0_u16;
        for received in (0..MOST_WAITING).map_while(|_| host.received()) {
            if !self.editor.is_rest_of_end(received) {
                early = early.saturating_add(1).saturating_add(received.lost().into());
            }
        }
        let now = host.now();
        if early > 0 {
            self.say("\n");
            return self.not_done(early, host);
        }
        self.mode = Mode::Question { pending, until: now + PATIENCE };
    }

    /// A question is answered with no. Characters that were no answer are dropped, and what comes with them.
    #[inline(never)]
    fn not_done(&mut self, dropped: u16, host: &dyn Host) {
        self.say("not done\n");
        if dropped > 0 {
            self.mode = Mode::Settling { until: host.now() + SILENCE, dropped };
        } else {
            self.speak(Audience::People, host);
        }
    }

    /// No more characters that were typed too early follow.
    #[inline(never)]
    fn settle(&mut self, dropped: u16, host: &dyn Host) {
        let damage = Damage { reason: Reason::Early, characters: dropped };
        self.refuse(damage, Audience::People);
        self.speak(Audience::People, host);
    }

    #[inline(never)]
    fn carry_out(&mut self, pending: &Pending, audience: Audience, host: &mut dyn Host) {
        let mut reply = Reply { audience, out: self.out };
        match &pending.carry_out(host, &mut reply) {
            Next::Stay if audience == Audience::People => self.speak(audience, host),
            next => self.follow(next, audience, host),
        }
    }

    /// A stream ends, and commands follow.
    #[inline(never)]
    fn end_stream(&mut self, back: Audience, host: &dyn Host) {
        if back == Audience::People {
            self.say(identity::greeting(host.start().mode));
        }
        self.speak(back, host);
    }

    /// The stream of readings runs again, as after power-up.
    #[inline(never)]
    fn resume(&mut self, why: Resumed) {
        let line = &mut self.editor.line;
        if !line.is_untouched() {
            // The rest of it may still come.
            line.spoil(Reason::Left, line.length() as u16);
        }
        self.check = Check::None;
        self.mode = Mode::Stream { audience: Audience::Programs, back: Audience::People };
        let mut reply = Reply { audience: Audience::Programs, out: self.out };
        reply.say("\n");
        let values = [why.name().into(), identity::HOW_TO_GET_A_PROMPT.into()];
        reply.list("stream why prompt", "resumed".into(), &values);
    }

    /// Commands follow. What a person has typed ahead of a line stands at the prompt.
    #[inline(never)]
    fn speak(&mut self, audience: Audience, host: &dyn Host) {
        self.mode = Mode::Commands(audience);
        if audience == Audience::People {
            self.editor.is_unsaved = host.summary().signals.has(Signals::UNSAVED);
            self.editor.draw(self.out);
        }
    }

    #[inline(never)]
    fn say(&mut self, text: &str) {
        Reply { audience: Audience::People, out: self.out }.say(text);
    }
}

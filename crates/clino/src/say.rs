//! What goes out for people or for programs: the console's lines, and lines made like them.
//!
//! Results go to standard output. Notes are for people, on standard error; programs have them as `{"hint":…}` among the
//! results.

use std::fmt::{self, Display, Write as _};
use std::io::{self, IsTerminal as _, Write as _};

use clino_commissioning::TaskProgress;
use clino_console::Audience;
use clino_gateway::task::TaskEvent;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use crate::bad::Bad;
use crate::bus::{Diagnosis, Observer, Stop};

/// How a bar looks: plain ASCII, so that it looks so everywhere.
const LOOK: &str = "[{bar:30}] {pos} of {len}, {eta} left";

/// Where results and notes go.
pub struct Say {
    audience: Audience,
    /// A person watches standard error.
    shows_progress: bool,
    /// Stands there.
    bar: Option<ProgressBar>,
    shown: TaskProgress,
}

impl Say {
    /// To a program, or to a person.
    pub fn new(json: bool) -> Self {
        let audience = if json { Audience::Programs } else { Audience::People };
        let shows_progress = !json && io::stderr().is_terminal();
        Self { audience, shows_progress, bar: None, shown: TaskProgress::default() }
    }

    /// Whether a program reads it.
    pub fn is_for_programs(&self) -> bool {
        self.audience == Audience::Programs
    }

    /// What an operation found, or how it ended, as the console says it.
    ///
    /// # Errors
    /// The output failed.
    pub fn task_event(&mut self, news: impl Into<TaskEvent>) -> io::Result<()> {
        let mut text = String::new();
        clino_console::write_outcome(self.audience, &news.into(), &mut text);
        self.print(&text)
    }

    /// A line as the console's: `what: name value, name value`, or `{"what":…,"name":value,…}`.
    ///
    /// # Errors
    /// The output failed.
    pub fn line(&mut self, what: &str, values: &[(&str, Item)]) -> io::Result<()> {
        let text = match self.audience {
            Audience::People => people(what, values),
            Audience::Programs => program(what, values),
        };
        self.print(&text)
    }

    /// Something that the results do not say: `{"hint":{"kind":…,"why":…}}` for programs, a note for people.
    ///
    /// # Errors
    /// The output failed.
    pub fn hint(&mut self, kind: &str, why: &str) -> io::Result<()> {
        match self.audience {
            Audience::People => self.note(why),
            Audience::Programs => self.hint_object(serde_json::json!({ "kind": kind, "why": why })),
        }
    }

    /// The probable cause of a failure, and what to do next.
    ///
    /// # Errors
    /// The output failed.
    pub fn diagnosis(&mut self, Diagnosis { kind, cause, next }: &Diagnosis) -> io::Result<()> {
        if self.is_for_programs() {
            return self.hint_object(serde_json::json!({ "kind": kind, "why": cause, "next": next }));
        }
        self.note(&format!("probable cause: {cause}"))?;
        for (number, step) in (1..).zip(next) {
            writeln!(io::stderr(), "  {number}. {step}")?;
        }
        Ok(())
    }

    /// A note for people.
    ///
    /// # Errors
    /// The output failed.
    pub fn note(&mut self, text: &str) -> io::Result<()> {
        self.clear()?;
        writeln!(io::stderr(), "note: {text}")
    }

    /// An error for people, and what to do next.
    ///
    /// # Errors
    /// The output failed.
    pub fn error(&mut self, text: &str, next: &str) -> io::Result<()> {
        self.clear()?;
        writeln!(io::stderr(), "error: {text}\n  next: {next}")
    }

    /// An error: an object for programs, words and the next step for people.
    ///
    /// # Errors
    /// The output failed.
    pub fn failure(&mut self, kind: &'static str, text: &str, next: &str) -> io::Result<()> {
        self.failed_object(Bad::new(kind, text).with("next", next), text, next)
    }

    /// As [`Say::failure`], with an object that says more.
    ///
    /// # Errors
    /// The output failed.
    pub fn failed_object(&mut self, object: Bad, text: &str, next: &str) -> io::Result<()> {
        if !self.is_for_programs() {
            return self.error(text, next);
        }
        self.clear()?;
        crate::report::line(&mut io::stdout().lock(), Err::<(), _>(object)).map(|_| ())
    }

    /// Text that ends a line, at once: a program may wait for it.
    ///
    /// # Errors
    /// The output failed.
    pub fn print(&mut self, text: &str) -> io::Result<()> {
        self.clear()?;
        let mut output = io::stdout().lock();
        output.write_all(text.as_bytes())?;
        output.flush()
    }

    /// Asks a person; `false` unless the answer is yes. Ctrl-C is a no.
    ///
    /// # Errors
    /// The input or the output failed.
    pub fn ask(&mut self, question: &str, stop: &Stop) -> io::Result<bool> {
        self.clear()?;
        write!(io::stderr(), "{question}. Go on? y/N ")?;
        io::stderr().flush()?;
        let mut answer = String::new();
        if is_typed(stop)? {
            io::stdin().read_line(&mut answer)?;
        } else {
            // The answer would have ended the line.
            writeln!(io::stderr())?;
        }
        Ok(matches!(answer.trim(), "y" | "Y" | "yes") && !stop.is_asked())
    }

    fn hint_object(&mut self, hint: Value) -> io::Result<()> {
        self.print(&format!("{}\n", serde_json::json!({ "hint": hint })))
    }

    /// A bar on the terminal of a person, for what has more than one part.
    pub fn show_progress(&mut self, progress: TaskProgress) {
        if !self.shows_progress || progress == self.shown || progress.of <= 1 {
            return;
        }
        self.shown = progress;
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(progress.of.into());
            // A template that is wrong would leave the usual look.
            ProgressStyle::with_template(LOOK)
                .map_or(bar.clone(), |style| bar.with_style(style.progress_chars("#-")))
        });
        bar.set_length(progress.of.into());
        bar.set_position(progress.done.into());
    }

    /// The user wants to stop.
    pub fn tell_stopping(&mut self) {
        // What cannot be told changes nothing.
        let _ = self.hint("stopping", "stopping at the next safe point");
    }

    /// The line is for something else.
    #[expect(clippy::unnecessary_wraps, reason = "what follows writes, and can fail")]
    fn clear(&mut self) -> io::Result<()> {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        Ok(())
    }
}

impl<E: Into<TaskEvent>> Observer<E> for Say {
    fn event(&mut self, event: E) -> io::Result<()> {
        self.task_event(event)
    }

    fn progress(&mut self, progress: TaskProgress) {
        self.show_progress(progress);
    }

    fn stopping(&mut self) {
        self.tell_stopping();
    }
}

/// Waits until a line is typed; `false` if the user wants to stop instead. The signal does not end the read itself.
#[cfg(unix)]
fn is_typed(stop: &Stop) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::Errno;

    const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
    let stdin = io::stdin();
    while !stop.is_asked() {
        match poll(&mut [PollFd::new(&stdin, PollFlags::IN)], Some(&LOOK)) {
            Ok(0) | Err(Errno::INTR) => {}
            Ok(_) => return Ok(true),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(false)
}

/// Ctrl-C ends the read on Windows.
#[cfg(not(unix))]
#[expect(clippy::unnecessary_wraps, reason = "on Unix it can fail")]
fn is_typed(stop: &Stop) -> io::Result<bool> {
    Ok(!stop.is_asked())
}

fn people(what: &str, values: &[(&str, Item)]) -> String {
    let mut text = what.to_owned();
    let mut before = ": ";
    for (name, value) in values {
        // Writing to a text does not fail.
        let _ = write!(text, "{before}{name} {value}");
        before = ", ";
    }
    text.push('\n');
    text
}

fn program(what: &str, values: &[(&str, Item)]) -> String {
    let mut text = format!("{{\"what\":\"{what}\"");
    for (name, value) in values {
        let _ = match value {
            Item::Text(word) => write!(text, ",\"{name}\":{}", serde_json::Value::from(word.as_str())),
            Item::Flag(flag) => write!(text, ",\"{name}\":{flag}"),
            Item::None => write!(text, ",\"{name}\":null"),
            value => write!(text, ",\"{name}\":{value}"),
        };
    }
    text.push_str("}\n");
    text
}

/// A value of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// A whole number.
    Number(i64),
    /// A number in units of its last decimal, with as many decimals.
    Decimal(i64, usize),
    /// A word.
    Text(String),
    /// Yes or no.
    Flag(bool),
    /// There is none.
    None,
}

impl Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Decimal(number, decimals) => {
                let (sign, digits) = (if *number < 0 { "-" } else { "" }, number.unsigned_abs().to_string());
                let digits = format!("{digits:0>width$}", width = decimals + 1);
                let (whole, rest) = digits.split_at(digits.len() - decimals);
                write!(f, "{sign}{whole}.{rest}")
            }
            Self::Text(word) => f.write_str(word),
            Self::Flag(flag) => f.write_str(if *flag { "yes" } else { "no" }),
            Self::None => f.write_str("none"),
        }
    }
}

impl<T: Into<i64>> From<T> for Item {
    fn from(number: T) -> Self {
        Self::Number(number.into())
    }
}

/// Thousandths, as angles are written.
pub fn thousandths(number: i32) -> Item {
    Item::Decimal(number.into(), 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_made_like_the_consoles() {
        let values = [("address", Item::from(5)), ("angle_deg", thousandths(-500)), ("serial", Item::None)];
        assert_eq!(people("angle", &values), "angle: address 5, angle_deg -0.500, serial none\n");
        assert_eq!(
            program("angle", &values),
            "{\"what\":\"angle\",\"address\":5,\"angle_deg\":-0.500,\"serial\":null}\n"
        );
    }
}

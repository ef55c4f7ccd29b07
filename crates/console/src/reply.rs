//! Answers as lists of named values: for people lines of words, for programs one JSON object.
//!
//! The names of an answer are one text, a blank between two: a table of names would take twice the flash.

use core::fmt::{Display, Write};

use crate::audience::Audience;
use crate::plain::Plain;
use crate::value::{Label, Value};

/// Columns of the names in a list of values.
const NAME: usize = 18;

/// Where an answer goes. The port never fails, so there is no result.
pub struct Reply<'o> {
    /// For whom.
    pub audience: Audience,
    /// Whole lines, without carriage returns.
    pub out: &'o mut dyn Write,
}

impl Reply<'_> {
    /// Whether a person reads it.
    pub fn is_for_people(&self) -> bool {
        self.audience == Audience::People
    }

    /// Writes this as it is.
    #[inline(never)]
    pub fn say(&mut self, text: &str) {
        _ = self.out.write_str(text);
    }

    /// Writes one answer, a line: `what: name value, name value`, or `{"what":…,"name":value,…}`.
    #[inline(never)]
    pub fn line(&mut self, what: &str, names: &'static str, values: &[Value<'_>]) {
        self.begin(what);
        self.members(names, values);
        self.end();
    }

    /// Begins a line.
    pub fn begin(&mut self, what: &str) {
        _ = if self.is_for_people() {
            self.out.write_str(what)
        } else {
            write!(self.out, "{{\"what\":\"{what}\"")
        };
    }

    /// Ends a line.
    pub fn end(&mut self) {
        self.say(if self.is_for_people() { "\n" } else { "}\n" });
    }

    /// Writes one answer that is about `of`: a list, a value in each line, or `{"what":of,"name":value,…}`.
    #[inline(never)]
    pub fn list(&mut self, what: &str, of: Value<'_>, names: &'static str, values: &[Value<'_>]) {
        self.begin_list(what, of);
        for (name, value) in names.split(' ').zip(values) {
            self.entry(Label::plain(name), *value);
        }
        self.end_list();
    }

    /// Begins an answer that is about `of`, of which the values follow one by one; [`Reply::end_list`] ends it.
    #[inline(never)]
    pub fn begin_list(&mut self, what: &str, of: Value<'_>) {
        if self.is_for_people() {
            _ = writeln!(self.out, "{what} {of}");
        } else {
            _ = write!(self.out, "{{\"{what}\":");
            _ = of.write(self.out, self.audience);
        }
    }

    /// Writes a value of a list.
    #[inline(never)]
    pub fn entry(&mut self, label: Label, value: Value<'_>) {
        if self.is_for_people() {
            let width = NAME.saturating_sub(label.len());
            _ = writeln!(self.out, "  {label}{:width$} {value}", "");
        } else {
            _ = write!(self.out, ",\"{label}\":");
            _ = value.write(self.out, self.audience);
        }
    }

    /// Writes counts of a list.
    #[inline(never)]
    pub fn counts(&mut self, names: &'static str, counts: &[u32]) {
        for (name, count) in names.split(' ').zip(counts) {
            self.entry(Label::plain(name), (*count).into());
        }
    }

    /// Ends a list.
    pub fn end_list(&mut self) {
        if !self.is_for_people() {
            self.end();
        }
    }

    /// Writes the first names and values of a line that has begun.
    pub fn members(&mut self, names: &'static str, values: &[Value<'_>]) {
        self.write(": ", names, values);
    }

    /// Writes further names and values.
    pub fn more(&mut self, names: &'static str, values: &[Value<'_>]) {
        self.write(", ", names, values);
    }

    /// Writes one name and value of a line, with this before it for people.
    #[inline(never)]
    pub fn member(&mut self, before: &str, label: Label, value: Value<'_>) {
        _ = if self.is_for_people() {
            write!(self.out, "{before}{label} ")
        } else {
            write!(self.out, ",\"{label}\":")
        };
        _ = value.write(self.out, self.audience);
    }

    #[inline(never)]
    fn write(&mut self, mut before: &str, names: &'static str, values: &[Value<'_>]) {
        for (name, value) in names.split(' ').zip(values) {
            self.member(before, Label::plain(name), *value);
            before = ", ";
        }
    }

    /// Adds a note to the answer: a sentence for people, `{"hint":{"kind":…,"why":…}}` for programs.
    #[inline(never)]
    pub fn hint(&mut self, kind: &str, why: &dyn Display, names: &'static str, values: &[Value<'_>]) {
        if self.is_for_people() {
            _ = writeln!(self.out, "note: {why}");
            return;
        }
        _ = write!(self.out, "{{\"hint\":{{\"kind\":\"{kind}\",\"why\":\"{}\"", Plain(why));
        self.more(names, values);
        self.say("}}\n");
    }

    /// The order is accepted, and carried out later.
    #[inline(never)]
    pub fn accepted(&mut self) {
        self.say(if self.is_for_people() { "accepted\n" } else { "{\"accepted\":true}\n" });
    }

    /// A setting has been taken.
    #[inline(never)]
    pub fn done(&mut self) {
        self.say(if self.is_for_people() { "done\n" } else { "{\"done\":true}\n" });
    }
}

//! Answers as lists of named values: for people lines of words, for programs one JSON object. What an answer is and the
//! names of its values are one text, a blank between two: a table of names would take twice the flash.

use crate::audience::Audience;
use crate::label::Label;
use crate::out::{Inside, Out};
use crate::split::split_before;
use crate::value::{Value, print, thousandths};

/// Where an answer goes. The port never fails, so there is no result.
pub struct Reply<'o> {
    /// For whom.
    pub audience: Audience,
    /// Whole lines, without carriage returns.
    pub out: &'o mut dyn Out,
}

impl<'o> Reply<'o> {
    /// Whether a person reads it.
    pub fn is_for_people(&self) -> bool {
        self.audience == Audience::People
    }

    /// Writes this as it is.
    #[inline(never)]
    pub fn say(&mut self, text: &str) {
        self.out.put(text.as_bytes());
    }

    /// Writes one of two texts: for people, or for programs.
    #[inline(never)]
    pub fn either(&mut self, people: &str, programs: &str) {
        self.say(if self.is_for_people() { people } else { programs });
    }

    /// Writes a text with values in it.
    #[inline(never)]
    pub fn print(&mut self, template: &str, values: &[Value<'_>]) {
        print(self.out, template, values);
    }

    /// Writes one answer, a line: `what: name value, name value`, or `{"what":…,"name":value,…}`. `row`: what, and the names.
    #[inline(never)]
    pub fn line(&mut self, row: &'static str, values: &[Value<'_>]) {
        let mut line = self.open_line(row);
        values.iter().for_each(|value| line.next(*value));
        line.end();
    }

    /// The same, of which the values follow one by one.
    #[inline(never)]
    pub fn open_line<'r>(&'r mut self, row: &'static str) -> Members<'r, 'o> {
        let (what, names) = split_before(row, b' ');
        self.begin(what);
        Members { reply: self, names, before: Some(": ") }
    }

    /// Begins a line.
    #[inline(never)]
    pub fn begin(&mut self, what: &str) {
        let template = if self.is_for_people() { "{0}" } else { "{1}\"what\":\"{0}\"" };
        self.print(template, &[what.into(), BRACE]);
    }

    /// Ends a line.
    #[inline(never)]
    pub fn end(&mut self) {
        self.either("\n", "}\n");
    }

    /// Writes one answer that is about `of`: a list, a value in each line, or `{"what":of,"name":value,…}`. `row`: what, and
    /// the names.
    #[inline(never)]
    pub fn list(&mut self, row: &'static str, of: Value<'_>, values: &[Value<'_>]) {
        let mut list = self.open_list(row, of);
        values.iter().for_each(|value| list.next(*value));
        list.end();
    }

    /// The same, of which the values follow one by one.
    #[inline(never)]
    pub fn open_list<'r>(&'r mut self, row: &'static str, of: Value<'_>) -> Members<'r, 'o> {
        let (what, names) = split_before(row, b' ');
        self.begin_list(what, of);
        Members { reply: self, names, before: None }
    }

    /// Writes one answer that is about `of` and has only numbers.
    #[inline(never)]
    pub fn numbers(&mut self, row: &'static str, of: Value<'_>, counts: &[u32]) {
        let (what, names) = split_before(row, b' ');
        self.begin_list(what, of);
        self.counts(names, counts);
        self.end_list();
    }

    /// Begins an answer that is about `of`, of which the values follow one by one; [`Reply::end_list`] ends it.
    #[inline(never)]
    pub fn begin_list(&mut self, what: &str, of: Value<'_>) {
        if self.is_for_people() {
            self.print("{0} {1}\n", &[what.into(), of]);
        } else {
            self.print("{1}\"{0}\":", &[what.into(), BRACE]);
            of.write(self.out, self.audience);
        }
    }

    /// Writes a value of a list.
    #[inline(never)]
    pub fn entry(&mut self, label: &Label, value: Value<'_>) {
        if self.is_for_people() {
            self.row(label, value);
        } else {
            self.member("", label, value);
        }
    }

    /// A function of its own, whose stack is not below the members of programs.
    #[inline(never)]
    fn row(&mut self, label: &Label, value: Value<'_>) {
        self.print("  {0<18} {1}\n", &[Value::Label(label), value]);
    }

    /// Writes counts of a list.
    #[inline(never)]
    pub fn counts(&mut self, names: &'static str, counts: &[u32]) {
        let mut list = Members { reply: self, names, before: None };
        counts.iter().for_each(|count| list.count(*count));
    }

    /// Ends a list.
    #[inline(never)]
    pub fn end_list(&mut self) {
        self.either("", "}\n");
    }

    /// The values of a line that has begun, after what it is.
    pub fn rest_of_line<'r>(&'r mut self, names: &'static str) -> Members<'r, 'o> {
        Members { reply: self, names, before: Some(": ") }
    }

    /// Writes further names and values of a line.
    #[inline(never)]
    pub fn more(&mut self, names: &'static str, values: &[Value<'_>]) {
        let mut line = Members { reply: self, names, before: Some(", ") };
        values.iter().for_each(|value| line.next(*value));
    }

    /// Writes one name and value of a line, with this before it for people.
    #[inline(never)]
    pub fn member(&mut self, before: &str, label: &Label, value: Value<'_>) {
        let template = if self.is_for_people() { "{1}{0} " } else { ",\"{0}\":" };
        self.print(template, &[Value::Label(label), before.into()]);
        value.write(self.out, self.audience);
    }

    /// Adds a note to the answer: a sentence for people, `{"hint":{"kind":…,"why":…}}` for programs. `row`: its kind, and
    /// names of values that a program gets, too.
    #[inline(never)]
    pub fn hint(&mut self, row: &'static str, why: &str, values: &[Value<'_>]) {
        if self.is_for_people() {
            self.say("note: ");
            self.print(why, values);
            return self.say("\n");
        }
        let (kind, names) = split_before(row, b' ');
        self.print("{1}\"hint\":{1}\"kind\":\"{0}\"", &[kind.into(), BRACE]);
        self.why(why, values);
        self.more(names, values);
        self.say("}}\n");
    }

    /// Writes an error: a sentence for people, `{"error":{"kind":…,…}}` for programs. `row`: its kind and the names of the
    /// values, then behind a `|` the sentence; if there is none, the kind is it. `why` names the sentence.
    #[inline(never)]
    pub fn refuse(&mut self, row: &'static str, values: &[Value<'_>]) {
        let (names, sentence) = split_before(row, b'|');
        let sentence = sentence.strip_prefix('|').unwrap_or(names);
        if self.is_for_people() {
            self.say(crate::line::ERROR);
            self.print(sentence, values);
            return self.say("\n");
        }
        let (kind, names) = split_before(names, b' ');
        self.print("{1}\"error\":{1}\"kind\":\"{0}\"", &[kind.into(), BRACE]);
        let mut rest = values.iter();
        for name in words(names) {
            if name == "why" {
                self.why(sentence, values);
            } else if let Some(value) = rest.next() {
                self.member("", &Label::plain(name), *value);
            }
        }
        self.say("}}\n");
    }

    /// Writes a sentence as the member `why`.
    #[inline(never)]
    pub fn why(&mut self, sentence: &str, values: &[Value<'_>]) {
        self.say(",\"why\":\"");
        print(&mut Inside { out: self.out, escapes: false }, sentence, values);
        self.say("\"");
    }

    /// The order is accepted, and carried out later.
    #[inline(never)]
    pub fn accepted(&mut self) {
        self.either("accepted\n", "{\"accepted\":true}\n");
    }

    /// A setting has been taken.
    #[inline(never)]
    pub fn done(&mut self) {
        self.either("done\n", "{\"done\":true}\n");
    }
}

/// An answer of which the names are known, and the values follow one by one: a list of all of them would stand on the stack.
pub struct Members<'r, 'o> {
    reply: &'r mut Reply<'o>,
    names: &'static str,
    /// What stands before the next value of a line, for people; `None` in a list.
    before: Option<&'static str>,
}

impl Members<'_, '_> {
    /// Writes the next value. Without a name for it nothing is written.
    #[inline(never)]
    pub fn next(&mut self, value: Value<'_>) {
        let (name, rest) = split_before(self.names.trim_ascii_start(), b' ');
        self.names = rest;
        let label = &Label::plain(name);
        match self.before {
            _ if name.is_empty() => {}
            None => self.reply.entry(label, value),
            Some(before) => {
                self.reply.member(before, label, value);
                self.before = Some(", ");
            }
        }
    }

    /// Writes a number.
    #[inline(never)]
    pub fn count(&mut self, count: u32) {
        self.next(Value::Count(count));
    }

    /// Writes a word, or a few.
    #[inline(never)]
    pub fn text(&mut self, text: &str) {
        self.next(Value::Text(text));
    }

    /// Writes a number, if there is one.
    #[inline(never)]
    pub fn count_of(&mut self, count: Option<u32>) {
        self.next(count.into());
    }

    /// Writes bits, if there are any.
    #[inline(never)]
    pub fn hex_of(&mut self, bits: Option<u32>) {
        self.next(bits.map_or(Value::None, Value::Hex));
    }

    /// Writes a word, if there is one.
    #[inline(never)]
    pub fn text_of(&mut self, text: Option<&str>) {
        self.next(text.into());
    }

    /// Writes a number in thousandths, if there is one.
    #[inline(never)]
    pub fn thousandths_of(&mut self, number: Option<i32>) {
        self.next(number.map(thousandths).into());
    }

    /// Writes yes or no.
    #[inline(never)]
    pub fn flag(&mut self, flag: bool) {
        self.next(Value::Flag(flag));
    }

    /// Ends the answer.
    #[inline(never)]
    pub fn end(self) {
        match self.before {
            None => self.reply.end_list(),
            Some(_) => self.reply.end(),
        }
    }
}

/// An opening brace: in a template it begins a value.
const BRACE: Value<'static> = Value::Text("{");

/// The words of a text.
fn words(text: &'static str) -> impl Iterator<Item = &'static str> {
    let mut rest = text;
    core::iter::from_fn(move || {
        let (word, behind) = split_before(rest.trim_ascii_start(), b' ');
        rest = behind;
        (!word.is_empty()).then_some(word)
    })
}

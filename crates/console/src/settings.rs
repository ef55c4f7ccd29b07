//! Settings, as they are shown and typed. The tables are the gateway's; this file formats their values. A value is shown
//! with its unit, and typed without.

use core::fmt;

use clino_gateway::settings::{self, Form, Given, NO_SLOT, Setting};

use crate::error::Error;
use crate::job::{Job, Outcome, Reported};
use crate::number;
use crate::reply::Reply;
use crate::value::{Label, Value};

/// Most settings that one line can change.
pub const MOST: usize = 5;
/// Most numbers of these: a name has four.
const NUMBERS: usize = MOST.saturating_add(3);

/// The settings that a line names.
#[derive(Default)]
pub struct Change {
    values: [Option<(u8, i64)>; NUMBERS],
}

impl Change {
    /// Names a setting.
    pub fn name(&mut self, id: u8, value: i64) {
        if let Some(place) = self.values.iter_mut().find(|place| place.is_none()) {
            *place = Some((id, value));
        }
    }

    /// The value of a setting, if the line names it.
    pub fn of(&self, id: u8) -> Option<Given> {
        let found = self.values.iter().flatten().find(|(other, _)| *other == id);
        found.map(|&(_, value)| Given::exactly(value))
    }

    /// Whether as many settings are named as can be.
    pub fn is_full(&self) -> bool {
        self.values.iter().flatten().count() >= MOST
    }
}

/// The label of a setting.
pub const fn label<T>(setting: &Setting<T>) -> Label {
    Label { name: setting.definition.name, unit: setting.definition.unit }
}

/// The value of a setting, as it is shown.
pub fn value<T>(setting: &Setting<T>, of: &T) -> Value<'static> {
    shown(&setting.form, (setting.get)(of))
}

fn shown(form: &Form, value: i64) -> Value<'static> {
    match form {
        Form::Flag => Value::Flag(value != 0),
        Form::Choice(words) => usize::try_from(value).ok().and_then(|place| words.get(place)).copied().into(),
        Form::Slot if value == NO_SLOT => Value::None,
        Form::Number { decimals, .. } => Value::Decimal(value, *decimals),
        Form::OneOf(_) | Form::Slot | Form::Characters => Value::Number(value),
    }
}

/// Shows the settings of a table, one by one; texts left out.
pub fn entries<T>(
    reply: &mut Reply<'_>,
    table: &'static [Setting<T>],
    of: &T,
    has: impl Fn(&Setting<T>) -> bool,
) {
    for setting in table.iter().filter(|setting| setting.form != Form::Characters) {
        let value = if has(setting) { value(setting, of) } else { Value::None };
        reply.entry(label(setting), value);
    }
}

/// Describes all settings, or those of the Modbus port.
pub fn describe(reply: &mut Reply<'_>, all: bool) {
    if all {
        table(reply, "slot", &settings::slot::SETTINGS);
        table(reply, "t7", &settings::bus::T7_SETTINGS);
        table(reply, "isu", &settings::bus::ISU_SETTINGS);
    }
    table(reply, "modbus", &settings::port::SETTINGS);
    if all {
        table(reply, "console", &settings::console::SETTINGS);
    }
}

fn table<T>(reply: &mut Reply<'_>, of: &'static str, table: &'static [Setting<T>]) {
    if reply.is_for_people() {
        _ = writeln!(reply.out, "{of}");
    }
    let shown = |setting: &&Setting<T>| setting.form != Form::Characters || setting.name == "name";
    for setting in table.iter().filter(shown) {
        entry(reply, of, label(setting), &setting.form, setting.text);
    }
}

#[inline(never)]
fn entry(reply: &mut Reply<'_>, of: &'static str, label: Label, form: &'static Form, text: &'static str) {
    let values = Values(form, label.unit);
    if reply.is_for_people() {
        _ = writeln!(reply.out, "  {:<11} {values}\n{:14}{text}", label.name, "");
    } else {
        let values = [of.into(), Value::Words(&values), text.into()];
        reply.list("setting", label.name.into(), "of values help", &values);
    }
}

/// Allowed values of a setting.
struct Values(&'static Form, &'static str);

impl fmt::Display for Values {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Values(form, unit) = *self;
        match form {
            Form::Flag => out.write_str("on|off"),
            Form::Slot => out.write_str("SLOT|none"),
            Form::Characters => out.write_str("TEXT"),
            Form::Choice(words) => separated(out, words),
            Form::OneOf(numbers) => separated(out, numbers),
            Form::Number { least, most, decimals } => {
                let [least, most] = [least, most].map(|limit| Value::Decimal(*limit, *decimals));
                let before = if unit.is_empty() { "" } else { " " };
                write!(out, "{least} to {most}{before}{unit}")
            }
        }
    }
}

fn separated<T: fmt::Display>(out: &mut fmt::Formatter<'_>, values: &[T]) -> fmt::Result {
    let mut before = "";
    for value in values {
        write!(out, "{before}{value}")?;
        before = "|";
    }
    Ok(())
}

impl Job<'_, '_> {
    /// A setting that is named is not named again.
    #[inline(never)]
    pub fn once(&mut self, name: &'static str, change: &Change, id: u8) -> Outcome {
        match change.of(id) {
            Some(_) => Err(self.refuse(&Error::Twice(name))),
            None => Ok(()),
        }
    }

    /// The value that a word means for a setting. What the setting does not allow is refused.
    pub fn value<T>(&mut self, setting: &Setting<T>, word: &str) -> Result<i64, Reported> {
        self.typed_value(label(setting), &setting.form, word).and_then(|value| {
            let checked = setting.check(value);
            self.accepted(checked)?;
            Ok(value)
        })
    }

    #[inline(never)]
    fn typed_value(&mut self, what: Label, form: &Form, word: &str) -> Result<i64, Reported> {
        let (least, most) = form.limits();
        // No slot is `none` here.
        let least = if matches!(form, Form::Slot) { 0 } else { least };
        let decimals = form.decimals();
        match form {
            Form::Flag => return self.meaning::<bool>(word).map(i64::from),
            Form::Choice(words) => return self.place(word, words).map(|place| place as i64),
            Form::Slot if word == "none" => return Ok(NO_SLOT),
            Form::OneOf(_) | Form::Number { .. } | Form::Slot | Form::Characters => {}
        }
        match number::parse(word, decimals.into()) {
            Some(value) if matches!(form, Form::OneOf(_)) || (least..=most).contains(&value) => Ok(value),
            value => Err(self.refuse(&Error::Range { what, word, value, least, most, decimals })),
        }
    }

    /// The settings and values that follow, in pairs.
    pub fn change<T>(
        &mut self,
        table: &'static [Setting<T>],
        names: &'static [&'static str],
    ) -> Result<Change, Reported> {
        let mut change = Change::default();
        loop {
            let word = self.word_of("setting", names)?;
            let place = self.place(word, names)?;
            let Some(setting) = table.get(place) else { return Err(Reported) };
            self.once(setting.name, &change, setting.id)?;
            let word = self.word("value")?;
            let value = self.value(setting, word)?;
            change.name(setting.id, value);
            if change.is_full() || !self.typed.has_more() {
                return Ok(change);
            }
        }
    }
}

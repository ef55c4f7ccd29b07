//! Settings, as they are shown and typed. The tables are the gateway's; this file formats their values. A value is shown
//! with its unit, and typed without.

use clino_gateway::config::Name;
use clino_gateway::settings::slot::id;
use clino_gateway::settings::{Definition, Form, Given, NO_SLOT, Shown};

use crate::choice::Choice;
use crate::error::{NAME, TWICE};
use crate::job::{Job, Outcome, Reported};
use crate::number;
use crate::reply::Reply;
use crate::rows::{FILTER, TARGETS, Table, has_name, label, of_target, row_of, rows};
use crate::value::Value;

/// Most settings that one line can change.
pub const MOST: usize = 5;
/// Most numbers of these: a name has four.
const NUMBERS: usize = MOST.saturating_add(3);

/// The settings that a line names.
#[derive(Default)]
pub struct Change {
    /// No setting has the number 0.
    ids: [u8; NUMBERS],
    values: [i64; NUMBERS],
}

impl Change {
    /// Names a setting.
    #[inline(never)]
    pub fn name(&mut self, id: u8, value: i64) {
        if let Some((place, stored)) = self.ids.iter_mut().zip(&mut self.values).find(|(id, _)| **id == 0) {
            (*place, *stored) = (id, value);
        }
    }

    /// The value of a setting, if the line names it.
    #[inline(never)]
    pub fn of(&self, id: u8) -> Option<Given> {
        let found = self.ids.iter().zip(&self.values).find(|(other, _)| **other == id);
        found.map(|(_, &value)| Given::exactly(value))
    }

    /// Whether as many settings are named as can be.
    pub fn is_full(&self) -> bool {
        self.ids.iter().filter(|&&id| id != 0).count() >= MOST
    }
}

/// A value of a setting, as it is shown.
#[inline(never)]
pub fn shown(form: &Form, value: i64) -> Value<'static> {
    match *form {
        Form::Flag => Value::Flag(value != 0),
        Form::Choice(words) => usize::try_from(value).ok().and_then(|place| words.get(place)).copied().into(),
        Form::Slot if value == NO_SLOT => Value::None,
        Form::Number { decimals, .. } => Value::Decimal(value, decimals),
        Form::OneOf(_) | Form::Slot | Form::Characters => Value::Decimal(value, 0),
    }
}

/// Shows the settings of a table, one by one; texts left out.
#[inline(never)]
pub fn entries(reply: &mut Reply<'_>, of: &dyn Shown, has: &dyn Fn(u8) -> bool) {
    for (place, row) in of.definitions().filter(|(_, row)| row.form != Form::Characters) {
        let value = if has(row.id) { shown(&row.form, of.value(place)) } else { Value::None };
        reply.entry(&label(row), value);
    }
}

/// Shows all settings of a table in one line.
#[inline(never)]
pub fn line(reply: &mut Reply<'_>, what: &str, of: &dyn Shown) {
    reply.begin(what);
    let mut before = ": ";
    for (place, row) in of.definitions() {
        reply.member(before, &label(row), shown(&row.form, of.value(place)));
        before = ", ";
    }
    reply.end();
}

/// Describes all settings, or those of the Modbus port.
#[inline(never)]
pub fn describe(reply: &mut Reply<'_>, all: bool) {
    for &of in [&["slot"], TARGETS].into_iter().flatten().filter(|&&of| all || of == "modbus") {
        if reply.is_for_people() {
            reply.print("{0}\n", &[of.into()]);
        }
        for (_, row) in rows(of_target(of)).filter(|(_, row)| has_name(row)) {
            let allowed = Value::Allowed(&row.form, &row.unit);
            if reply.is_for_people() {
                let values = [row.name.into(), allowed, row.text.into(), "".into()];
                reply.print("  {0<11} {1}\n{3<14}{2}\n", &values);
            } else {
                let values = [of.into(), allowed, row.text.into()];
                reply.list("setting of values help", row.name.into(), &values);
            }
        }
    }
}

impl Job<'_, '_> {
    /// A setting that is named is not named again.
    #[inline(never)]
    fn once(&mut self, change: &Change, row: &Definition) -> Outcome {
        match change.of(row.id) {
            Some(_) => Err(self.refuse(TWICE, &[row.name.into()])),
            None => Ok(()),
        }
    }

    /// The value that a word means for a setting. What the setting does not allow is refused.
    #[inline(never)]
    pub fn value(&mut self, row: &Definition, word: &str) -> Result<i64, Reported> {
        let form = &row.form;
        let (least, most) = form.limits();
        // No slot is `none` here.
        let least = if matches!(form, Form::Slot) { 0 } else { least };
        let decimals = form.decimals();
        match *form {
            Form::Flag => return self.meaning::<bool>(word).map(i64::from),
            Form::Choice(words) => return self.place(word, Choice::Words(words)).map(|place| place as i64),
            Form::Slot if word == "none" => return Ok(NO_SLOT),
            Form::OneOf(_) | Form::Number { .. } | Form::Slot | Form::Characters => {}
        }
        match number::parse(word, decimals.into()) {
            Some(value) if matches!(form, Form::OneOf(_)) || (least..=most).contains(&value) => {
                let checked = row.check(value);
                self.accepted(checked)?;
                Ok(value)
            }
            value => Err(self.beyond(&label(row), word, value, (least, most), decimals)),
        }
    }

    /// The settings and values that follow, in pairs. Behind `mean` and `median` stands how many angles they go over.
    #[inline(never)]
    pub fn change(&mut self, table: Table, change: &mut Change) -> Outcome {
        while !change.is_full() {
            let place = self.place_of("setting", Choice::Settings(table))?;
            let row = table(place).ok_or(Reported)?;
            self.once(change, row)?;
            let word = self.word("value")?;
            if row.form == Form::Characters {
                self.name(word, change)?;
            } else {
                let value = self.value(row, word)?;
                change.name(row.id, value);
                if row.name == FILTER && value > 0 {
                    let samples = row_of(table, id::SAMPLES).ok_or(Reported)?;
                    self.once(change, samples)?;
                    let word = self.word(samples.name)?;
                    let value = self.value(samples, word)?;
                    change.name(samples.id, value);
                }
            }
            if !self.typed.has_more() {
                break;
            }
        }
        Ok(())
    }

    /// Takes a name, which the change names in parts.
    #[inline(never)]
    fn name(&mut self, word: &str, change: &mut Change) -> Outcome {
        let Some(name) = Name::new(word) else { return Err(self.refuse(NAME, &[])) };
        for (part, id) in id::NAME.into_iter().enumerate() {
            change.name(id, name.part(part).into());
        }
        Ok(())
    }
}

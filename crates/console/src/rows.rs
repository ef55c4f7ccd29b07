//! The gateway's tables of settings as one type.
//!
//! The gateway has a table of each thing that is set, in a type of its own. What is shown, typed and completed does not
//! depend on what a setting is of: here each table is a function from a place to a row.

use clino_gateway::Bus;
use clino_gateway::settings::{self, Definition, Form, Setting};

use crate::label::Label;

/// The setting whose value has two words.
pub const FILTER: &str = "filter";

/// A row of a table of settings, whatever it is a setting of.
#[derive(Clone, Copy)]
pub struct Row {
    pub id: u8,
    pub name: &'static str,
    pub unit: &'static str,
    pub form: &'static Form,
    pub text: &'static str,
}

/// The row at a place; `None` behind the last.
pub type Table = fn(usize) -> Option<Row>;

/// The value of the setting at a place of a table.
pub type Values<'a> = &'a dyn Fn(usize) -> i64;

impl Row {
    /// Its name and unit.
    pub const fn label(&self) -> Label {
        Label { name: self.name, unit: self.unit }
    }

    /// Whether it is typed: not the rest of a text.
    pub fn has_name(&self) -> bool {
        *self.form != Form::Characters || self.name == "name"
    }
}

fn row<T>(table: &'static [Setting<T>], place: usize) -> Option<Row> {
    let Definition { id, name, unit, form, text, .. } = &table.get(place)?.definition;
    Some(Row { id: *id, name, unit, form, text })
}

/// Settings of a slot.
pub fn of_slot(place: usize) -> Option<Row> {
    row(&settings::slot::SETTINGS, place)
}

fn of_t7(place: usize) -> Option<Row> {
    row(&settings::bus::T7_SETTINGS, place)
}

fn of_isu(place: usize) -> Option<Row> {
    row(&settings::bus::ISU_SETTINGS, place)
}

/// Settings of a bus.
pub const fn of_bus(bus: Bus) -> Table {
    match bus {
        Bus::T7 => of_t7,
        Bus::Isu => of_isu,
    }
}

/// Settings of the Modbus port.
pub fn of_modbus(place: usize) -> Option<Row> {
    row(&settings::port::SETTINGS, place)
}

/// Settings of the console.
pub fn of_console(place: usize) -> Option<Row> {
    row(&settings::console::SETTINGS, place)
}

/// The table of what stands behind `set`, by its name; every other name is that of a slot.
pub fn of_target(target: &str) -> Table {
    match target {
        "t7" => of_t7,
        "isu" => of_isu,
        "modbus" => of_modbus,
        "console" => of_console,
        _ => of_slot,
    }
}

/// The values of a thing's settings.
pub fn values<'a, T>(table: &'static [Setting<T>], of: &'a T) -> impl Fn(usize) -> i64 + 'a {
    move |place| table.get(place).map_or(0, |setting| (setting.get)(of))
}

/// All rows of a table, with their places.
pub fn rows(table: Table) -> impl Iterator<Item = (usize, Row)> {
    (0_usize..).map_while(move |place| Some((place, table(place)?)))
}

/// The row of a setting.
#[inline(never)]
pub fn row_of(table: Table, id: u8) -> Option<Row> {
    rows(table).map(|(_, row)| row).find(|row| row.id == id)
}

//! The gateway's tables of settings, by what is typed: each is a function from a place to a definition.

use clino_gateway::Bus;
use clino_gateway::settings::{self, Definition, Form, Setting};

use crate::label::Label;

/// The setting whose value has two words.
pub const FILTER: &str = "filter";

/// The setting at a place; `None` behind the last.
pub type Table = fn(usize) -> Option<&'static Definition>;

/// The name and unit of a setting.
pub const fn label(of: &Definition) -> Label {
    Label { name: of.name, unit: of.unit }
}

/// Whether a setting is typed: not the rest of a text.
pub fn has_name(of: &Definition) -> bool {
    of.form != Form::Characters || of.name == "name"
}

fn row<T>(table: &'static [Setting<T>], place: usize) -> Option<&'static Definition> {
    table.get(place).map(|setting| &setting.definition)
}

/// Settings of a slot.
pub fn of_slot(place: usize) -> Option<&'static Definition> {
    row(&settings::slot::SETTINGS, place)
}

fn of_t7(place: usize) -> Option<&'static Definition> {
    row(&settings::bus::T7_SETTINGS, place)
}

fn of_isu(place: usize) -> Option<&'static Definition> {
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
pub fn of_modbus(place: usize) -> Option<&'static Definition> {
    row(&settings::port::SETTINGS, place)
}

/// Settings of the console.
pub fn of_console(place: usize) -> Option<&'static Definition> {
    row(&settings::console::SETTINGS, place)
}

/// What stands behind `show` and `set`, beside slots, which have numbers.
pub const TARGETS: &[&str] = &[
    "t7",
    #[cfg(feature = "isu")]
    "isu",
    #[cfg(feature = "modbus")]
    "modbus",
    "console",
];

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

/// All rows of a table, with their places.
pub fn rows(table: Table) -> impl Iterator<Item = (usize, &'static Definition)> {
    (0_usize..).map_while(move |place| Some((place, table(place)?)))
}

/// The row of a setting.
#[inline(never)]
pub fn row_of(table: Table, id: u8) -> Option<&'static Definition> {
    rows(table).map(|(_, row)| row).find(|row| row.id == id)
}

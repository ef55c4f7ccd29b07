//! The register map: the one table from which the server, the documentation and the list for SCADA systems are made.
//!
//! A [`Block`] is repeated `count` times at a stride, one for each slot or bus; in it, an [`Entry`] is a number, or an
//! array of numbers, at an offset. 32-bit numbers take two registers, high word first (ABCD), unless their [`Form`] says
//! otherwise. Registers of a block that no entry names read 0; registers of no block do not exist.
//!
//! The table is in `map/table.rs`. Names and texts stay out of the image: what the server looks things up in is made of
//! the table by the compiler (`map/lookup.rs`).

mod items;
pub(crate) mod lookup;
mod table;

use clino_gateway::settings::{self, Setting};

pub use items::{
    BusItem, CommandItem, DetailItem, FoundItem, GatewayItem, Item, ReadingItem, ResultItem, StartItem,
};
use table::MILLI;
pub use table::{BLOCKS, FOUND, MAGIC, SLOT_BASE, SLOT_STRIDE, SLOTS, TEST_ANGLE, TEST_NUMBER, VERSION};

/// Registers at equal distances.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Its name in the documentation.
    pub name: &'static str,
    /// What comes before the number of the instance in names, if there are several.
    pub prefix: &'static str,
    /// Address of the first instance, as on the wire: the first register of all is 0.
    pub base: u16,
    /// From one instance to the next, and length of each.
    pub stride: u16,
    /// Number of instances.
    pub count: u16,
    /// Numbers of each instance, by offset.
    pub entries: &'static [Entry],
    /// Its purpose.
    pub text: &'static str,
}

/// A number, or an array of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// From the beginning of the block, registers.
    pub offset: u16,
    /// Its format.
    pub form: Form,
    /// Its content.
    pub item: Item,
    /// Length of the array.
    pub count: u8,
    /// Number of the first of them.
    pub first: u8,
    /// Of a setting: how much one of it is, in the unit of the gateway's table.
    pub scale: u16,
    /// Smallest and largest value that can be written; `None` if it cannot be written.
    pub limits: Option<(i32, i32)>,
    /// What stands before its name in the list, where another number has the same.
    pub prefix: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// Names of its values, if they are codes.
    pub words: &'static [&'static str],
    /// Its description.
    pub text: &'static str,
}

/// Format of a number. In brackets the value for "unavailable".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// 16 bits (0xFFFF).
    U16,
    /// 16 bits, two's complement (0x8000).
    I16,
    /// 32 bits (0xFFFFFFFF).
    U32,
    /// 32 bits, two's complement (0x80000000).
    I32,
    /// IEEE 754 binary32 (NaN, 0x7FC00000).
    F32,
    /// [`Form::I32`], low word first (CDAB).
    I32Swapped,
    /// [`Form::F32`], low word first (CDAB).
    F32Swapped,
}

impl Form {
    /// Registers that it takes.
    pub const fn registers(self) -> u16 {
        match self {
            Form::U16 | Form::I16 => 1,
            Form::U32 | Form::I32 | Form::F32 | Form::I32Swapped | Form::F32Swapped => 2,
        }
    }

    /// The value for "unavailable".
    pub const fn sentinel(self) -> u32 {
        match self {
            Form::U16 => 0xFFFF,
            Form::I16 => 0x8000,
            Form::U32 => 0xFFFF_FFFF,
            Form::I32 | Form::I32Swapped => 0x8000_0000,
            Form::F32 | Form::F32Swapped => crate::number::NAN,
        }
    }

    /// Whether the low word comes first.
    pub const fn is_swapped(self) -> bool {
        matches!(self, Form::I32Swapped | Form::F32Swapped)
    }
}

impl Entry {
    const fn new(
        offset: u16,
        form: Form,
        item: Item,
        name: &'static str,
        unit: &'static str,
        text: &'static str,
    ) -> Entry {
        Entry {
            offset,
            form,
            item,
            count: 1,
            first: 0,
            scale: 1,
            limits: None,
            prefix: "",
            name,
            unit,
            words: &[],
            text,
        }
    }

    /// The setting with this id, in steps of `scale`: name, unit, limits and text are those of its table.
    #[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
    const fn of_table<T, const N: usize>(
        offset: u16,
        form: Form,
        item: Item,
        id: u8,
        table: &'static [Setting<T>; N],
        scale: u16,
    ) -> Entry {
        let mut at = 0;
        while table[at].definition.id != id {
            at += 1;
        }
        let setting = &table[at].definition;
        let (least, most) = setting.form.limits();
        let step = scale as i64;
        let (least, most) = ((least + step - 1).div_euclid(step), most.div_euclid(step));
        let words = if let settings::Form::Choice(words) = setting.form { words } else { &[] };
        let entry = Entry::new(offset, form, item, setting.name, setting.unit, setting.text);
        Entry { words, scale, ..entry.writable(least as i32, most as i32) }
    }

    /// In this unit.
    const fn unit(self, unit: &'static str) -> Entry {
        Entry { unit, ..self }
    }

    /// Its values are codes with these names.
    const fn words(self, words: &'static [&'static str]) -> Entry {
        Entry { words, ..self }
    }

    /// With `set_` before its name: another number of the same block type has that name.
    const fn set(self) -> Entry {
        Entry { prefix: "set_", ..self }
    }

    /// `count` of them, counted from `first`.
    const fn times(self, first: u8, count: u8) -> Entry {
        Entry { first, count, ..self }
    }

    /// It can be written.
    const fn writable(self, least: i32, most: i32) -> Entry {
        Entry { limits: Some((least, most)), ..self }
    }

    /// Whether it may be unavailable; it then reads its form's [sentinel](Form::sentinel).
    pub const fn is_optional(&self) -> bool {
        match self.item {
            Item::Reading(item) => !matches!(item, ReadingItem::Status),
            Item::Gateway(item) => matches!(item, GatewayItem::OldestAge),
            Item::Detail(item) => item.is_optional(),
            Item::Result(item) => {
                !matches!(item, ResultItem::Sequence | ResultItem::Scan | ResultItem::Found)
            }
            Item::Found(item) => !matches!(item, FoundItem::Scan | FoundItem::What),
            Item::Start(item) => !matches!(
                item,
                StartItem::Cause
                    | StartItem::Mode
                    | StartItem::Clock
                    | StartItem::PowerUps
                    | StartItem::Boots
                    | StartItem::Crashes
                    | StartItem::File
                    | StartItem::Uid
            ),
            _ => false,
        }
    }

    /// Registers that it takes.
    pub const fn registers(&self) -> u16 {
        self.form.registers().saturating_mul(self.count as u16)
    }
}

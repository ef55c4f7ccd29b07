//! The table without its words, and how a register is found in it.

use clino_gateway::Bus;

use super::{BLOCKS, Block, Entry, Form, Item};

/// An [`Entry`] without its words.
#[derive(Clone, Copy)]
struct Row {
    offset: u16,
    count: u8,
    first: u8,
    form: Form,
    item: Item,
    scale: u16,
    /// Which of [`LIMITS`] tells what can be written.
    limits: u8,
}

/// Where a block is, and which rows are its own.
struct Place {
    base: u16,
    stride: u16,
    count: u16,
    from: u8,
    to: u8,
}

/// A register of the map.
pub enum Register {
    /// It reads 0.
    Unused,
    /// It is a part of this.
    Of(Number),
}

/// A number of the map.
#[derive(Clone, Copy)]
pub struct Number {
    /// What it is.
    pub item: Item,
    /// How it is told.
    pub form: Form,
    /// How much one of it is, in the setting's own unit.
    pub scale: u16,
    /// Which one: of the instances of its block, or of its array.
    pub index: usize,
    /// Which of its registers was looked for; the first is 0.
    pub word: u16,
    /// How many of its array come after it.
    more: u16,
    /// Which of [`LIMITS`] tells what can be written.
    limits: u8,
}

impl Number {
    /// The next one of its array, in the next registers.
    pub fn next(&self) -> Option<Number> {
        let more = self.more.checked_sub(1)?;
        Some(Number { index: self.index.wrapping_add(1), word: 0, more, ..*self })
    }

    /// The bus that it is about, if it is about one.
    pub fn bus(&self) -> Bus {
        if self.index == 0 { Bus::T7 } else { Bus::Isu }
    }

    /// Smallest and largest value that can be written; `None` if it cannot be written.
    pub fn limits(&self) -> Option<(i32, i32)> {
        LIMITS.get(usize::from(self.limits)).copied()
    }
}

/// Finds a register; `None` if it does not exist.
pub fn find(address: u16) -> Option<Register> {
    let place = PLACES.iter().rev().find(|place| place.base <= address)?;
    let distance = address.wrapping_sub(place.base);
    let instance = distance.checked_div(place.stride)?;
    if instance >= place.count {
        return None;
    }
    let offset = distance.wrapping_sub(instance.wrapping_mul(place.stride));
    let rows = ROWS.get(usize::from(place.from)..usize::from(place.to))?;
    let before = rows.partition_point(|row| row.offset <= offset);
    let Some(row) = before.checked_sub(1).and_then(|last| rows.get(last)) else {
        return Some(Register::Unused);
    };
    let within = offset.wrapping_sub(row.offset);
    let wide = row.form.registers() == 2;
    let (element, word) = if wide { (within >> 1, within & 1) } else { (within, 0) };
    let Some(more) = u16::from(row.count).checked_sub(element).and_then(|rest| rest.checked_sub(1)) else {
        return Some(Register::Unused);
    };
    // A number is one of its block's instances, or one of its array: never both.
    let index = usize::from(instance).wrapping_add(usize::from(element)).wrapping_add(usize::from(row.first));
    Some(Register::Of(Number {
        item: row.item,
        form: row.form,
        scale: row.scale,
        index,
        word,
        more,
        limits: row.limits,
    }))
}

/// In place of the number of its limits: it cannot be written.
const NOT_WRITABLE: u8 = u8::MAX;

static PLACES: [Place; BLOCKS.len()] = TABLE.places;
static ROWS: [Row; TOTAL.rows as usize] = TABLE.rows;
static LIMITS: [(i32, i32); TOTAL.limits as usize] = TABLE.limits;

/// How many rows and limits the table has.
#[derive(Clone, Copy)]
struct Count {
    rows: u8,
    limits: u8,
}

struct Table {
    places: [Place; BLOCKS.len()],
    rows: [Row; TOTAL.rows as usize],
    limits: [(i32, i32); TOTAL.limits as usize],
}

const TOTAL: Count = count();
const TABLE: Table = table();

#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
const fn count() -> Count {
    let mut count = Count { rows: 0, limits: 0 };
    let mut block = 0;
    while block < BLOCKS.len() {
        let entries = BLOCKS[block].entries;
        let mut entry = 0;
        while entry < entries.len() {
            count.rows += 1;
            count.limits += entries[entry].limits.is_some() as u8;
            entry += 1;
        }
        block += 1;
    }
    count
}

#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
const fn table() -> Table {
    let mut places = [const { Place { base: 0, stride: 1, count: 0, from: 0, to: 0 } }; BLOCKS.len()];
    let mut rows = [Row::of(&BLOCKS[0].entries[0], 0); TOTAL.rows as usize];
    let mut limits = [(0, 0); TOTAL.limits as usize];
    let mut next = Count { rows: 0, limits: 0 };
    let mut block = 0;
    while block < BLOCKS.len() {
        let Block { base, stride, count, entries, .. } = BLOCKS[block];
        let from = next.rows;
        let mut entry = 0;
        while entry < entries.len() {
            rows[next.rows as usize] = Row::of(&entries[entry], next.limits);
            if let Some(pair) = entries[entry].limits {
                limits[next.limits as usize] = pair;
                next.limits += 1;
            }
            next.rows += 1;
            entry += 1;
        }
        places[block] = Place { base, stride, count, from, to: next.rows };
        block += 1;
    }
    Table { places, rows, limits }
}

impl Row {
    const fn of(entry: &Entry, limits: u8) -> Row {
        let Entry { offset, count, first, form, item, scale, .. } = *entry;
        let limits = if entry.limits.is_some() { limits } else { NOT_WRITABLE };
        Row { offset, count, first, form, item, scale, limits }
    }
}

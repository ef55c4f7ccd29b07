//! The table without its words, and how a register is found in it.

use clino_gateway::Bus;

use super::{BLOCKS, Block, Entry, Form, Item, MILLI};

/// An [`Entry`] without its words.
#[derive(Clone, Copy)]
struct Row {
    offset: u8,
    count: u8,
    first: u8,
    form: Form,
    item: Item,
    /// Which of [`LIMITS`] tells what can be written; [`IS_MILLI`] with it.
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
    /// Its content.
    pub item: Item,
    /// Its format.
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
    let before = rows.partition_point(|row| u16::from(row.offset) <= offset);
    let Some(row) = before.checked_sub(1).and_then(|last| rows.get(last)) else {
        return Some(Register::Unused);
    };
    let within = offset.wrapping_sub(row.offset.into());
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
        scale: if row.limits & IS_MILLI != 0 { MILLI } else { 1 },
        index,
        word,
        more,
        limits: row.limits & NOT_WRITABLE,
    }))
}

/// In place of the number of its limits: it cannot be written.
const NOT_WRITABLE: u8 = 0x7F;
/// One of it is a thousand of the setting's own unit.
const IS_MILLI: u8 = 0x80;

static PLACES: [Place; BLOCKS.len()] = TABLE.places;
static ROWS: [Row; TOTAL.rows as usize] = TABLE.rows;
static LIMITS: [(i32, i32); TABLE.used] = used(&TABLE.limits);

/// How many rows and limits the table has.
#[derive(Clone, Copy)]
struct Count {
    rows: u8,
    limits: u8,
}

struct Table {
    places: [Place; BLOCKS.len()],
    rows: [Row; TOTAL.rows as usize],
    /// Each pair once, in the first places.
    limits: [(i32, i32); TOTAL.limits as usize],
    used: usize,
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
    let (mut next, mut used) = (0, 0);
    let mut block = 0;
    while block < BLOCKS.len() {
        let Block { base, stride, count, entries, .. } = BLOCKS[block];
        let from = next;
        let mut entry = 0;
        while entry < entries.len() {
            let mut place = 0;
            if let Some((least, most)) = entries[entry].limits {
                while place < used && (limits[place].0 != least || limits[place].1 != most) {
                    place += 1;
                }
                limits[place] = (least, most);
                used += (place == used) as usize;
            }
            rows[next as usize] = Row::of(&entries[entry], place as u8);
            next += 1;
            entry += 1;
        }
        places[block] = Place { base, stride, count, from, to: next };
        block += 1;
    }
    Table { places, rows, limits, used }
}

/// The first places.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
const fn used<const N: usize>(all: &[(i32, i32)]) -> [(i32, i32); N] {
    let mut used = [(0, 0); N];
    let mut place = 0;
    while place < N {
        used[place] = all[place];
        place += 1;
    }
    used
}

impl Row {
    const fn of(entry: &Entry, limits: u8) -> Row {
        let Entry { offset, count, first, form, item, scale, .. } = *entry;
        let limits = if entry.limits.is_some() { limits } else { NOT_WRITABLE };
        assert!(offset <= u8::MAX as u16 && (scale == 1 || scale == MILLI), "no row for it");
        let limits = if scale == MILLI { limits | IS_MILLI } else { limits };
        Row { offset: offset as u8, count, first, form, item, limits }
    }
}

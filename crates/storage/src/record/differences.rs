//! How settings are written: which ones differ from the defaults, and their values.
//!
//! ```text
//! ┌──────────────┬──────────────────────────────────────┐
//! │ differences  │ value, value …                       │
//! │ LEB128       │ LEB128, in the order of their ids    │
//! └──────────────┴──────────────────────────────────────┘
//! ```
//!
//! Bit n of the differences is the setting with id n + 1 ([`clino_gateway::settings`]). A setting with two values has no
//! value here: it has the other one. Values of settings that may be negative are zigzag.

use clino_gateway::settings::{Definition, Form, Settable, Setting, Shown};

use super::Reject;
use super::bytes::{LONGEST_WIDE, Reader, Writer};

/// Highest id, and bits of the differences.
const MOST: u8 = u64::BITS as u8;

/// Whether a setting is written by its difference alone.
const fn is_switch(form: &Form) -> bool {
    matches!(form, Form::Flag) || matches!(form, Form::Choice(words) if words.len() == 2)
}

const fn is_signed(form: &Form) -> bool {
    form.limits().0 < 0
}

/// Bytes of the longest value of a setting.
const fn longest_value(form: &Form) -> usize {
    let (least, most) = form.limits();
    let value = if is_signed(form) {
        let magnitude = if least.unsigned_abs() > most.unsigned_abs() { least } else { most };
        zigzag(magnitude)
    } else {
        most as u64
    };
    let bits = u64::BITS.saturating_sub(value.leading_zeros());
    if bits == 0 { 1 } else { bits.div_ceil(7) as usize }
}

/// Bytes of the longest that is written of a table.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
pub(crate) const fn longest<T>(table: &[Setting<T>]) -> usize {
    let (mut values, mut highest, mut at) = (0, 0, 0);
    while at < table.len() {
        let Definition { id, form, .. } = &table[at].definition;
        assert!(*id >= 1 && *id <= MOST, "an id has a bit");
        if !is_switch(form) {
            values += longest_value(form);
        }
        highest = if *id > highest { *id } else { highest };
        at += 1;
    }
    let mask = (highest as usize).div_ceil(7);
    assert!(mask <= LONGEST_WIDE);
    values + mask
}

const fn zigzag(value: i64) -> u64 {
    (value.wrapping_shl(1) ^ (value >> 63)) as u64
}

const fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ ((value & 1) as i64).wrapping_neg()
}

/// The settings in a set of differences, in the order of their ids.
fn ids(differences: u64) -> impl Iterator<Item = u8> {
    (1..=MOST).filter(move |&id| differences & bit(id) != 0)
}

/// The bit of a setting; its id is at least 1.
const fn bit(id: u8) -> u64 {
    1_u64.wrapping_shl((id as u32).wrapping_sub(1))
}

/// Writes what differs; `differs` says so by place and id. Only what differs is looked for by its id: all lines are silent
/// meanwhile.
pub(crate) fn encode(of: &dyn Shown, differs: &dyn Fn(usize, u8) -> bool, writer: &mut Writer<'_>) {
    let different = of.definitions().filter(|(place, definition)| differs(*place, definition.id));
    let differences = different.fold(0, |differences, (_, definition)| differences | bit(definition.id));
    writer.wide(differences);
    for (place, definition) in ids(differences).filter_map(|id| of.find(id)) {
        if !is_switch(&definition.form) {
            let value = of.value(place);
            writer.wide(if is_signed(&definition.form) { zigzag(value) } else { value as u64 });
        }
    }
}

/// Reads what differs into the usual. Nothing is believed: each value is checked.
pub(crate) fn decode(of: &mut dyn Settable, reader: &mut Reader<'_>) -> Option<()> {
    for id in ids(reader.wide("differences")?) {
        let shown: &dyn Shown = of;
        let Some((place, definition)) = shown.find(id) else {
            return reader.refuse(Reject::Number { what: "differences" });
        };
        let value = match is_switch(&definition.form) {
            true => i64::from(of.value(place) == 0),
            false => {
                let value = reader.wide(definition.name)?;
                if is_signed(&definition.form) {
                    unzigzag(value)
                } else {
                    i64::try_from(value).unwrap_or(i64::MAX)
                }
            }
        };
        reader.accepted(definition.check(value))?;
        of.set(place, value);
    }
    Some(())
}

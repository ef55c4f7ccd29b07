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

use clino_gateway::settings::{Form, Setting};

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
        let Setting { id, form, .. } = &table[at];
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

fn by_id<T>(table: &[Setting<T>]) -> impl Iterator<Item = (u64, &Setting<T>)> {
    (0..MOST).filter_map(|bit| {
        let setting = table.iter().find(|setting| setting.id == bit.wrapping_add(1))?;
        Some((1 << bit, setting))
    })
}

/// Writes what differs.
pub(crate) fn encode<T>(
    table: &[Setting<T>],
    of: &T,
    differs: impl Fn(&Setting<T>) -> bool,
    writer: &mut Writer<'_>,
) {
    let different = || by_id(table).filter(|(_, setting)| differs(setting));
    writer.wide(different().fold(0, |mask, (bit, _)| mask | bit));
    for (_, setting) in different().filter(|(_, setting)| !is_switch(&setting.form)) {
        let value = (setting.get)(of);
        writer.wide(if is_signed(&setting.form) { zigzag(value) } else { value as u64 });
    }
}

/// Reads what differs into the usual. Nothing is believed: each value is checked.
pub(crate) fn decode<T>(table: &[Setting<T>], of: &mut T, reader: &mut Reader<'_>) -> Result<(), Reject> {
    let mask = reader.wide("differences")?;
    let known = by_id(table).fold(0, |known, (bit, _)| known | bit);
    if mask & !known != 0 {
        return Err(Reject::Number { what: "differences" });
    }
    for (_, setting) in by_id(table).filter(|(bit, _)| mask & bit != 0) {
        let value = match is_switch(&setting.form) {
            true => i64::from((setting.get)(of) == 0),
            false => {
                let value = reader.wide(setting.name)?;
                if is_signed(&setting.form) {
                    unzigzag(value)
                } else {
                    i64::try_from(value).unwrap_or(i64::MAX)
                }
            }
        };
        setting.check(value).map_err(Reject::Refused)?;
        (setting.set)(of, value);
    }
    Ok(())
}

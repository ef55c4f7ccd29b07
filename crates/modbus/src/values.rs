//! The numbers in registers that are written, and the settings that they name.

use clino_gateway::settings::Given;

use crate::exception::Exception;
use crate::map::lookup::{self, Number, Register};
use crate::map::{Form, Item};

/// The settings that a request names, in units of the map's registers: the registers of the request themselves, all of one
/// thing, each within its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Values<'a> {
    first: u16,
    words: &'a [[u8; 2]],
}

impl<'a> Values<'a> {
    /// The settings that these registers name, beginning with `first`.
    pub(crate) const fn new(first: u16, words: &'a [[u8; 2]]) -> Values<'a> {
        Values { first, words }
    }

    /// The value of a setting, if the request names it.
    #[inline(never)]
    pub fn of(&self, id: u8) -> Option<Given> {
        numbers(self.first, self.words).map_while(Result::ok).find_map(|(number, value)| {
            let named = match number.item {
                Item::SlotSetting(id) | Item::BusSetting(id) | Item::Port(id) | Item::Console(id) => Some(id),
                _ => None,
            };
            (named == Some(id)).then_some(Given { value, scale: number.scale.into() })
        })
    }
}

/// Numbers of registers that are written, one after the other.
pub struct Numbers<'a> {
    address: u16,
    words: core::slice::Iter<'a, [u8; 2]>,
}

impl Iterator for Numbers<'_> {
    /// A number that can be written whole, and its value.
    type Item = Result<(Number, i64), Exception>;

    fn next(&mut self) -> Option<Self::Item> {
        let high = u16::from_be_bytes(*self.words.next()?);
        Some(self.number(high).ok_or(Exception::IllegalDataAddress))
    }
}

impl Numbers<'_> {
    #[inline(never)]
    fn number(&mut self, high: u16) -> Option<(Number, i64)> {
        let Some(Register::Of(number)) = lookup::find(self.address) else { return None };
        number.limits().filter(|_| number.word == 0)?;
        let registers = number.form.registers();
        let mut bits = u32::from(high);
        if registers == 2 {
            bits = (bits << 16) | u32::from(u16::from_be_bytes(*self.words.next()?));
        }
        self.address = self.address.wrapping_add(registers);
        let value = match number.form {
            Form::I16 => i64::from(high.cast_signed()),
            Form::I32 | Form::I32Swapped => i64::from(bits.cast_signed()),
            _ => i64::from(bits),
        };
        Some((number, value))
    }
}

/// The numbers in these registers, beginning with `first`.
pub fn numbers(first: u16, words: &[[u8; 2]]) -> Numbers<'_> {
    Numbers { address: first, words: words.iter() }
}

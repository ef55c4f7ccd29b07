//! From registers that are written to one change. Values and whether they go together are checked by the tables.
//!
//! A request changes one thing: one slot, one bus, the port, the console, or it is one command. What it leaves out stays as
//! it is (a command's target, value and key: count as zero). Addresses come before values: a request with a fault of each
//! kind is answered with the exception of the address.

use clino_gateway::Bus;
use clino_gateway::settings::{Given, port};

use crate::command::{ARM_KEY, Command};
use crate::exception::Exception;
use crate::host::{Refusal, Values, Write};
use crate::map::lookup::{self, Number, Register};
use crate::map::{CommandItem, Form, Item};
use crate::settings::Settings;

impl From<Refusal> for Exception {
    fn from(refusal: Refusal) -> Exception {
        match refusal {
            Refusal::Value => Exception::IllegalDataValue,
            Refusal::Failed => Exception::ServerDeviceFailure,
            Refusal::Busy => Exception::ServerDeviceBusy,
        }
    }
}

/// What these registers, beginning with `first`, ask for. `now` is how the port runs.
pub fn change(now: &Settings, first: u16, words: &[[u8; 2]]) -> Result<Write, Exception> {
    let mut words = words.iter().map(|&word| u16::from_be_bytes(word));
    let mut address = first;
    let mut draft = None;
    let mut out_of_range = false;
    while let Some(high) = words.next() {
        let Some(Register::Of(number)) = lookup::find(address) else {
            return Err(Exception::IllegalDataAddress);
        };
        let (Some((least, most)), 0) = (number.limits(), number.word) else {
            return Err(Exception::IllegalDataAddress);
        };
        let registers = number.form.registers();
        let mut bits = u32::from(high);
        if registers == 2 {
            let low = words.next().ok_or(Exception::IllegalDataAddress)?;
            bits = (bits << 16) | u32::from(low);
        }
        address = address.wrapping_add(registers);
        let draft = draft.get_or_insert_with(|| Draft::begin(&number));
        if !draft.is_of(&number) {
            return Err(Exception::IllegalDataAddress);
        }
        let value = match number.form {
            Form::I16 => i64::from(high.cast_signed()),
            Form::I32 | Form::I32Swapped => i64::from(bits.cast_signed()),
            _ => i64::from(bits),
        };
        let in_range = (i64::from(least)..=i64::from(most)).contains(&value);
        out_of_range |= !in_range || draft.set(&number, value).is_none();
    }
    if out_of_range {
        return Err(Exception::IllegalDataValue);
    }
    draft.ok_or(Exception::IllegalDataValue)?.finish(now)
}

/// A change in the making.
enum Draft {
    Slot(u8, Values),
    Bus(Bus, Values),
    Port(Values),
    Console(Values),
    Command(Order),
}

#[derive(Default)]
struct Order {
    command: Option<Command>,
    target: u16,
    value: i32,
    key: u16,
}

impl Draft {
    /// Of the thing that a number belongs to.
    fn begin(number: &Number) -> Draft {
        let values = Values::default();
        match number.item {
            Item::SlotSetting(_) => Draft::Slot(number.index as u8, values),
            Item::BusSetting(_) => Draft::Bus(number.bus(), values),
            Item::Port(_) => Draft::Port(values),
            Item::Console(_) => Draft::Console(values),
            _ => Draft::Command(Order::default()),
        }
    }

    /// Whether a number belongs to it, too.
    fn is_of(&self, number: &Number) -> bool {
        match (self, number.item) {
            (Draft::Slot(slot, _), Item::SlotSetting(_)) => usize::from(*slot) == number.index,
            (Draft::Bus(bus, _), Item::BusSetting(_)) => *bus == number.bus(),
            (Draft::Port(_), Item::Port(_))
            | (Draft::Console(_), Item::Console(_))
            | (Draft::Command(_), Item::Command(_)) => true,
            _ => false,
        }
    }

    /// Puts a number that is within its limits in its place; `None` if it is the code of nothing.
    fn set(&mut self, number: &Number, value: i64) -> Option<()> {
        let given = Given { value, scale: number.scale.into() };
        match (self, number.item) {
            (Draft::Slot(_, values), Item::SlotSetting(id))
            | (Draft::Bus(_, values), Item::BusSetting(id))
            | (Draft::Port(values), Item::Port(id))
            | (Draft::Console(values), Item::Console(id)) => values.name(id, given)?,
            (Draft::Command(order), Item::Command(item)) => match item {
                CommandItem::Command => order.command = Some(Command::from_code(value as u16)?),
                CommandItem::Target => order.target = value as u16,
                CommandItem::Value => order.value = value as i32,
                CommandItem::Key => order.key = value as u16,
                _ => return None,
            },
            _ => return None,
        }
        Some(())
    }

    fn finish(self, now: &Settings) -> Result<Write, Exception> {
        match self {
            Draft::Slot(slot, values) => Ok(Write::Slot(slot, values)),
            Draft::Bus(bus, values) => Ok(Write::Bus(bus, values)),
            Draft::Console(values) => Ok(Write::Console(values)),
            Draft::Port(values) => {
                let port = port::changed(now, &|id| values.of(id));
                port.map(Write::Port).map_err(|_| Exception::IllegalDataValue)
            }
            Draft::Command(Order { command, target, value, key }) => {
                let command = command.ok_or(Exception::IllegalDataAddress)?;
                match key {
                    ARM_KEY => Ok(Write::Command { command, target, value, armed: true }),
                    0 if !command.takes_key() => Ok(Write::Command { command, target, value, armed: false }),
                    _ => Err(Exception::IllegalDataValue),
                }
            }
        }
    }
}

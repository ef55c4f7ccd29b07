//! From registers that are written to one change. Values and whether they go together are checked by the tables.
//!
//! A request changes one thing: one slot, one bus, the port, the console, or it is one command. Settings that it leaves out stay as
//! they are (a command's target, value and key: count as zero). Addresses come before values: a request with a fault of each
//! kind is answered with the exception of the address.

use clino_gateway::Bus;
use clino_gateway::settings::port;

use crate::command::{ARM_KEY, Command};
use crate::exception::Exception;
use crate::host::{Refusal, Write};
use crate::map::lookup::Number;
use crate::map::{CommandItem, Item};
use crate::settings::Settings;
use crate::values::{Values, numbers};

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
#[inline(never)]
pub fn change<'a>(now: &Settings, first: u16, words: &'a [[u8; 2]]) -> Result<Write<'a>, Exception> {
    let mut thing = None;
    let mut order = Order::default();
    let mut out_of_range = false;
    for number in numbers(first, words) {
        let (number, value) = number?;
        let this = Thing::of(&number).ok_or(Exception::IllegalDataAddress)?;
        if *thing.get_or_insert(this) != this {
            return Err(Exception::IllegalDataAddress);
        }
        let limits = number.limits().map(|(least, most)| i64::from(least)..=i64::from(most));
        out_of_range |= !limits.is_some_and(|limits| limits.contains(&value));
        if let Item::Command(item) = number.item {
            out_of_range |= order.set(item, value).is_none();
        }
    }
    if out_of_range {
        return Err(Exception::IllegalDataValue);
    }
    let values = Values::new(first, words);
    match thing.ok_or(Exception::IllegalDataValue)? {
        Thing::Slot(slot) => Ok(Write::Slot(slot, values)),
        Thing::Bus(bus) => Ok(Write::Bus(bus, values)),
        Thing::Console => Ok(Write::Console(values)),
        Thing::Port => {
            let port = port::changed(now, &|id| values.of(id));
            port.map(Write::Port).map_err(|_| Exception::IllegalDataValue)
        }
        Thing::Command => order.finish(),
    }
}

/// The target of a request.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Thing {
    Slot(u8),
    Bus(Bus),
    Port,
    Console,
    Command,
}

impl Thing {
    /// The thing that a number belongs to.
    fn of(number: &Number) -> Option<Thing> {
        match number.item {
            Item::SlotSetting(_) => Some(Thing::Slot(number.index as u8)),
            Item::BusSetting(_) => Some(Thing::Bus(number.bus())),
            Item::Port(_) => Some(Thing::Port),
            Item::Console(_) => Some(Thing::Console),
            Item::Command(_) => Some(Thing::Command),
            _ => None,
        }
    }
}

#[derive(Default)]
struct Order {
    command: Option<Command>,
    target: u16,
    value: i32,
    key: u16,
}

impl Order {
    /// Puts a number that is within its limits in its place; `None` if it is the code of nothing.
    fn set(&mut self, item: CommandItem, value: i64) -> Option<()> {
        match item {
            CommandItem::Command => self.command = Some(Command::from_code(value as u16)?),
            CommandItem::Target => self.target = value as u16,
            CommandItem::Value => self.value = value as i32,
            CommandItem::Key => self.key = value as u16,
            _ => return None,
        }
        Some(())
    }

    fn finish(self) -> Result<Write<'static>, Exception> {
        let Order { command, target, value, key } = self;
        let command = command.ok_or(Exception::IllegalDataAddress)?;
        match key {
            ARM_KEY => Ok(Write::Command { command, target, value, armed: true }),
            0 if !command.is_confirmed() => Ok(Write::Command { command, target, value, armed: false }),
            _ => Err(Exception::IllegalDataValue),
        }
    }
}

//! From registers that are written to one change, checked whole before anything is done.
//!
//! A request changes one thing: one slot, one bus, the port, or it is one command. What it leaves out stays as it is (a
//! command's target, value and key: count as zero). Addresses come before values: a request with a fault of each kind
//! is answered with the exception of the address.

use clino_bus::Micros;
use clino_bus::line::EchoMode;
use clino_gateway::BusChange;

use crate::command::{ARM_KEY, Command};
use crate::config::{Filter, SlotConfig};
use crate::exception::Exception;
use crate::host::{Bus, Host, Kind, Refusal, Write};
use crate::map::lookup::{self, Number, Register};
use crate::map::{BusSetting, CommandItem, Item, PortSetting, SlotSetting};
use crate::read;
use crate::settings::{Parity, Settings, StopBits};

impl From<Refusal> for Exception {
    fn from(refusal: Refusal) -> Exception {
        match refusal {
            Refusal::Value => Exception::IllegalDataValue,
            Refusal::Failed => Exception::ServerDeviceFailure,
            Refusal::Busy => Exception::ServerDeviceBusy,
        }
    }
}

/// What these registers, beginning with `first`, ask for.
pub fn change<H: Host>(host: &H, port: Settings, first: u16, words: &[[u8; 2]]) -> Result<Write, Exception> {
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
        let mut value = u32::from(high);
        if registers == 2 {
            let low = words.next().ok_or(Exception::IllegalDataAddress)?;
            value = (value << 16) | u32::from(low);
        }
        address = address.wrapping_add(registers);
        let draft = draft.get_or_insert_with(|| Draft::begin(host, port, &number));
        if !draft.is_of(&number) {
            return Err(Exception::IllegalDataAddress);
        }
        // Limits of numbers without a sign are not negative: a number beyond them all is below the least.
        let in_range = (least..=most).contains(&(value as i32));
        out_of_range |= !in_range || draft.set(number.item, value).is_none();
    }
    if out_of_range {
        return Err(Exception::IllegalDataValue);
    }
    draft.ok_or(Exception::IllegalDataValue)?.finish()
}

/// A change in the making.
enum Draft {
    Slot(u8, SlotConfig),
    Bus(Bus, BusChange),
    Port(Settings),
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
    /// The thing that a number belongs to, as it is.
    fn begin<H: Host>(host: &H, port: Settings, number: &Number) -> Draft {
        match number.item {
            Item::SlotSetting(_) => Draft::Slot(number.index as u8, host.slot_config(number.index)),
            // What is not written is not repeated: it may change meanwhile.
            Item::BusSetting(_) => Draft::Bus(read::bus(number.index), BusChange::NONE),
            Item::Port(_) => Draft::Port(port),
            _ => Draft::Command(Order::default()),
        }
    }

    /// Whether a number belongs to it, too.
    fn is_of(&self, number: &Number) -> bool {
        match (self, number.item) {
            (Draft::Slot(slot, _), Item::SlotSetting(_)) => usize::from(*slot) == number.index,
            (Draft::Bus(bus, _), Item::BusSetting(_)) => *bus as usize == number.index,
            (Draft::Port(_), Item::Port(_)) | (Draft::Command(_), Item::Command(_)) => true,
            _ => false,
        }
    }

    /// Puts a number that is within its limits in its place; `None` if it is the code of nothing.
    fn set(&mut self, item: Item, value: u32) -> Option<()> {
        match (self, item) {
            (Draft::Slot(_, config), Item::SlotSetting(item)) => set_slot(config, item, value)?,
            (Draft::Bus(_, change), Item::BusSetting(item)) => set_bus(change, item, value),
            (Draft::Port(settings), Item::Port(item)) => set_port(settings, item, value),
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

    fn finish(self) -> Result<Write, Exception> {
        match self {
            Draft::Slot(slot, config) => Ok(Write::Slot { slot, config }),
            Draft::Bus(bus, change) => Ok(Write::Bus { bus, change }),
            Draft::Port(settings) if settings.is_valid() => Ok(Write::Port(settings)),
            Draft::Port(_) => Err(Exception::IllegalDataValue),
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

fn set_slot(config: &mut SlotConfig, item: SlotSetting, value: u32) -> Option<()> {
    match item {
        SlotSetting::Enabled => config.enabled = value == 1,
        SlotSetting::Kind => config.kind = Kind::from_code(value as u16)?,
        SlotSetting::Address => config.address = value as u8,
        SlotSetting::Axis => config.axis = value as u8,
        SlotSetting::Period => config.period_ms = value,
        SlotSetting::Stale => config.stale_ms = value,
        SlotSetting::Timeout => config.timeout_ms = value as u16,
        SlotSetting::Retries => config.retries = value as u8,
        SlotSetting::Zero => config.zero_mdeg = value as i32,
        SlotSetting::Reversed => config.reversed = value == 1,
        SlotSetting::Unidirectional => config.unidirectional = value == 1,
        SlotSetting::Filter => {
            config.filter = match value {
                0 => Filter::None,
                1 => Filter::Mean,
                2 => Filter::Median,
                _ => return None,
            }
        }
        SlotSetting::FilterLength => config.filter_length = value as u8,
        SlotSetting::Confirm => config.confirm = value == 1,
        SlotSetting::Jump => config.jump_mdeg_s = value,
    }
    Some(())
}

fn set_bus(change: &mut BusChange, item: BusSetting, value: u32) {
    let micros = Some(Micros(value.into()));
    match item {
        BusSetting::Baud => change.baud = Some(value),
        BusSetting::Guard => change.guard = micros,
        BusSetting::PreDelay => change.pre_delay = micros,
        BusSetting::PostDelay => change.post_delay = micros,
        BusSetting::Echo => {
            change.echo = Some(match value {
                0 => EchoMode::Off,
                1 => EchoMode::Expected,
                _ => EchoMode::Detect,
            });
        }
    }
}

fn set_port(settings: &mut Settings, item: PortSetting, value: u32) {
    match item {
        PortSetting::Address => settings.address = value as u8,
        PortSetting::Baud => settings.baud = value,
        PortSetting::Parity => {
            settings.parity = match value {
                0 => Parity::None,
                1 => Parity::Even,
                _ => Parity::Odd,
            }
        }
        PortSetting::StopBits => {
            settings.stop_bits = if value == 2 { StopBits::Two } else { StopBits::One };
        }
    }
}

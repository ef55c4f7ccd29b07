//! Commissioning commands as orders.

use clino_codec::isu::eeprom;
use clino_codec::t7::{Address, Axis, BaudRate, Millidegrees};
use clino_codec::{isu, t7};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, Rates, Setting};
use clino_gateway::order::{Order, Refusal, T7_BIT_RATES};
use clino_gateway::task;

use embedded_cli::arguments::FromArgument;
use embedded_cli::service::ParseError;

use crate::arguments::{IsuVerb, OutputRange, Sense, T7Verb};
use crate::error::Error;

/// A single-axis T7 measures axis 2 (T7 guide section 1).
const SINGLE_AXIS: u8 = 2;

/// What else was typed after the verb.
#[derive(Clone, Copy)]
pub struct Rest<'a> {
    /// The address, or the first word.
    pub address: Option<&'a str>,
    /// The new value.
    pub value: Option<&'a str>,
    /// The axis of a T7.
    pub axis: Option<u8>,
}

/// The order for a command about T7s. `baud` is the bus's bit rate.
pub fn t7<'a>(verb: T7Verb, rest: Rest<'a>, baud: u32) -> Result<Order, Error<'a>> {
    use task::t7::Task;
    if verb == T7Verb::Scan {
        return Ok(Order::T7(Task::Sweep(match rest.address {
            Some("all") => Rates::ALL,
            Some(value) => return Err(unknown(value, "all, or nothing")),
            None => Rates::NONE.and(bit_rate(baud)?),
        })));
    }
    let device = device(rest.address()?)?;
    let set = |setting| Task::Set(device, setting);
    Ok(Order::T7(match verb {
        T7Verb::Scan | T7Verb::Info => Task::Identify(device),
        T7Verb::Zero => Task::Zero(device, axis(rest.axis)?),
        T7Verb::Offset => {
            set(Setting::Offset { axis: axis(rest.axis)?, offset: Millidegrees(rest.value()?) })
        }
        T7Verb::Direction => {
            let Sense(direction) = rest.value()?;
            set(Setting::Direction { axis: axis(rest.axis)?, direction })
        }
        T7Verb::Damping => set(Setting::Damping(rest.value()?)),
        T7Verb::Range => {
            let OutputRange(range) = rest.value()?;
            set(Setting::Range(range))
        }
        T7Verb::Address => Task::Address { from: device.address(), to: one_t7(rest.value()?)? },
        T7Verb::Baud => Task::Baud(device, bit_rate(rest.value()?)?),
    }))
}

/// The order for a command about ISUs.
pub fn isu<'a>(verb: IsuVerb, rest: Rest<'a>) -> Result<Order, Error<'a>> {
    use task::isu::Task;
    let module = module(rest.address()?)?;
    Ok(Order::Isu(match verb {
        IsuVerb::Info => Task::Identify(module),
        IsuVerb::Reset => Task::Reset(module),
        IsuVerb::Zero => Task::ResetNull(module),
        IsuVerb::Null => Task::Program(module, eeprom::Change::NullPosition(rest.value()?)),
        IsuVerb::Address => Task::Program(module, eeprom::Change::ModuleAddress(one_isu(rest.value()?)?)),
        IsuVerb::Repair => Task::Repair(module),
    }))
}

impl<'a> Rest<'a> {
    fn address(&self) -> Result<u8, Error<'a>> {
        parsed(self.address.ok_or(Error::Missing("address"))?)
    }

    fn value<T: FromArgument<'a>>(&self) -> Result<T, Error<'a>> {
        parsed(self.value.ok_or(Error::Missing("value"))?)
    }
}

fn parsed<'a, T: FromArgument<'a>>(word: &'a str) -> Result<T, Error<'a>> {
    T::from_arg(word).map_err(|error| Error::Syntax(error.into()))
}

fn unknown<'a>(value: &'a str, expected: &'static str) -> Error<'a> {
    Error::Syntax(ParseError::ParseValueError { value, expected })
}

/// A T7's own address.
pub fn one_t7(number: u8) -> Result<t7::Address, Refusal> {
    let one = Address::new(number).filter(|address| !address.is_all());
    one.ok_or(Refusal::Range { what: "t7_address", value: u64::from(number), least: 1, most: 127 })
}

/// An ISU's own address.
pub fn one_isu(number: u8) -> Result<isu::Address, Refusal> {
    let one = isu::Address::new(number).filter(|address| !address.is_any());
    one.ok_or(Refusal::Range { what: "isu_address", value: u64::from(number), least: 1, most: 14 })
}

/// An axis; that of a single-axis T7 if none is named.
pub fn axis(number: Option<u8>) -> Result<Axis, Refusal> {
    let number = number.unwrap_or(SINGLE_AXIS);
    Axis::new(number).ok_or(Refusal::Range { what: "axis", value: u64::from(number), least: 0, most: 2 })
}

fn device(number: u8) -> Result<Device, Refusal> {
    let refusal = Refusal::Range { what: "t7_address", value: u64::from(number), least: 1, most: 127 };
    Device::at(one_t7(number)?).map_err(|_| refusal)
}

fn module(number: u8) -> Result<Module, Refusal> {
    let refusal = Refusal::Range { what: "isu_address", value: u64::from(number), least: 1, most: 14 };
    Module::at(one_isu(number)?).map_err(|_| refusal)
}

fn bit_rate(value: u32) -> Result<BaudRate, Refusal> {
    BaudRate::from_bits_per_second(value).ok_or(Refusal::BitRate { value, allowed: &T7_BIT_RATES })
}

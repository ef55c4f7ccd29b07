//! Commissioning: commands that become tasks on a bus.

use clino_bus::Serial;
use clino_codec::isu::eeprom;
use clino_codec::t7::{Address, Axis, BaudRate, Millidegrees};
use clino_codec::{isu as isu_codec, t7 as t7_codec};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, DeviceSetting, Rates};
use clino_gateway::config::{Kind, SINGLE_AXIS};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::bus::T7_BIT_RATES;
use clino_gateway::{Bus, Consequence, task};

use crate::choice::Choice;
use crate::error::{ADDRESS, WORD, one};
use crate::job::{Job, Outcome, Reported};
use crate::pending::{Pending, is_at_work};
use crate::sensor_task::SensorTask;
use crate::typed::Opt;
use crate::value::Value;
use crate::words::{IsuVerb, T7Verb};

/// Axis of a T7.
const AXIS: Opt = Opt(Some(b'a'), "axis");

/// `t7 VERB ADDRESS VALUE`
pub fn t7(job: &mut Job<'_, '_>) -> Outcome {
    use task::t7::Task;
    let axis = axis(job)?;
    let verb = job.one_of("verb")?;
    if verb == T7Verb::Scan {
        let rates = rates(job)?;
        return begin(job, SensorTask::T7(Task::Sweep(rates)), false);
    }
    let word = job.word("address")?;
    let address = one_t7(job, word)?;
    let device = Device::at(address).map_err(|_| no_t7(job, address.get()))?;
    let value = match verb {
        T7Verb::Scan | T7Verb::Info | T7Verb::Zero => "",
        _ => job.word("value")?,
    };
    let task = match verb {
        T7Verb::Scan | T7Verb::Info => Task::Identify(device),
        T7Verb::Zero => Task::Zero(device, axis),
        T7Verb::Offset => {
            let mdeg = job.number(value, "offset_mdeg", i32::MIN.into(), i32::MAX.into())?;
            Task::Set(device, DeviceSetting::Offset { axis, offset: Millidegrees(mdeg as i32) })
        }
        T7Verb::Direction => {
            Task::Set(device, DeviceSetting::Direction { axis, direction: job.meaning(value)? })
        }
        T7Verb::Damping => {
            Task::Set(device, DeviceSetting::Damping(job.up_to(value, "damping_ms", u16::MAX.into())? as u16))
        }
        T7Verb::Range => Task::Set(device, DeviceSetting::Range(job.meaning(value)?)),
        T7Verb::Address => Task::Address { from: device.address(), to: one_t7(job, value)? },
        T7Verb::Baud => {
            let baud = job.up_to(value, "baud", u32::MAX)?;
            Task::Baud(device, bit_rate(job, baud)?)
        }
    };
    begin(job, SensorTask::T7(task), verb != T7Verb::Info)
}

/// `isu VERB ADDRESS VALUE`
pub fn isu(job: &mut Job<'_, '_>) -> Outcome {
    use task::isu::Task;
    let verb = job.one_of("verb")?;
    let word = job.word("address")?;
    let address = one_isu(job, word)?;
    let module = Module::at(address).map_err(|_| no_isu(job, address.get()))?;
    let task = match verb {
        IsuVerb::Info => Task::Identify(module),
        IsuVerb::Reset => Task::Reset(module),
        IsuVerb::Zero => Task::ResetNull(module),
        IsuVerb::Null => {
            let word = job.word("value")?;
            let position = job.up_to(word, "position", u16::MAX.into())?;
            Task::Program(module, eeprom::Change::NullPosition(position as u16))
        }
        IsuVerb::Address => {
            let word = job.word("value")?;
            Task::Program(module, eeprom::Change::ModuleAddress(one_isu(job, word)?))
        }
        IsuVerb::Repair => Task::Repair(module),
    };
    begin(job, SensorTask::Isu(task), !matches!(verb, IsuVerb::Info | IsuVerb::Reset))
}

/// `cancel`
pub fn cancel(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    for bus in Bus::ALL {
        let result = job.host.order(Order::Cancel(bus));
        job.accepted(result)?;
    }
    // A task goes on to its next consistent point; its end is reported then.
    if is_at_work(job.host) {
        job.reply.accepted()
    } else {
        job.reply.done()
    }
    Ok(())
}

/// Begins a task; one that writes to a sensor only when it is meant.
#[inline(never)]
fn begin(job: &mut Job<'_, '_>, task: SensorTask, writes: bool) -> Outcome {
    let consequence = checked(job, task)?;
    // There is nothing to be asked about the others.
    job.typed.yes |= !writes;
    job.confirmed(Pending::Task(task, consequence))
}

/// A function of its own, so that the stack of the order is free again at once.
#[inline(never)]
fn checked(job: &mut Job<'_, '_>, task: SensorTask) -> Result<Consequence, Reported> {
    let order = task.order();
    job.accepted(order.check())?;
    Ok(job.host.consequence(&order))
}

fn rates(job: &mut Job<'_, '_>) -> Result<Rates, Reported> {
    match job.typed.next() {
        Some("all") => Ok(Rates::ALL),
        Some(value) => {
            let expected = Value::OneOf(Choice::Words(&["all", "nothing"]));
            Err(job.refuse(WORD, &[value.into(), expected]))
        }
        None => {
            let settings = job.host.bus_settings(Bus::T7);
            let serial = settings.map_or(Serial::T7_DEFAULT, |settings| settings.timing.serial);
            Ok(Rates::NONE.and(bit_rate(job, serial.baud)?))
        }
    }
}

/// A T7's own address.
#[inline(never)]
pub fn one_t7(job: &mut Job<'_, '_>, word: &str) -> Result<t7_codec::Address, Reported> {
    let number = job.byte(word, "address", 0, u8::MAX)?;
    Address::new(number).filter(|address| !address.is_all()).ok_or_else(|| no_t7(job, number))
}

/// An ISU's own address.
#[inline(never)]
pub fn one_isu(job: &mut Job<'_, '_>, word: &str) -> Result<isu_codec::Address, Reported> {
    let number = job.byte(word, "address", 0, u8::MAX)?;
    let one = isu_codec::Address::new(number).filter(|address| !address.is_any());
    one.ok_or_else(|| no_isu(job, number))
}

/// An axis; that of a single-axis T7 if none is named.
pub fn axis(job: &mut Job<'_, '_>) -> Result<Axis, Reported> {
    match job.option(AXIS)? {
        Some(word) => {
            job.byte(word, "axis", 0, Axis::Two.get()).and_then(|number| Axis::new(number).ok_or(Reported))
        }
        None => Ok(SINGLE_AXIS),
    }
}

fn no_t7(job: &mut Job<'_, '_>, value: u8) -> Reported {
    not_one(job, Kind::T7, value)
}

/// An address that no single sensor of this kind has.
#[inline(never)]
fn not_one(job: &mut Job<'_, '_>, kind: Kind, value: u8) -> Reported {
    job.refuse(ADDRESS, &["address".into(), value.into(), one(kind).into()])
}

fn no_isu(job: &mut Job<'_, '_>, value: u8) -> Reported {
    not_one(job, Kind::Isu, value)
}

fn bit_rate(job: &mut Job<'_, '_>, value: u32) -> Result<BaudRate, Reported> {
    let refusal = Refusal::BitRate { value, allowed: T7_BIT_RATES };
    BaudRate::from_bits_per_second(value).ok_or_else(|| job.refused(&refusal))
}

//! Commands to a slot's sensor as tasks of its bus.

use clino_codec::angle::Range;
use clino_codec::isu::eeprom::Change;
use clino_codec::t7::{BaudRate, Direction, Millidegrees};
use clino_codec::{isu, t7};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, DeviceSetting};
use clino_gateway::Source;
use clino_gateway::order::Order;
use clino_gateway::task;

use crate::command::Command;

/// The order for a command about the sensor that a slot reads; `None` if that sensor does not have the command.
pub fn order(command: Command, source: Source, value: i32) -> Option<Order> {
    match source {
        Source::T7 { address, axis } => t7(command, Device::at(address).ok()?, axis, value).map(Order::T7),
        Source::Isu { address } => isu(command, Module::at(address).ok()?, value).map(Order::Isu),
        Source::Pwm { .. } | Source::Incomplete { .. } | Source::Off => None,
    }
}

fn t7(command: Command, device: Device, axis: t7::Axis, value: i32) -> Option<task::t7::Task> {
    use task::t7::Task;
    let set = |setting| Task::Set(device, setting);
    Some(match command {
        Command::SensorInfo => Task::Identify(device),
        Command::SensorZero => Task::Zero(device, axis),
        Command::SensorDamping => set(DeviceSetting::Damping(u16::try_from(value).ok()?)),
        Command::SensorDirection => {
            let direction = [Direction::Normal, Direction::Reversed];
            set(DeviceSetting::Direction { axis, direction: *direction.get(usize::try_from(value).ok()?)? })
        }
        Command::SensorOffset => set(DeviceSetting::Offset { axis, offset: Millidegrees(value) }),
        Command::SensorRange => {
            let range = [Range::Bidirectional, Range::Unidirectional];
            set(DeviceSetting::Range(*range.get(usize::try_from(value).ok()?)?))
        }
        Command::SensorAddress => {
            let to = t7::Address::new(u8::try_from(value).ok()?).filter(|address| !address.is_all())?;
            Task::Address { from: device.address(), to }
        }
        Command::SensorBaud => {
            Task::Baud(device, BaudRate::from_bits_per_second(u32::try_from(value).ok()?)?)
        }
        _ => return None,
    })
}

fn isu(command: Command, module: Module, value: i32) -> Option<task::isu::Task> {
    use task::isu::Task;
    Some(match command {
        Command::SensorInfo => Task::Identify(module),
        Command::SensorReset => Task::Reset(module),
        Command::SensorZero => Task::ResetNull(module),
        Command::SensorNull => Task::Program(module, Change::NullPosition(u16::try_from(value).ok()?)),
        Command::SensorAddress => {
            let to = isu::Address::new(u8::try_from(value).ok()?).filter(|address| !address.is_any())?;
            Task::Program(module, Change::ModuleAddress(to))
        }
        Command::SensorRepair => Task::Repair(module),
        _ => return None,
    })
}

//! What else an order changes, beside the sensor that it names: shown when the command asks for confirmation.

use crate::config::Bus;
use crate::order::Order;
use crate::task;

/// What else an order changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Consequence {
    /// Other nodes that slots read on the bus. They stay at its present bit rate and fall silent.
    pub silenced: u8,
    /// The first slot that reads the sensor's new address already: it will read this sensor.
    pub shared: Option<u8>,
}

impl Consequence {
    /// No other node or slot is concerned.
    pub const NONE: Consequence = Consequence { silenced: 0, shared: None };

    /// The consequence of an order, while the T7 bus has this bit rate; `slots` are the bus and the address that each slot asks
    /// ([`SlotConfig::node`](crate::SlotConfig::node)), if it does.
    pub fn of(order: &Order, baud: u32, slots: impl Iterator<Item = Option<(Bus, u8)>>) -> Consequence {
        match order {
            Order::T7(task::t7::Task::Baud(device, rate)) if rate.bits_per_second() != baud => {
                Consequence { silenced: others(slots, Bus::T7, device.address().get()), ..Consequence::NONE }
            }
            Order::T7(task::t7::Task::Address { from, to }) if from != to => {
                Consequence { shared: reader(slots, Bus::T7, to.get()), ..Consequence::NONE }
            }
            Order::Isu(task::isu::Task::Program(
                module,
                clino_codec::isu::eeprom::Change::ModuleAddress(to),
            )) if module.address() != *to => {
                Consequence { shared: reader(slots, Bus::Isu, to.get()), ..Consequence::NONE }
            }
            _ => Consequence::NONE,
        }
    }
}

/// How many other nodes slots read on a bus.
fn others(slots: impl Iterator<Item = Option<(Bus, u8)>>, bus: Bus, node: u8) -> u8 {
    let seen = slots.flatten().filter(|&(on, other)| on == bus && other != node);
    seen.fold(0_u128, |seen, (_, other)| seen | 1_u128.wrapping_shl(other.into())).count_ones() as u8
}

/// The first slot that reads a node.
fn reader(mut slots: impl Iterator<Item = Option<(Bus, u8)>>, bus: Bus, node: u8) -> Option<u8> {
    slots.position(|read| read == Some((bus, node))).map(|number| number as u8)
}

#[cfg(test)]
mod tests {
    use clino_codec::isu::eeprom::Change;
    use clino_codec::t7::{Axis, BaudRate};
    use clino_codec::{isu, t7};
    use clino_commissioning::isu::Module;
    use clino_commissioning::t7::Device;

    use super::*;
    use crate::config::{MAX_SLOTS, SlotConfig, Source};

    fn address(number: u8) -> t7::Address {
        t7::Address::new(number).unwrap()
    }

    /// T7s 1 (two axes), 2, 3 (off), 127; ISUs 1 and 2.
    fn slot(number: usize) -> Option<(Bus, u8)> {
        let t7 = |node, axis| SlotConfig::usual(Source::T7 { address: address(node), axis });
        let isu = |node| SlotConfig::usual(Source::Isu { address: isu::Address::new(node).unwrap() });
        let config = match number {
            0 => t7(1, Axis::Zero),
            1 => t7(1, Axis::One),
            2 => t7(2, Axis::Two),
            3 => SlotConfig { enabled: false, ..t7(3, Axis::Two) },
            4 => isu(1),
            5 => isu(2),
            6 => t7(127, Axis::Two),
            _ => SlotConfig::OFF,
        };
        config.node()
    }

    #[test]
    fn nodes_that_stay_behind_are_counted_once_each() {
        let baud = |node, rate, now| {
            let order = Order::T7(task::t7::Task::Baud(Device::at(address(node)).unwrap(), rate));
            Consequence::of(&order, now, (0..MAX_SLOTS).map(slot)).silenced
        };
        assert_eq!(baud(1, BaudRate::B57600, 115_200), 2);
        assert_eq!(baud(9, BaudRate::B57600, 115_200), 3);
        assert_eq!(baud(9, BaudRate::B57600, 57_600), 0, "that is no change");
    }

    #[test]
    fn a_slot_that_reads_the_new_address_is_named() {
        let t7 = |from, to| {
            let order = Order::T7(task::t7::Task::Address { from: address(from), to: address(to) });
            Consequence::of(&order, 115_200, (0..MAX_SLOTS).map(slot)).shared
        };
        assert_eq!([t7(9, 1), t7(9, 2), t7(9, 3), t7(9, 10), t7(1, 1)], [Some(0), Some(2), None, None, None]);
        let isu = |from, to| {
            let module = Module::at(isu::Address::new(from).unwrap()).unwrap();
            let change = Change::ModuleAddress(isu::Address::new(to).unwrap());
            Consequence::of(
                &Order::Isu(task::isu::Task::Program(module, change)),
                115_200,
                (0..MAX_SLOTS).map(slot),
            )
            .shared
        };
        assert_eq!([isu(1, 2), isu(2, 3), isu(9, 1)], [Some(5), None, Some(4)]);
    }
}

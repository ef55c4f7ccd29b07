//! Results of the last command and findings of the last scan, kept until the next one.
//!
//! Numbers are kept as they are read; the words are the console's (`console/src/news.rs`).

use clino_codec::angle::{Angle, Range};
use clino_codec::isu::eeprom;
use clino_codec::t7::{BaudRate, DeviceInformation, Direction};
use clino_commissioning::t7::{DeviceSetting, Found, Identity};
use clino_commissioning::{Report, SettingChange, isu as isu_commissioning, t7 as t7_commissioning};
use clino_gateway::Published;
use clino_gateway::command::Command;
use clino_gateway::task::{TaskEvent, isu, t7};
use heapless::Vec;

use crate::map::{FOUND, FoundItem, ResultItem};

/// Numbers that a command can have; see [`ResultItem`].
const NUMBERS: usize = ResultItem::Sound as usize + 1;
/// Products with their firmware of which a scan keeps the names. One bus has few of them.
const TYPES: usize = 3;

/// Results of the last command and the last scan.
#[derive(Default)]
pub struct Results {
    /// The command that the numbers are of.
    sequence: u16,
    /// The scan that is kept, and how much it has found.
    scan: u16,
    found: u16,
    numbers: [i32; NUMBERS],
    /// Which of them there are, a bit each.
    known: u32,
    nodes: Vec<Node, FOUND>,
    types: Vec<Names, TYPES>,
}

/// Product and firmware, see [`names`].
type Names = [i32; 4];

/// Something that a scan has found, in as few bytes as it takes.
struct Node {
    address: u8,
    /// Bit rate, by its place in [`BaudRate::ALL`]; times [`KINDS`], and one of those.
    rate_and_kind: u8,
    /// Serial number, high byte first.
    serial: [u8; 4],
}

/// What a node is: less than [`TYPES`], one with these names; or one of the following.
const NO_NAMES: u8 = TYPES as u8;
const SUSPECT: u8 = NO_NAMES + 1;
const KINDS: u8 = SUSPECT + 1;

impl Results {
    /// A command was accepted.
    pub fn begin(&mut self, command: Command, sequence: u16) {
        (self.sequence, self.known) = (sequence, 0);
        if command == Command::Scan {
            (self.scan, self.found) = (sequence, 0);
            self.nodes.clear();
            self.types.clear();
        }
    }

    /// Takes the report of a task.
    #[inline(never)]
    pub fn take(&mut self, news: &TaskEvent) {
        let writes = match news {
            TaskEvent::T7(t7::TaskEvent::Found(found)) => return self.find(found),
            TaskEvent::T7(t7::TaskEvent::Swept(swept)) => {
                self.put(ResultItem::Devices, swept.devices.into());
                self.put(ResultItem::Suspects, swept.suspects.into());
                self.put(ResultItem::Asked, swept.asked.into());
                return self.put(ResultItem::Complete, swept.complete.into());
            }
            TaskEvent::T7(t7::TaskEvent::Identity(identity)) => return self.identify(identity),
            TaskEvent::Isu(isu::TaskEvent::Identity(identity)) => {
                self.put(ResultItem::Address, identity.address.get().into());
                self.put(ResultItem::Angle, mdeg(identity.angle));
                self.put(ResultItem::Null, mdeg(identity.null_position));
                self.put(ResultItem::Shutoff, identity.auto_shutoff_word.into());
                return self.put(ResultItem::Sound, identity.audit.is_sound().into());
            }
            TaskEvent::Isu(isu::TaskEvent::Alive(alive)) => {
                return self.put(ResultItem::Address, alive.at.get().into());
            }
            TaskEvent::T7(t7::TaskEvent::Zeroed(zeroed)) => {
                self.put(ResultItem::Before, zeroed.before.0);
                self.put(ResultItem::After, zeroed.after.0);
                zeroed.writes
            }
            TaskEvent::Isu(isu::TaskEvent::Nulled(nulled)) => {
                self.put(ResultItem::Before, mdeg(Angle::from_turn16(nulled.before)));
                self.put(ResultItem::After, mdeg(Angle::from_turn16(nulled.after)));
                nulled.writes
            }
            TaskEvent::T7(t7::TaskEvent::Set(report)) => self.changed(report, setting),
            TaskEvent::T7(t7::TaskEvent::Address(report)) => {
                self.changed(report, |address| address.get().into())
            }
            TaskEvent::T7(t7::TaskEvent::Baud(report)) => {
                self.changed(report, |rate| rate.bits_per_second() as i32)
            }
            TaskEvent::Isu(isu::TaskEvent::Programmed(report)) => self.changed(report, programmed),
            TaskEvent::Isu(isu::TaskEvent::Repaired(repaired)) => {
                self.put(ResultItem::Address, repaired.at.get().into());
                self.put(ResultItem::Stored, repaired.stored_address.get().into());
                repaired.writes
            }
            TaskEvent::T7(t7::TaskEvent::Failed(failure)) => {
                if let t7_commissioning::Cause::Moving { mdeg_per_s } = failure.cause {
                    self.put(ResultItem::Rate, mdeg_per_s as i32);
                }
                failure.writes
            }
            TaskEvent::Isu(isu::TaskEvent::Failed(failure)) => {
                self.put(ResultItem::Repair, failure.repair.into());
                if let isu_commissioning::Cause::Moving { mdeg_per_s } = failure.cause {
                    self.put(ResultItem::Rate, mdeg_per_s as i32);
                }
                failure.writes
            }
        };
        self.put(ResultItem::Writes, writes.into());
    }

    fn identify(&mut self, identity: &Identity) {
        let Identity { information, directions, damping_ms, range, offsets } = identity;
        self.put(ResultItem::Serial, information.serial.cast_signed());
        self.put_all(ResultItem::Product, &names(information));
        self.put(ResultItem::Damping, (*damping_ms).into());
        self.put(ResultItem::Range, unidirectional(*range));
        self.put_all(ResultItem::Direction, &directions.map(reversed));
        self.put_all(ResultItem::Offset, &offsets.map(|offset| offset.0));
    }

    fn find(&mut self, found: &Found) {
        self.found = self.found.saturating_add(1);
        let (address, rate, kind, serial) = match found {
            Found::Device { address, rate, information } => {
                (address, rate, self.kind(names(information)), information.serial)
            }
            Found::Suspect { address, rate, .. } => (address, rate, SUSPECT, 0),
        };
        let rate = BaudRate::ALL.iter().position(|one| one == rate).unwrap_or(0) as u8;
        let node = Node {
            address: address.get(),
            rate_and_kind: rate.wrapping_mul(KINDS).wrapping_add(kind),
            serial: serial.to_be_bytes(),
        };
        // Without room, it is only counted.
        _ = self.nodes.push(node);
    }

    /// The type of node with these names, which are kept if there is room for them.
    fn kind(&mut self, names: Names) -> u8 {
        let known = self.types.iter().position(|known| *known == names);
        let place = known.or_else(|| {
            let place = self.types.len();
            self.types.push(names).ok().map(|()| place)
        });
        place.map_or(NO_NAMES, |place| place as u8)
    }

    /// Returns how often it was written.
    fn changed<T>(&mut self, report: &Report<T>, value: impl Fn(&T) -> i32) -> u8 {
        let to = match &report.change {
            SettingChange::Unchanged(is) => is,
            SettingChange::Changed { from, to } => {
                self.put(ResultItem::From, value(from));
                to
            }
        };
        self.put(ResultItem::To, value(to));
        report.writes
    }

    /// There is this number.
    fn put(&mut self, item: ResultItem, value: i32) {
        self.put_at(item as usize, value);
    }

    /// There are these numbers, from this one on.
    fn put_all(&mut self, first: ResultItem, values: &[i32]) {
        for (index, value) in values.iter().enumerate() {
            self.put_at((first as usize).wrapping_add(index), *value);
        }
    }

    #[inline(never)]
    fn put_at(&mut self, place: usize, value: i32) {
        if let Some(number) = self.numbers.get_mut(place) {
            *number = value;
            self.known |= 1_u32.wrapping_shl(place as u32);
        }
    }

    /// A number of the last command; `None` if it has none.
    pub fn number(&self, item: ResultItem, index: usize) -> Option<u32> {
        match item {
            ResultItem::Sequence => Some(self.sequence.into()),
            ResultItem::Scan => Some(self.scan.into()),
            ResultItem::Found => Some(self.found.into()),
            _ => {
                let place = (item as usize).wrapping_add(index);
                let is_known = self.known.wrapping_shr(place as u32) & 1 == 1;
                self.numbers.get(place).filter(|_| is_known).map(|number| number.cast_unsigned())
            }
        }
    }

    /// A number of something that the last scan has found; `None` if it has none.
    pub fn found(&self, item: FoundItem, index: usize) -> Option<u32> {
        let Some(node) = self.nodes.get(index) else {
            return matches!(item, FoundItem::Scan | FoundItem::What).then_some(0);
        };
        let (rate, kind) = (node.rate_and_kind / KINDS, node.rate_and_kind % KINDS);
        let name = |part: usize| {
            let names = self.types.get(usize::from(kind))?;
            names.get(part).map(|characters| characters.cast_unsigned())
        };
        match item {
            FoundItem::Scan => Some(self.scan.into()),
            FoundItem::What => Some(if kind == SUSPECT { 2 } else { 1 }),
            FoundItem::Address => Some(node.address.into()),
            FoundItem::Baud => BaudRate::ALL.get(usize::from(rate)).map(|rate| rate.bits_per_second()),
            FoundItem::Serial => (kind != SUSPECT).then_some(u32::from_be_bytes(node.serial)),
            FoundItem::Product => name(0),
            FoundItem::Product2 => name(1),
            FoundItem::Firmware => name(2),
            FoundItem::Firmware2 => name(3),
        }
    }
}

/// Product and firmware, six characters each, in two numbers each: four and two.
fn names(information: &DeviceInformation) -> Names {
    let [a, b, c, d, e, f] = *information.product.as_bytes();
    let [g, h, i, j, k, l] = *information.firmware.as_bytes();
    [[a, b, c, d], [0, 0, e, f], [g, h, i, j], [0, 0, k, l]].map(i32::from_be_bytes)
}

fn reversed(direction: Direction) -> i32 {
    (direction == Direction::Reversed).into()
}

fn unidirectional(range: Range) -> i32 {
    (range == Range::Unidirectional).into()
}

fn mdeg(angle: Angle) -> i32 {
    Published::of_sensor(angle).mdeg()
}

/// Like the value of the command that sets it.
fn setting(setting: &DeviceSetting) -> i32 {
    match *setting {
        DeviceSetting::Offset { offset, .. } => offset.0,
        DeviceSetting::Direction { direction, .. } => reversed(direction),
        DeviceSetting::Damping(ms) => ms.into(),
        DeviceSetting::Range(range) => unidirectional(range),
    }
}

/// Like the value of the command that sets it.
fn programmed(change: &eeprom::Change) -> i32 {
    match *change {
        eeprom::Change::ModuleAddress(address) => address.get().into(),
        eeprom::Change::NullPosition(position) => position.into(),
        eeprom::Change::AutoShutoff { enabled, .. } => enabled.into(),
    }
}

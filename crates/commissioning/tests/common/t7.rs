//! T7s on a bench, whose own memory stays in reach.

use std::sync::{Arc, Mutex};

use clino_bus::{Serial, T7, Timing};
use clino_codec::t7::Address;
use clino_commissioning::t7::Device;
use clino_segment::{Faults, SegmentSettings, Station};
use clino_sim::motion::Motion;
use clino_sim::node::Ns;
use clino_sim::t7::{Identity, Model, Options, StoredSettings as Store, T7 as Sensor};
use clino_testkit::rig::Bench;

use super::spoil::{Spoil, Spoiler};

pub type Shared = Arc<Mutex<Sensor>>;

/// A single-axis device at 30° whose serial number is 1000 and its address.
pub fn at(address: u8) -> Shared {
    at_rate(address, 0)
}

/// The same with a bit rate index.
pub fn at_rate(address: u8, baud_index: u8) -> Shared {
    with(
        Identity { serial: 1000 + u32::from(address), ..Identity::default() },
        Store { address, baud_index, damping_ms: 50, ..Store::default() },
    )
}

pub fn with(identity: Identity, store: Store) -> Shared {
    let motion = [const { Motion::Constant(30_000_000) }; 3];
    let options = Options { motion, ..Options::default() };
    Arc::new(Mutex::new(Sensor::new(identity, store, options).unwrap()))
}

pub fn three_axes(address: u8) -> Shared {
    with(
        Identity { model: Model::T73, product: *b"T7-3  ", serial: 77, ..Identity::default() },
        Store { address, damping_ms: 50, ..Store::default() },
    )
}

pub fn store(sensor: &Shared) -> Store {
    sensor.lock().unwrap().settings().clone()
}

pub fn bench(sensors: &[&Shared]) -> Bench<T7> {
    let stations = sensors.iter().map(|sensor| station(sensor, Spoil::Nothing, Vec::new())).collect();
    on_line(super::quiet(), stations)
}

pub fn spoilt(sensor: &Shared, spoil: Spoil) -> Bench<T7> {
    on_line(super::quiet(), vec![station(sensor, spoil, Vec::new())])
}

/// Without power in these intervals.
pub fn unplugged(sensor: &Shared, off: Vec<(Ns, Ns)>) -> Bench<T7> {
    on_line(super::quiet(), vec![station(sensor, Spoil::Nothing, off)])
}

pub fn on_line(settings: SegmentSettings, stations: Vec<Station>) -> Bench<T7> {
    Bench::new(Timing::t7(Serial::T7_DEFAULT), settings, stations)
}

pub fn station(sensor: &Shared, spoil: Spoil, unplugged: Vec<(Ns, Ns)>) -> Station {
    let node = Box::new(Spoiler::new(Arc::clone(sensor), spoil));
    Station { name: "t7".to_owned(), node, faults: Faults { unplugged, ..Faults::default() } }
}

pub fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

pub fn device(number: u8) -> Device {
    Device::at(address(number)).unwrap()
}

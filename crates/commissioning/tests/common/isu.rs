//! ISUs on a bench, whose own memory stays in reach.

use std::sync::{Arc, Mutex};

use clino_bus::{Protocol, Timing};
use clino_codec::isu::Address;
use clino_commissioning::isu::Module;
use clino_segment::{Faults, SegmentSettings, Station};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu as Sensor, Options, WORDS};
use clino_sim::motion::Motion;
use clino_sim::node::Ns;
use clino_testkit::rig::Bench;

use super::spoil::{Spoil, Spoiler};

pub type Shared = Arc<Mutex<Sensor>>;

pub const SCOPES: [ChecksumScope; 2] = [ChecksumScope::UpperBitsCounted, ChecksumScope::WordsLeftOut];

/// A module at an address, at 40°.
pub fn at(address: u8) -> Shared {
    with(address, ChecksumScope::default(), options())
}

pub fn options() -> Options {
    Options { motion: Motion::Constant(40_000_000), ..Options::default() }
}

pub fn with(address: u8, scope: ChecksumScope, options: Options) -> Shared {
    let eeprom = Eeprom::factory(Content { address, ..Content::default() }, scope, 1);
    Arc::new(Mutex::new(Sensor::new(eeprom, options)))
}

/// Its EEPROM as it is.
pub fn words(sensor: &Shared) -> [u16; WORDS] {
    *sensor.lock().unwrap().eeprom.words()
}

pub fn eeprom(sensor: &Shared) -> Eeprom {
    sensor.lock().unwrap().eeprom.clone()
}

/// The manufacturer's bits of all words are what they were.
pub fn assert_upper_bits(before: &[u16; WORDS], after: &[u16; WORDS]) {
    for (address, (before, after)) in before.iter().zip(after).enumerate() {
        assert_eq!(before >> 2, after >> 2, "word {address:02X}");
    }
}

pub fn bench<P: Protocol>(sensors: &[&Shared]) -> Bench<P> {
    let stations = sensors.iter().map(|sensor| station(sensor, Spoil::Nothing, Vec::new())).collect();
    on_line(super::quiet(), stations)
}

pub fn spoilt<P: Protocol>(sensor: &Shared, spoil: Spoil) -> Bench<P> {
    on_line(super::quiet(), vec![station(sensor, spoil, Vec::new())])
}

/// Without power in these intervals.
pub fn unplugged<P: Protocol>(sensor: &Shared, off: Vec<(Ns, Ns)>) -> Bench<P> {
    on_line(super::quiet(), vec![station(sensor, Spoil::Nothing, off)])
}

pub fn on_line<P: Protocol>(settings: SegmentSettings, stations: Vec<Station>) -> Bench<P> {
    Bench::new(Timing::isu(), settings, stations)
}

pub fn station(sensor: &Shared, spoil: Spoil, unplugged: Vec<(Ns, Ns)>) -> Station {
    let node = Box::new(Spoiler::new(Arc::clone(sensor), spoil));
    Station { name: "isu".to_owned(), node, faults: Faults { unplugged, ..Faults::default() } }
}

pub fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

pub fn module(number: u8) -> Module {
    Module::at(address(number)).unwrap()
}

//! Simulated sensors that stay in reach, and the truth.

use std::sync::{Arc, Mutex};

use clino_drivers::codec::angle::Angle;
use clino_segment::chance::Chance;
use clino_segment::{Faults, Noise, SegmentSettings, Station};
use clino_sim::latency::Latency;
use clino_sim::motion::Motion;
use clino_sim::node::Ns;
use clino_sim::{isu, t7};

use super::{Board, Model};

/// A T7 of which one clone is on the line.
pub type SharedT7 = Arc<Mutex<t7::T7>>;
/// An ISU of which one clone is on the line.
pub type SharedIsu = Arc<Mutex<isu::Isu>>;

/// A turn of 2° a second from −30° on.
pub const TURNING: Motion = Motion::Ramp { start: -30_000_000, rate: 2_000_000 };

/// A single-axis T7 that turns, as slow as its document allows.
pub fn t7(address: u8) -> SharedT7 {
    t7_with(address, turning())
}

/// What such a T7 is like.
pub fn turning() -> t7::Options {
    t7::Options { motion: [Motion::default(), Motion::default(), TURNING], ..Default::default() }
}

/// The same, answering after so long.
pub fn quick(latency: Ns) -> t7::Options {
    t7::Options { get_latency: Latency::fixed(latency), ..turning() }
}

/// A single-axis T7.
pub fn t7_with(address: u8, options: t7::Options) -> SharedT7 {
    let settings = t7::StoredSettings { address, ..Default::default() };
    let node = t7::T7::new(t7::Identity::default(), settings, options).expect("there are such T7s");
    Arc::new(Mutex::new(node))
}

/// An ISU, tilted by this many micro-degrees.
pub fn isu(address: u8, angle: i64) -> SharedIsu {
    let content = isu::Content { address, ..Default::default() };
    let eeprom = isu::Eeprom::factory(content, isu::ChecksumScope::default(), 1);
    let options = isu::Options { motion: Motion::Constant(angle), ..Default::default() };
    Arc::new(Mutex::new(isu::Isu::new(eeprom, options)))
}

/// A sensor on the line.
pub fn station(name: &str, node: impl clino_sim::node::Node + 'static) -> Station {
    Station { name: name.to_owned(), node: Box::new(node), faults: Faults::default() }
}

/// A quiet pair on which the master does not hear itself.
pub fn quiet() -> SegmentSettings {
    SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() }
}

/// A board with these T7s at 115200 bit/s.
pub fn t7_board(model: Model, sensors: &[&SharedT7]) -> Board {
    let stations = sensors.iter().map(|&sensor| station("t7", Arc::clone(sensor))).collect();
    Board::new(115_200, model, quiet(), stations)
}

/// A board with these ISUs at 9600 bit/s.
pub fn isu_board(model: Model, sensors: &[&SharedIsu]) -> Board {
    let stations = sensors.iter().map(|&sensor| station("isu", Arc::clone(sensor))).collect();
    Board::new(9_600, model, quiet(), stations)
}

/// Whether an angle is the true one, to the hundredth of a degree.
pub fn is_true(angle: Angle, truth: i64) -> bool {
    (i64::from(angle.udeg()) - truth).abs() < 10_000
}

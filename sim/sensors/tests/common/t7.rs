//! Makers of T7s and their commands.

use clino_sim::motion::Motion;
use clino_sim::t7::{Identity, Model, Options, StoredSettings, T7};

use super::{Bench, hex};

/// Factory settings at address 5.
pub fn settings() -> StoredSettings {
    StoredSettings { address: 5, ..StoredSettings::default() }
}

/// A device on a line.
pub fn make(model: Model, settings: StoredSettings, options: Options) -> Bench<T7> {
    Bench::new(T7::new(Identity { model, ..Identity::default() }, settings, options).unwrap())
}

/// A single-axis device at address 5.
pub fn bench() -> Bench<T7> {
    make(Model::T71, settings(), Options::default())
}

/// A device at address 5 at these angles in µ°.
pub fn turned(model: Model, angles: [i64; 3]) -> Bench<T7> {
    make(model, settings(), Options { motion: angles.map(Motion::Constant), ..Options::default() })
}

/// Completes a command with its checksum.
pub fn summed(command: &str) -> String {
    let sum = hex(command).iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    format!("{command} {:02X}", sum.wrapping_neg())
}

/// The status byte that a Set command is answered with.
pub fn status(bench: &mut Bench<T7>, command: &str) -> u8 {
    let answer = hex(&bench.ask(&summed(command)));
    let sum = answer.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    let [_, 3, code, status, _] = answer[..] else { panic!("{answer:02X?} is no Set answer") };
    assert_eq!((sum, code), (0, hex(command)[2]));
    status
}

//! The worked examples of "T7 Communication User Guide" 1.7, byte for byte as printed, unless noted.

mod common;

use clino_sim::motion::Motion;
use clino_sim::t7::{Direction, Identity, Model, Options, OutputRange, StoredSettings, T7};
use common::Bench;

/// A device at address 5 whose axes stand at these angles, in 0.001°.
fn device(model: Model, angles: [i64; 3]) -> T7 {
    let identity = Identity { model, product: *b"X4-1  ", ..Identity::default() };
    let settings = StoredSettings { address: 5, ..StoredSettings::default() };
    let options =
        Options { motion: angles.map(|angle| Motion::Constant(angle * 1000)), ..Options::default() };
    T7::new(identity, settings, options).unwrap()
}

fn with_settings(settings: StoredSettings) -> Bench<T7> {
    let identity = Identity { model: Model::T73, ..Identity::default() };
    Bench::new(T7::new(identity, StoredSettings { address: 5, ..settings }, Options::default()).unwrap())
}

#[test]
fn get_all_angles() {
    // The document prints length 0A and its checksum CC; the table's 10 makes it C6.
    let mut bench = Bench::new(device(Model::T73, [163_250, -45_320, 20_190]));
    assert_eq!(bench.ask("05 01 80"), "05 10 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC C6");
}

#[test]
fn get_all_angles_with_the_printed_length() {
    let identity = Identity { model: Model::T73, ..Identity::default() };
    let settings = StoredSettings { address: 5, ..StoredSettings::default() };
    let motion = [163_250_000, -45_320_000, 20_190_000].map(Motion::Constant);
    let options = Options { motion, length_quirk: true, ..Options::default() };
    let mut bench = Bench::new(T7::new(identity, settings, options).unwrap());
    assert_eq!(bench.ask("05 01 80"), "05 0A 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC CC");
}

#[test]
fn get_angle_of_each_axis() {
    let mut bench = Bench::new(device(Model::T73, [-45_313; 3]));
    assert_eq!(bench.ask("05 01 81"), "05 06 81 FF FF 4E FF 29");
    // The document repeats the answer of axis 0 here.
    assert_eq!(bench.ask("05 01 82"), "05 06 82 FF FF 4E FF 28");
    assert_eq!(bench.ask("05 01 83"), "05 06 83 FF FF 4E FF 27");
}

#[test]
fn single_axis_reports_zero_for_the_others() {
    let mut bench = Bench::new(device(Model::T71, [-45_313; 3]));
    assert_eq!(bench.ask("05 01 81"), "05 06 81 00 00 00 00 74");
    assert_eq!(bench.ask("05 01 82"), "05 06 82 00 00 00 00 73");
    assert_eq!(bench.ask("05 01 83"), "05 06 83 FF FF 4E FF 27");
}

#[test]
fn set_angle() {
    let mut bench = Bench::new(device(Model::T71, [0, 0, 33_333]));
    assert_eq!(bench.ask("05 07 84 02 00 00 29 04 41"), "05 03 84 00 74");
    assert_eq!(bench.node.angle_at(2, bench.now), 10_500);
    assert_eq!(bench.node.settings().offsets, [0, 0, 10_500 - 33_333]);
}

#[test]
fn get_all_angle_offsets() {
    let mut bench =
        with_settings(StoredSettings { offsets: [10_250, -45_450, 45_000], ..StoredSettings::default() });
    assert_eq!(bench.ask("05 01 85"), "05 0E 85 00 00 28 0A FF FF 4E 76 00 00 AF C8 FD");
}

#[test]
fn set_angle_offset() {
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 07 86 02 00 00 75 30 C7"), "05 03 86 00 72");
    assert_eq!(bench.node.settings().offsets, [0, 0, 30_000]);
}

#[test]
fn get_all_data() {
    let mut bench = Bench::new(device(Model::T73, [-1_655, -45_320, -167_066]));
    let answer = bench.ask("05 01 87");
    // The example's accelerations do not follow from its angles; those 12 bytes have a test of their own.
    let (head, rest) = answer.split_at(17 * 3);
    let (_, tail) = rest.split_at(12 * 3);
    assert_eq!(head, "05 20 87 FF FF F9 89 FF FF 4E F8 FF FD 73 66 08 FC ");
    assert!(tail.starts_with("00 00 61 C9 "), "{tail}");
    let sum = common::hex(&answer).iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    assert_eq!((answer.len(), sum), (34 * 3 - 1, 0));
}

#[test]
fn get_all_directions() {
    let directions = [Direction::Normal, Direction::Normal, Direction::Reversed];
    let mut bench = with_settings(StoredSettings { directions, ..StoredSettings::default() });
    assert_eq!(bench.ask("05 01 88"), "05 05 88 00 00 01 6D");
}

#[test]
fn set_direction() {
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 04 89 02 01 6B"), "05 03 89 00 6F");
    assert_eq!(bench.node.settings().directions[2], Direction::Reversed);
}

#[test]
fn get_damping() {
    let mut bench = with_settings(StoredSettings { damping_ms: 1000, ..StoredSettings::default() });
    assert_eq!(bench.ask("05 01 8A"), "05 04 8A 03 E8 82");
}

#[test]
fn set_damping() {
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 04 8B 01 F4 77"), "05 03 8B 00 6D");
    assert_eq!(bench.node.settings().damping_ms, 500);
}

#[test]
fn get_angle_output_range() {
    // The document prints length 02 for a message of one byte; the table says 01.
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 01 8C"), "05 03 8C 00 6C");
}

#[test]
fn set_angle_output_range() {
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 03 8D 01 6A"), "05 03 8D 00 6B");
    assert_eq!(bench.node.settings().range, OutputRange::Unidirectional);
}

#[test]
fn get_device_information() {
    let mut bench = Bench::new(device(Model::T71, [0; 3]));
    let printed = "05 14 8E 00 00 61 C9 30 2E 33 32 20 20 58 34 2D 31 20 20 00 2C D6";
    assert_eq!(bench.ask("05 01 8E"), printed);
}

#[test]
fn set_baud_rate() {
    let mut bench = with_settings(StoredSettings::default());
    assert_eq!(bench.ask("05 03 8F 04 65"), "05 03 8F 00 69");
    assert_eq!(bench.node.settings().baud_index, 4);
}

#[test]
fn set_address() {
    let mut bench = Bench::new(device(Model::T71, [0; 3]));
    assert_eq!(bench.ask("05 08 91 04 00 00 61 C9 01 33"), "05 03 91 00 67");
    assert_eq!(bench.ask("05 01 8C"), "", "the old address is gone");
    assert_eq!(bench.ask("01 01 8C"), "01 03 8C 00 70");
}

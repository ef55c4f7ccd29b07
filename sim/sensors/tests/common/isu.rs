//! Makers of ISUs and their commands.

use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu, Options};

use super::{Bench, SECOND};

/// Read RAM 58H, 2 bytes, at address 3.
pub const READ_ANGLE: [u8; 5] = [0x03, 0x34, 0x58, 0x02, 0x8E];

/// A module at an address, on a line.
pub fn at_address(address: u8, options: Options) -> Bench<Isu> {
    let eeprom = Eeprom::factory(Content { address, ..Content::default() }, ChecksumScope::default(), 1);
    Bench::new(Isu::new(eeprom, options))
}

/// A module at address 3.
pub fn bench(options: Options) -> Bench<Isu> {
    at_address(3, options)
}

/// A whole message from its length byte and body.
pub fn summed(length: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![length];
    bytes.extend_from_slice(body);
    bytes.push(body.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
    bytes
}

/// Read RAM 58H, 2 bytes.
pub fn read_angle(address: u8) -> Vec<u8> {
    summed(3, &[address << 4 | 4, 0x58, 2])
}

/// Reads the angle at address 3, in 360/65536 °.
pub fn angle(bench: &mut Bench<Isu>) -> u16 {
    let answer = bench.ask_within(&READ_ANGLE, SECOND).expect("an answer").bytes;
    let [4, 0x35, 0x58, high, low, _] = answer[..] else { panic!("{answer:02X?}") };
    u16::from_be_bytes([high, low])
}

//! A sniffer accounts for every byte, and an exchange after silence is understood whatever came before.
#![no_main]

use clino_codec::character::Character;
use clino_codec::checks::Checks;
use clino_codec::t7::{SniffProgress, Sniffed, Sniffer};
use libfuzzer_sys::fuzz_target;

/// Get Angle for axis 2 and its answer: T7 guide §2.1.4.
const EXCHANGE: [u8; 11] = [0x05, 0x01, 0x83, 0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];

fuzz_target!(|bytes: &[u8]| {
    let mut sniffer = Sniffer::new(Checks::ALL);
    for &byte in bytes {
        let _ = sniffer.push(Character::clean(byte));
    }
    while sniffer.idle() != SniffProgress::More {}
    assert!(sniffer.discarded() as usize <= bytes.len());
    let mut seen = Vec::new();
    for byte in EXCHANGE {
        match sniffer.push(Character::clean(byte)) {
            SniffProgress::More => {}
            SniffProgress::Frame(message) => seen.push(message),
            SniffProgress::Bad(error) => panic!("{error}"),
        }
    }
    assert!(matches!(seen[..], [Sniffed::Command(_), Sniffed::Answer { to: Some(_), .. }]));
});

//! The worked examples and message tables of "Interfacing to an ISU Module", byte for byte.

mod common;

use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu, Mode, Options};
use clino_sim::motion::Motion;
use common::Bench;

/// A module as it comes from the factory (address 0), standing at an angle in µ°.
fn module(angle: i64) -> Bench<Isu> {
    let eeprom = Eeprom::factory(Content::default(), ChecksumScope::default(), 1);
    Bench::new(Isu::new(eeprom, Options { motion: Motion::Constant(angle), ..Options::default() }))
}

#[test]
fn reading_an_angle_value() {
    // [DB1·256 + DB0]·360/65536: 4000H is 90°, and the checksum is 05 + 58 + 40.
    assert_eq!(module(90_000_000).ask("03 04 58 02 5E"), "04 05 58 40 00 9D");
    assert_eq!(module(-1_000_000).ask("03 04 58 02 5E"), "04 05 58 FF 4A A6");
}

#[test]
fn setting_an_alternate_null_reference_point() {
    let mut bench = module(90_000_000);
    assert_eq!(bench.ask("01 0C 0C"), "01 0D 0D");
    assert_eq!(bench.node.eeprom.null(), 0x4000);
    bench.run_for(600_000_000);
    assert_eq!(bench.ask("03 04 58 02 5E"), "04 05 58 00 00 5D");
}

#[test]
fn setting_the_module_address() {
    let mut bench = module(0);
    for (address, word) in [(0x48, 0xA5A4), (0x49, 0x1234)] {
        bench.node.eeprom.set_word(address, word);
    }
    // Step 1: read the two words; step 2: address 7 (0111) is 01 and 11 in the low bits.
    assert_eq!(bench.ask("03 08 48 02 52"), "06 09 48 A5 A4 12 34 E0");
    assert_eq!(bench.ask("06 0A 48 A5 A5 12 37 E5"), "03 0B 48 02 55");
    assert_eq!(bench.node.eeprom.address(), 7);
    // Step 3: the eight words of the checksum; the answer's length is 18.
    let answer = bench.ask("03 08 78 08 88");
    assert!(answer.starts_with("12 09 78 ") && answer.len() == 20 * 3 - 1, "{answer}");
    let words: Vec<String> = (0x78..=0x7F).map(|a| format!("{:04X}", bench.node.eeprom.word(a))).collect();
    assert_eq!(answer[9..56].replace(' ', ""), words.concat());
    let write = "12 0A 78 00 01 00 02 00 03 00 04 00 05 00 06 00 07 00 08 A6";
    assert_eq!(bench.ask(write), "03 0B 78 08 8B");
    assert_eq!(
        (0x78..=0x7F).map(|a| bench.node.eeprom.word(a)).collect::<Vec<_>>(),
        [1, 2, 3, 4, 5, 6, 7, 8]
    );
}

#[test]
fn table_of_the_module_address_word() {
    // 48H b7,b6; 49H b5,b4; 4AH b3,b2; 4BH b1,b0; (4CH b15,b14); 4DH b13,b12; 4EH b11,b10; 4FH b9,b8.
    let mut eeprom = Eeprom::factory(Content::default(), ChecksumScope::default(), 1);
    for (i, pair) in [0b01, 0b10, 0b11, 0b00, 0b10, 0b00, 0b11, 0b01].into_iter().enumerate() {
        eeprom.set_word(0x48 + i as u8, 0xFFFC | pair);
    }
    assert_eq!(eeprom.data(0x48), 0b1000_1101_0110_1100);
    assert_eq!(eeprom.address(), 0b0110);
}

#[test]
fn error_messages() {
    let mut bench = module(0);
    assert_eq!(bench.ask("01 0E 0E"), "01 FF FF", "invalid function code");
    assert_eq!(bench.ask("03 04 58 02 5F"), "01 FD FD", "invalid checksum");
    let word = bench.node.eeprom.word(0);
    bench.node.eeprom.set_word(0, word ^ 0x8000);
    assert_eq!(bench.ask("01 02 02"), "01 03 03", "reset");
    bench.run_for(1_000_000_000);
    assert_eq!(bench.node.mode(), Mode::HardError);
    assert_eq!(bench.ask("03 04 58 02 5E"), "02 F1 04 F5", "hardware error state");
}

#[test]
fn remaining_functions_of_appendix_a() {
    let mut bench = module(0);
    assert_eq!(bench.ask("01 00 00"), "01 01 01", "go to soft error state");
    assert_eq!(bench.node.mode(), Mode::Normal, "no effect unless in the Hard Error state");
    assert_eq!(bench.ask("04 06 20 AB CD 9E"), "03 07 20 AB D2", "write RAM");
    assert_eq!(bench.ask("03 04 20 02 26"), "04 05 20 AB CD 9D");
}

#[test]
fn ascii_examples() {
    for (angle, line) in [
        (124_500_000, "+124.50\r\n"),
        (32_700_000, "+ 32.70\r\n"),
        (9_380_000, "+  9.38\r\n"),
        (-4_310_000, "-  4.31\r\n"),
        (-179_990_000, "-179.99\r\n"),
        (-180_000_000, "-180.00\r\n"),
        (179_999_000, "-180.00\r\n"),
        (179_994_000, "+179.99\r\n"),
        (-1_000, "+  0.00\r\n"),
        (-6_000, "-  0.01\r\n"),
    ] {
        let mut bench = module(angle);
        bench.node_level(false);
        bench.run_for(200_000_000);
        bench.node_level(true);
        assert_eq!(String::from_utf8(bench.bursts[0].bytes.clone()).unwrap(), line, "{angle}");
    }
}

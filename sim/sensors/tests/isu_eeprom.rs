//! An ISU's memories, its checksum supervision and its error states ("Interfacing to an ISU Module",
//! sections 4, 6, 7).

mod common;

use clino_sim::isu::{Adoption, ChecksumScope, Content, Eeprom, Isu, Mode, Options, Supervision};
use clino_sim::motion::Motion;
use common::isu::{READ_ANGLE, angle, bench, read_angle, summed};
use common::{Bench, MS, SECOND, US};

#[test]
fn null_position_is_subtracted_with_the_next_angle() {
    let eeprom = Eeprom::factory(
        Content { address: 3, null: 0xC000, ..Content::default() },
        ChecksumScope::default(),
        1,
    );
    let options = Options { motion: Motion::Constant(90_000_000), ..Options::default() };
    let mut bench = Bench::new(Isu::new(eeprom, options));
    assert_eq!(angle(&mut bench), 0x8000);
    assert_eq!(bench.ask("01 3C 3C"), "01 3D 3D");
    assert_eq!(angle(&mut bench), 0x8000, "until there is a new angle");
    bench.run_for(534 * MS);
    assert_eq!(angle(&mut bench), 0);
    assert_eq!((bench.node.eeprom.null(), bench.node.eeprom.is_sound()), (0x4000, true));
    bench.power_cycle(MS, SECOND);
    assert_eq!(angle(&mut bench), 0, "the null position survives");
}

#[test]
fn reading_eeprom_of_the_longest_answer() {
    let mut bench = bench(Options::default());
    let answer = bench.ask_within(&summed(3, &[0x38, 0xF0, 126]), SECOND).unwrap().bytes;
    assert_eq!((answer.len(), answer[0]), (256, 254));
    let first = u16::from_be_bytes([answer[3], answer[4]]);
    let wrapped = u16::from_be_bytes([answer[3 + 32], answer[4 + 32]]);
    assert_eq!((first, wrapped), (bench.node.eeprom.word(0xF0), bench.node.eeprom.word(0x00)));
    assert_eq!(bench.ask_within(&summed(3, &[0x38, 0, 127]), SECOND), None);
}

#[test]
fn eeprom_words_take_time_and_the_answer_waits_for_them() {
    let mut bench = bench(Options::default());
    let sent = bench.send(&summed(6, &[0x3A, 0x10, 1, 2, 3, 4]));
    bench.run_until(sent + 10 * MS - 10 * US);
    assert_ne!(bench.node.eeprom.word(0x10), 0x0102);
    bench.run_until(sent + 10 * MS + 10 * US);
    assert_eq!(bench.node.eeprom.word(0x10), 0x0102);
    assert_ne!(bench.node.eeprom.word(0x11), 0x0304);
    bench.run_for(SECOND);
    assert_eq!(bench.node.eeprom.word(0x11), 0x0304);
    assert!(bench.bursts[0].drive_at.abs_diff(sent + 20 * MS) <= 2 * US);
}

/// Writes address 9 into the EEPROM by the document's steps, checksum included.
fn change_address(bench: &mut Bench<Isu>) {
    let old = bench.node.eeprom.clone();
    let data = [old.word(0x48) & !3 | 0b10, old.word(0x49) & !3 | 0b01];
    let checksum = data
        .iter()
        .fold(old.data(0x78), |sum, word| sum.wrapping_add(*word))
        .wrapping_sub(old.word(0x48))
        .wrapping_sub(old.word(0x49));
    let mut write = vec![0x0A, 0x48];
    write.extend(data.iter().flat_map(|word| word.to_be_bytes()));
    assert!(bench.ask_within(&summed(6, &write), SECOND).is_some());
    let mut write = vec![0x0A, 0x78];
    for (i, shift) in [6, 4, 2, 0, 14, 12, 10, 8].into_iter().enumerate() {
        write.extend((old.word(0x78 + i as u8) & !3 | checksum >> shift & 3).to_be_bytes());
    }
    assert!(bench.ask_within(&summed(18, &write), SECOND).is_some());
}

#[test]
fn incremental_checksum_holds_under_both_readings() {
    for scope in [ChecksumScope::UpperBitsCounted, ChecksumScope::WordsLeftOut] {
        for seed in 0..20 {
            let eeprom = Eeprom::factory(Content { address: 3, ..Content::default() }, scope, seed);
            assert!(eeprom.is_sound());
            let mut bench = Bench::new(Isu::new(eeprom, Options::default()));
            change_address(&mut bench);
            assert!(bench.node.eeprom.is_sound());
            bench.power_cycle(MS, SECOND);
            assert_eq!((bench.node.mode(), bench.node.address()), (Mode::Normal, 9));
        }
    }
}

#[test]
fn the_two_readings_of_the_checksum_differ() {
    let make = |scope| Eeprom::factory(Content::default(), scope, 1);
    let (counted, left_out) = (make(ChecksumScope::UpperBitsCounted), make(ChecksumScope::WordsLeftOut));
    let upper = (0x78..=0x7F).fold(0, |sum: u16, a| sum.wrapping_add(counted.word(a) & 0xFFFC));
    assert_ne!(upper, 0);
    assert_eq!(counted.data(0x78), left_out.data(0x78).wrapping_add(upper));
    let rest = (0..=255u8)
        .filter(|a| !(0x78..=0x7F).contains(a))
        .fold(0, |sum: u16, a| sum.wrapping_add(left_out.word(a)));
    assert_eq!(left_out.data(0x78), rest);
}

#[test]
fn new_address_acts_at_once_or_after_reset() {
    for (adoption, before_reset) in [(Adoption::AtOnce, 9), (Adoption::AfterReset, 3)] {
        let mut bench = bench(Options { adoption, ..Options::default() });
        change_address(&mut bench);
        assert_eq!(bench.node.address(), before_reset);
        assert!(bench.ask_within(&read_angle(before_reset), SECOND).is_some());
        assert!(bench.ask_within(&summed(1, &[before_reset << 4 | 2]), SECOND).is_some(), "reset");
        bench.run_for(SECOND);
        assert!(bench.ask_within(&read_angle(9), SECOND).is_some());
        assert!(bench.ask_within(&read_angle(3), SECOND).is_none());
    }
}

#[test]
fn hard_error_soft_error_repair() {
    let mut bench = bench(Options::default());
    let good = bench.node.eeprom.word(0xA0);
    assert_eq!(bench.ask("04 3A A0 00 00 DA"), "03 3B A0 01 DC", "one word spoils the sum");
    assert_eq!(bench.node.mode(), Mode::Normal, "no check before the reset");
    assert_eq!(bench.ask("01 32 32"), "01 33 33");
    bench.run_for(SECOND);
    for command in [&READ_ANGLE[..], &summed(1, &[0x32]), &summed(3, &[0x38, 0, 1]), &summed(1, &[0x3C])] {
        let answer = bench.ask_within(command, SECOND).unwrap().bytes;
        assert_eq!(answer, summed(2, &[0xF1, command[1]]));
    }
    assert_eq!(bench.ask("01 30 30"), "01 31 31");
    assert_eq!(bench.node.mode(), Mode::SoftError);
    // Everything answers normally, but nothing is measured, and nothing counts as told.
    assert_eq!(angle(&mut bench), 0);
    assert_eq!(bench.ask("01 3C 3C"), "01 3D 3D");
    assert_eq!(bench.node.said().iter().count(), 0);
    let [high, low] = good.to_be_bytes();
    assert!(bench.ask_within(&summed(4, &[0x3A, 0xA0, high, low]), SECOND).is_some());
    assert_eq!(bench.node.mode(), Mode::SoftError);
    assert_eq!(bench.ask("01 32 32"), "01 33 33");
    bench.run_for(SECOND);
    assert_eq!(bench.node.mode(), Mode::Normal);
}

#[test]
fn continuous_supervision_notices_without_a_reset() {
    let mut bench = bench(Options { supervision: Supervision::Continuous, ..Options::default() });
    assert_eq!(bench.ask("04 3A A0 00 00 DA"), "03 3B A0 01 DC");
    bench.run_for(534 * MS);
    assert_eq!(bench.ask("03 34 58 02 8E"), "02 F1 34 25");
}

#[test]
fn reset_takes_its_time_and_clears_ram() {
    let mut bench = bench(Options::default());
    assert_eq!(bench.ask("04 36 20 AB CD CE"), "03 37 20 AB 02");
    assert_eq!(bench.ask("01 32 32"), "01 33 33");
    assert_eq!(bench.ask_within(&READ_ANGLE, 10 * MS), None, "still starting");
    bench.run_for(100 * MS);
    assert_eq!(bench.ask("03 34 20 02 56"), "04 35 20 00 00 55");
}

#[test]
fn continuous_supervision_sees_the_memory_between_two_words() {
    for (phase, mode) in [(23 * MS, Mode::HardError), (33 * MS, Mode::Normal)] {
        let options = Options { supervision: Supervision::Continuous, phase, ..Options::default() };
        let mut bench = bench(options);
        // The words are stored at 18 and 28 ms; their sum stays what it was.
        let words = [bench.node.eeprom.word(0x10) ^ 1, bench.node.eeprom.word(0x11)];
        let moved = bench.node.eeprom.word(0x10).wrapping_sub(words[0]);
        let [[a, b], [c, d]] = [words[0], words[1].wrapping_add(moved)].map(u16::to_be_bytes);
        bench.send(&summed(6, &[0x3A, 0x10, a, b, c, d]));
        bench.run_until(SECOND);
        assert!(bench.node.eeprom.is_sound());
        assert_eq!(bench.node.mode(), mode);
    }
}

#[test]
fn an_invalid_angle_is_a_hard_error_that_a_reset_does_not_cure() {
    let mut bench = bench(Options::default());
    bench.node.no_valid_angle = true;
    bench.run_for(534 * MS);
    assert_eq!(bench.ask("03 34 58 02 8E"), "02 F1 34 25");
    assert!(bench.node.eeprom.is_sound());
    bench.power_cycle(SECOND, SECOND);
    assert_eq!(bench.node.mode(), Mode::HardError);
    assert_eq!(bench.ask("01 30 30"), "01 31 31");
    bench.run_for(SECOND);
    assert_eq!(bench.node.mode(), Mode::SoftError);
    bench.node.no_valid_angle = false;
    bench.run_for(SECOND);
    assert_eq!(bench.node.mode(), Mode::SoftError, "it leaves that state by a reset only");
    assert_eq!(bench.ask("01 32 32"), "01 33 33");
    bench.run_for(SECOND);
    assert_eq!(bench.node.mode(), Mode::Normal);
}

#[test]
fn every_word_written_counts_the_same_value_included() {
    let mut bench = bench(Options::default());
    change_address(&mut bench);
    let changed = bench.node.writes();
    assert_eq!(changed, 2 + 8, "two words of the address, eight of the checksum");
    let [high, low] = bench.node.eeprom.word(0x48).to_be_bytes();
    let address = bench.node.address();
    bench.ask_within(&summed(4, &[address << 4 | 0xA, 0x48, high, low]), SECOND).expect("an answer");
    assert_eq!(bench.node.writes(), changed + 1);
    bench.ask_within(&read_angle(address), SECOND).expect("an answer");
    assert_eq!(bench.node.writes(), changed + 1);
}

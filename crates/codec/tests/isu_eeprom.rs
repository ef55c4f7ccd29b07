//! ISU EEPROM: packing, audit and plans; the document's gaps I4–I9.

use clino_codec::angle::Angle;
use clino_codec::isu::eeprom::{
    Audit, Change, ChecksumReading, DataWord, Image, Plan, PlanError, PlannedWrite, ShutoffBit, pack, unpack,
};
use clino_codec::isu::{Address, Request, Words};

/// Where each bit of a data word lies: (word, bit), from the surviving list of §7. Index is the bit's number.
const PLACES: [(usize, u32); 16] = [
    (3, 0),
    (3, 1),
    (2, 0),
    (2, 1),
    (1, 0),
    (1, 1),
    (0, 0),
    (0, 1), // b0…b7: 4B, 4A, 49, 48
    (7, 0),
    (7, 1),
    (6, 0),
    (6, 1),
    (5, 0),
    (5, 1),
    (4, 0),
    (4, 1), // b8…b15: 4F, 4E, 4D, 4C
];

/// Some manufacturer's content, the same in every run, different in every word.
fn manufacturer(address: usize) -> u16 {
    (address as u32).wrapping_mul(40_503).wrapping_add(12_345) as u16
}

fn set(words: &mut [u16; 256], start: usize, data: u16) {
    for (bit, (word, position)) in PLACES.into_iter().enumerate() {
        let slot = &mut words[start + word];
        *slot = *slot & !(1 << position) | (data >> bit & 1) << position;
    }
}

fn get(words: &[u16; 256], start: usize) -> u16 {
    PLACES
        .iter()
        .enumerate()
        .map(|(bit, (word, position))| (words[start + word] >> position & 1) << bit)
        .sum()
}

/// The checksum in both readings, summed the long way.
fn sums(words: &[u16; 256]) -> (u16, u16) {
    let (mut upper_bits_counted, mut words_left_out) = (0_u64, 0_u64);
    for (address, &word) in words.iter().enumerate() {
        if (0x78..=0x7F).contains(&address) {
            upper_bits_counted += u64::from(word) / 4 * 4;
        } else {
            upper_bits_counted += u64::from(word);
            words_left_out += u64::from(word);
        }
    }
    ((upper_bits_counted % 65_536) as u16, (words_left_out % 65_536) as u16)
}

/// A module's EEPROM with a checksum that is right in that reading.
fn sound(reading: ChecksumReading) -> [u16; 256] {
    let mut words = std::array::from_fn(manufacturer);
    set(&mut words, 0x48, 0xA5_3C);
    set(&mut words, 0xD0, 0x4000);
    let (upper_bits_counted, words_left_out) = sums(&words);
    let checksum = match reading {
        ChecksumReading::UpperBitsCounted => upper_bits_counted,
        ChecksumReading::WordsLeftOut => words_left_out,
    };
    set(&mut words, 0x78, checksum);
    words
}

const READINGS: [ChecksumReading; 2] = [ChecksumReading::UpperBitsCounted, ChecksumReading::WordsLeftOut];

// I4
#[test]
fn every_bit_of_a_data_word_lies_where_the_list_says() {
    for (bit, (word, position)) in PLACES.into_iter().enumerate() {
        let mut words = [0; 8];
        words[word] = 1 << position;
        assert_eq!(unpack(words), 1 << bit);
        assert_eq!(pack([0; 8], 1 << bit), words);
    }
}

#[test]
fn packing_all_65536_data_words_keeps_the_upper_bits() {
    let before: [u16; 8] = std::array::from_fn(manufacturer);
    for data in 0..=u16::MAX {
        let packed = pack(before, data);
        assert_eq!(unpack(packed), data);
        for (after, before) in packed.iter().zip(before) {
            assert_eq!(after >> 2, before >> 2);
        }
    }
}

// I5
#[test]
fn the_documented_data_words_are_found() {
    let mut words = sound(ChecksumReading::WordsLeftOut);
    set(&mut words, 0x50, 0x0081);
    let image = Image::new(words);
    assert_eq!(image.words(), &words);
    assert_eq!(image.module_address(), Address::new(3).unwrap());
    assert_eq!(image.null_position(), Angle::from_udeg(90_000_000));
    assert_eq!(image.data(DataWord::AutoShutoff), 0x0081);
    assert_eq!(image.data(DataWord::Checksum), get(&words, 0x78));
    assert_eq!(image.word(0xFF), words[255]);
    let starts = [DataWord::ModuleAddress, DataWord::AutoShutoff, DataWord::Checksum, DataWord::NullPosition];
    assert_eq!(starts.map(DataWord::start), [0x48, 0x50, 0x78, 0xD0]);
}

#[test]
fn an_image_is_put_together_from_what_is_read() {
    let words = sound(ChecksumReading::WordsLeftOut);
    let mut image = Image::new([0; 256]);
    for start in (0..=255).step_by(16) {
        let read = Words::new(&words[start..start + 16]).unwrap();
        image.fill(start as u8, read.iter());
    }
    assert_eq!(image, Image::new(words));
    image.fill(0xFF, [7, 8]);
    assert_eq!(image.word(0xFF), 7);
}

// I7
#[test]
fn the_audit_computes_both_readings() {
    for reading in READINGS {
        let words = sound(reading);
        let (upper_bits_counted, words_left_out) = sums(&words);
        let audit = Image::new(words).audit();
        assert_eq!(audit, Audit { stored: get(&words, 0x78), upper_bits_counted, words_left_out });
        assert_eq!(audit.only_reading(), Some(reading));
        assert!(audit.is_sound());
        assert_eq!(READINGS.map(|other| audit.holds(other)), READINGS.map(|other| other == reading));
    }
    let blank = Image::new([0; 256]).audit();
    assert_eq!((blank.is_sound(), blank.only_reading()), (true, None));
    let mut damaged = sound(ChecksumReading::WordsLeftOut);
    damaged[0] = damaged[0].wrapping_add(1);
    let audit = Image::new(damaged).audit();
    assert_eq!((audit.is_sound(), audit.only_reading()), (false, None));
}

/// Makes a change on a copy and checks all that must hold of it. Returns the writes.
fn change(words: [u16; 256], change: Change, start: usize, data: u16) -> Vec<PlannedWrite> {
    let before = Image::new(words);
    let plan = Plan::change(&before, change).unwrap();
    let mut after = before.clone();
    plan.apply(&mut after);
    assert_eq!(get(after.words(), start), data);
    // Still right in the reading in which it was right before.
    for reading in READINGS {
        assert!(!before.audit().holds(reading) || after.audit().holds(reading), "{reading:?}");
    }
    // Nothing but the user's two bits, and nothing outside the two data words.
    for (address, (&old, &new)) in before.words().iter().zip(after.words()).enumerate() {
        assert_eq!(old >> 2, new >> 2);
        let ours = (start..start + 8).contains(&address) || (0x78..0x80).contains(&address);
        assert!(ours || old == new, "{address:02X}");
    }
    for write in plan.writes() {
        let first = usize::from(write.start());
        assert_eq!(write.before(), &words[first..first + write.before().len()]);
        let request =
            Request::WriteEeprom { start: write.start(), words: Words::new(write.words()).unwrap() };
        assert_eq!(write.request(), request);
        assert!(request.encode(Address::ANY).is_ok());
        let count = write.words().len() as u8;
        assert_eq!(write.read_back(), Request::ReadEeprom { start: write.start(), count });
    }
    plan.writes().to_vec()
}

// I5, I8
#[test]
fn the_address_is_changed_in_words_48_and_49_then_the_checksum() {
    for reading in READINGS {
        let words = sound(reading);
        for number in (0..15).filter(|&number| number != 3) {
            let wish = Change::ModuleAddress(Address::new(number).unwrap());
            let data = 0xA5_0C | u16::from(number) << 4;
            let writes = change(words, wish, 0x48, data);
            let runs: Vec<_> = writes.iter().map(|write| (write.start(), write.words().len())).collect();
            // Changing both words by opposite amounts leaves the checksum as it is.
            assert!(runs == [(0x48, 2), (0x78, 8)] || runs == [(0x48, 2)], "{runs:02X?}");
        }
    }
}

#[test]
fn the_null_position_takes_eight_words() {
    let writes = change(sound(ChecksumReading::UpperBitsCounted), Change::NullPosition(0xBEEF), 0xD0, 0xBEEF);
    assert_eq!((writes[0].start(), writes[0].words().len()), (0xD0, 8));
}

// I6
#[test]
fn auto_shutoff_is_changed_in_the_bit_that_the_caller_names() {
    for (bit, word, mask) in
        [(ShutoffBit::Bit0, 0x53, 1), (ShutoffBit::Bit1, 0x53, 2), (ShutoffBit::Bit7, 0x50, 0x80)]
    {
        let mut words = sound(ChecksumReading::WordsLeftOut);
        let now = get(&words, 0x50);
        let on = change(words, Change::AutoShutoff { bit, enabled: true }, 0x50, now | mask);
        let off = change(words, Change::AutoShutoff { bit, enabled: false }, 0x50, now & !mask);
        // One of the two changes something; it is this one word.
        assert_eq!(on.len() + off.len(), 2);
        let changing = if on.is_empty() { off } else { on };
        assert_eq!((changing[0].start(), changing[0].words().len()), (word, 1));
        // The same wish on the result asks for nothing.
        let wish = Change::AutoShutoff { bit, enabled: now & mask == 0 };
        let mut image = Image::new(words);
        Plan::change(&image, wish).unwrap().apply(&mut image);
        words = *image.words();
        assert!(change(words, wish, 0x50, now ^ mask).is_empty());
    }
}

#[test]
fn what_is_already_so_is_not_written() {
    let image = Image::new(sound(ChecksumReading::WordsLeftOut));
    for wish in [Change::ModuleAddress(Address::new(3).unwrap()), Change::NullPosition(0x4000)] {
        assert!(Plan::change(&image, wish).unwrap().writes().is_empty());
    }
}

#[test]
fn a_change_that_leaves_the_sum_alone_leaves_the_checksum_alone() {
    // From 0001 to 0100 in address bits: 48 grows by one, 49 shrinks by one.
    let mut words = [0; 256];
    set(&mut words, 0x48, 0x0010);
    let (sum, _) = sums(&words);
    set(&mut words, 0x78, sum);
    let writes = change(words, Change::ModuleAddress(Address::new(4).unwrap()), 0x48, 0x0040);
    assert_eq!(writes.len(), 1);
}

#[test]
fn an_unsound_image_is_not_changed() {
    let mut words = sound(ChecksumReading::WordsLeftOut);
    words[0x20] ^= 0x0100;
    let image = Image::new(words);
    let refusal = Plan::change(&image, Change::NullPosition(1)).unwrap_err();
    assert_eq!(refusal, PlanError::UnsoundChecksum(image.audit()));
    let Audit { stored, upper_bits_counted, words_left_out } = image.audit();
    assert_eq!(
        refusal.to_string(),
        format!("EEPROM checksum {stored:04X} is neither {upper_bits_counted:04X} nor {words_left_out:04X}")
    );
}

#[test]
fn the_reserved_address_is_not_given() {
    let image = Image::new(sound(ChecksumReading::WordsLeftOut));
    let refusal = Plan::change(&image, Change::ModuleAddress(Address::RESERVED)).unwrap_err();
    assert_eq!(refusal, PlanError::ReservedAddress);
    assert_eq!(refusal.to_string(), "address 15 is reserved");
}

// I9
#[test]
fn a_write_sequence_cut_after_any_word_can_be_repaired() {
    for reading in READINGS {
        let words = sound(reading);
        let plan =
            Plan::change(&Image::new(words), Change::ModuleAddress(Address::new(13).unwrap())).unwrap();
        let steps: Vec<(u8, u16)> = plan
            .writes()
            .iter()
            .flat_map(|write| (write.start()..).zip(write.words().iter().copied()))
            .collect();
        assert_eq!(steps.len(), 10);
        for cut in 0..=steps.len() {
            let mut image = Image::new(words);
            steps[..cut].iter().for_each(|&(address, word)| image.fill(address, [word]));
            Plan::repair(&image, reading).apply(&mut image);
            assert!(image.audit().holds(reading), "cut after {cut}");
            assert!(Plan::repair(&image, reading).writes().is_empty());
            let finished = Plan::change(&image, Change::ModuleAddress(Address::new(13).unwrap())).unwrap();
            finished.apply(&mut image);
            assert_eq!(image.module_address().get(), 13);
            assert!(image.audit().holds(reading));
            for (&old, &new) in words.iter().zip(image.words()) {
                assert_eq!(old >> 2, new >> 2);
            }
        }
    }
}

//! Whatever is in the flash, and in the memory that survives a reset: a start comes up, and what is saved then is found
//! again. Where words have changed that should be free, a save goes behind them; where there are too many it fails and says
//! so, and the next one goes on.
//!
//! Input: the words of the journal and how it is told from a spoilt one, then what happens to the flash, step by step; all
//! of it read by `arbitrary`'s rules for plain numbers.
#![no_main]

#[path = "../../crates/storage/tests/support/mod.rs"]
mod support;

use std::collections::BTreeSet;

use clino_recovery::{Journal, ResetSource, WORDS};
use clino_storage::{FlashError, Loaded, SaveError, Store};
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use support::configurations::{Configuration, factory, longest, numbered};
use support::flash::Flash;
use support::other::{self, put};

fuzz_target!(|input: &[u8]| {
    let mut input = Unstructured::new(input);
    _ = journal(&mut input);
    let mut flash = Flash::new();
    while !input.is_empty() && change(&mut flash, &mut input).is_ok() {}
    flash.power_on();
    start(&mut flash);
});

/// Whatever the memory holds, there is a start, and what it leaves is read by the next one.
fn journal(input: &mut Unstructured<'_>) -> Result<()> {
    let mut words: [u32; WORDS] = input.arbitrary()?;
    let seal: bool = input.arbitrary()?;
    if seal {
        let (last, before) = words.split_last_mut().unwrap();
        before[0] = Journal::default().to_words()[0];
        *last = !before.iter().flat_map(|word| word.to_le_bytes()).fold(!0, crc);
    }
    let found = Journal::from_words(&words);
    assert!(!seal || found.is_some());
    let (journal, start) = Journal::begin(found, reset(input.arbitrary()?), input.arbitrary()?);
    assert_eq!(Journal::from_words(&journal.to_words()), Some(journal));
    if let Some(crash) = start.crash {
        _ = (crash.file(), crash.line(), crash.task());
    }
    Ok(())
}

/// CRC-32 of IEEE 802.3, a byte more; before its end.
fn crc(crc: u32, byte: u8) -> u32 {
    (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
}

fn reset(number: u8) -> ResetSource {
    match number % 6 {
        0 => ResetSource::PowerOn,
        1 => ResetSource::Software,
        2 => ResetSource::Watchdog,
        3 => ResetSource::Pin,
        4 => ResetSource::BrownOut,
        _ => ResetSource::Unknown,
    }
}

/// Something happens to the flash.
fn change(flash: &mut Flash, input: &mut Unstructured<'_>) -> Result<()> {
    match input.arbitrary::<u8>()? % 8 {
        0 => save(flash, &numbered(u32::from(input.arbitrary::<u8>()?))),
        1 => save(flash, &longest(u32::from(input.arbitrary::<u8>()?))),
        2 => _ = Store::new(flash).factory_reset(),
        // The power will be cut.
        3 => flash.cut_after(input.arbitrary::<u16>()?.into(), input.arbitrary::<u8>()?.into()),
        4 => flash.power_on(),
        // Another firmware stores something else.
        5 => stored_by_another(flash, input)?,
        // A few words change.
        6 => {
            let word = input.arbitrary::<u16>()?.into();
            let count = input.arbitrary::<u8>()? % 16;
            let words: Vec<u32> = (0..count).map(|_| input.arbitrary()).collect::<Result<_>>()?;
            flash.rot(word, words);
        }
        // An item's header that is right, with a length of its own.
        _ => {
            let word = input.arbitrary::<u16>()?.into();
            let length: u16 = input.arbitrary()?;
            let check = u32::from(check_of_length(length)) << 16;
            flash.rot(word, [input.arbitrary()?, check | u32::from(length)]);
        }
    }
    Ok(())
}

fn save(flash: &mut Flash, wanted: &Configuration) {
    _ = Store::new(flash).save(&wanted.settings, &wanted.modbus);
}

/// Saves, and again while words that are not free are in the way: each time at others.
fn save_at_last(store: &mut Store<'_>, wanted: &Configuration) {
    let mut met = BTreeSet::new();
    loop {
        match store.save(&wanted.settings, &wanted.modbus) {
            Ok(_) => return,
            Err(SaveError::Flash(FlashError::Verify { offset })) => {
                assert!(met.insert(offset), "at {offset} again")
            }
            Err(error) => panic!("after a factory reset there is room: {error:?}"),
        }
    }
}

/// A record of any content, whole as far as `sequential-storage` can tell, and with a right checksum or not.
fn stored_by_another(flash: &mut Flash, input: &mut Unstructured<'_>) -> Result<()> {
    let length = usize::from(input.arbitrary::<u16>()? % other::LONGEST as u16);
    let seal: bool = input.arbitrary()?;
    let given = usize::from(input.arbitrary::<u8>()?).min(input.len());
    let mut record = input.bytes(given)?.to_vec();
    record.resize(length.max(given), 0);
    if seal {
        record.extend((!record.iter().copied().fold(!0, crc)).to_le_bytes());
    }
    put(&record, flash);
    Ok(())
}

/// What `sequential-storage` guards the length of an item with: CRC-16F/4.2, reflected, begins and ends inverted.
fn check_of_length(length: u16) -> u16 {
    let steps = |crc: u16| (0..8).fold(crc, |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0x1A2E } else { 0 });
    let crc = !length.to_le_bytes().iter().fold(!0, |crc, byte| steps(crc ^ u16::from(*byte)));
    if crc == 0xFFFF { 0xFFFE } else { crc }
}

/// The gateway starts on this flash, and is set up.
fn start(flash: &mut Flash) {
    let Configuration { mut settings, mut modbus } = factory();
    let mut store = Store::new(flash);
    match store.load(&mut settings, &mut modbus) {
        // What is loaded can be carried out: saving would refuse it.
        Ok(Loaded::Stored { .. }) => {
            assert!(!matches!(store.save(&settings, &modbus), Err(clino_storage::SaveError::Rejected(_))))
        }
        Ok(Loaded::Factory | Loaded::Nothing) | Err(_) => {
            assert_eq!(Configuration { settings: settings.clone(), modbus }, factory());
        }
    }
    let wanted = numbered(4_711);
    if store.save(&wanted.settings, &wanted.modbus).is_err() {
        store.factory_reset().expect("a factory reset puts right whatever it is");
        save_at_last(&mut store, &wanted);
    }
    let mut store = Store::new(flash);
    assert!(matches!(store.load(&mut settings, &mut modbus), Ok(Loaded::Stored { .. })));
    assert_eq!(Configuration { settings, modbus }, wanted);
}

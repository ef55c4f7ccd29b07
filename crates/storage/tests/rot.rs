//! Flash with foreign content: the store can be set up again, whatever the content is.

mod support;

use clino_storage::{LoadError, Loaded, SaveError, SaveOutcome, Store};
use support::configurations::{Configuration, factory, longest, numbered};
use support::flash::Flash;
use support::other::put;
use support::random::Random;

/// Words of a sector.
const SECTOR: usize = 4_096;

/// Everything can be stored, and is found.
fn serves(flash: &mut Flash) {
    let wanted = numbered(4_711);
    assert_eq!(Store::new(&mut *flash).save(&wanted.settings, &wanted.modbus), Ok(SaveOutcome::Written));
    let Configuration { mut settings, mut modbus } = factory();
    assert_eq!(Store::new(flash).load(&mut settings, &mut modbus), Ok(Loaded::Stored { version: 3 }));
    assert_eq!(Configuration { settings, modbus }, wanted);
}

fn load(flash: &mut Flash) -> Result<Loaded, LoadError> {
    let Configuration { mut settings, mut modbus } = factory();
    Store::new(flash).load(&mut settings, &mut modbus)
}

/// A firmware that has more to store than this one has room for was here.
#[test]
fn a_record_that_is_too_long_is_replaced() {
    let mut flash = Flash::new();
    assert!(put(&[3; 6_000], &mut flash));
    assert_eq!(load(&mut flash), Err(LoadError::Library));
    serves(&mut flash);
}

/// No page is free, which the store itself never causes.
#[test]
fn pages_that_all_say_that_they_are_full_are_used_again() {
    let mut flash = Flash::new();
    serves(&mut flash);
    for sector in 0..3 {
        // The mark and the beginning of a page, and its end.
        flash.rot(sector * SECTOR, [0xE50C_1AC1, 0xBFA1_C05E, 0]);
        flash.rot(sector * SECTOR + SECTOR - 1, [0]);
    }
    assert_eq!(load(&mut flash), Err(LoadError::Library));
    serves(&mut flash);
}

/// Words that have changed behind the last record, in a sector that is not full: the record goes behind them.
#[test]
fn one_save_goes_behind_words_that_have_changed() {
    let mut random = Random(12);
    let mut steps = 0;
    for case in 0..2_000 {
        let configuration = |n| if case % 2 == 0 { numbered(n) } else { longest(n) };
        let mut flash = Flash::new();
        let old = configuration(1);
        assert_eq!(Store::new(&mut flash).save(&old.settings, &old.modbus), Ok(SaveOutcome::Written));
        // Behind the mark, the head of the page and the record: at any word of the next two records.
        let free = flash.steps as usize;
        let count = 1 + random.below([1, 4, 16, 64][case % 4]) as usize;
        let words: Vec<u32> = (0..count)
            .map(|_| match random.below(3) {
                0 => 0,
                1 => random.next() as u32,
                // One bit.
                _ => !(1 << random.below(32)),
            })
            .collect();
        flash.rot(free + random.below(1_000) as usize, words);
        let (new, before) = (configuration(2), flash.steps);
        assert_eq!(
            Store::new(&mut flash).save(&new.settings, &new.modbus),
            Ok(SaveOutcome::Written),
            "{case}"
        );
        steps = steps.max(flash.steps - before);
        let Configuration { mut settings, mut modbus } = factory();
        assert_eq!(
            Store::new(&mut flash).load(&mut settings, &mut modbus),
            Ok(Loaded::Stored { version: 3 })
        );
        assert_eq!(Configuration { settings, modbus }, new, "{case}");
        assert_eq!(flash.erases, [1, 0, 0], "no sector is given up");
    }
    println!("at most {steps} words for one save");
}

/// Words all over a sector: the attempts are bounded.
#[test]
fn after_a_factory_reset_there_is_room() {
    let mut flash = Flash::new();
    let Configuration { settings, modbus } = numbered(1);
    assert_eq!(Store::new(&mut flash).save(&settings, &modbus), Ok(SaveOutcome::Written));
    // Every third: there is room for the two words of a header, and nowhere for a record.
    flash.rot(100, (0..SECTOR - 200).map(|word| if word % 3 == 0 { 0 } else { u32::MAX }));
    let wanted = numbered(2);
    let mut store = Store::new(&mut flash);
    assert!(matches!(store.save(&wanted.settings, &wanted.modbus), Err(SaveError::Flash(_))));
    assert_eq!(store.factory_reset(), Ok(SaveOutcome::Written));
    serves(&mut flash);
}

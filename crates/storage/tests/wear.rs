//! How many saves the flash lives for, measured; and what costs nothing.

mod support;

use clino_storage::record::LONGEST;
use clino_storage::{Loaded, SaveOutcome, Store};
use support::configurations::{Configuration, factory, longest, numbered, usual};
use support::flash::Flash;

/// Erases a sector bears (DS8626 table 42).
const ENDURANCE: u64 = 10_000;

/// Saves until the first sector is worn, and words of one save.
fn life(configuration: impl Fn(u32) -> Configuration) -> (u64, u64) {
    // Often enough round the sectors that the first erases, of new flash, do not count.
    const SAVES: u64 = 2_000;
    let mut flash = Flash::new();
    let mut words = u64::MAX;
    for n in 0..SAVES {
        let before = flash.steps;
        let Configuration { settings, modbus } = configuration(n as u32);
        assert_eq!(Store::new(&mut flash).save(&settings, &modbus), Ok(SaveOutcome::Written));
        words = words.min(flash.steps - before);
    }
    let most = u64::from(flash.erases.into_iter().max().unwrap());
    (SAVES * ENDURANCE / most, words)
}

#[test]
fn a_hundred_thousand_saves() {
    let (worst, longest_words) = life(longest);
    let (common, usual_words) = life(|n| {
        let mut all = usual();
        all.modbus.address = (n % 247 + 1) as u8;
        all
    });
    println!(
        "longest: {} bytes, {worst} saves; usual: {} bytes, {common} saves",
        longest_words * 4,
        usual_words * 4
    );
    assert!(worst >= 100_000);
    assert!(common > worst);
    assert!(longest_words * 4 <= LONGEST as u64 + 8);
}

#[test]
fn the_same_again_costs_nothing() {
    let mut flash = Flash::new();
    let Configuration { settings, modbus } = numbered(7);
    assert_eq!(Store::new(&mut flash).save(&settings, &modbus), Ok(SaveOutcome::Written));
    let steps = flash.steps;
    let mut store = Store::new(&mut flash);
    assert_eq!(store.save(&settings, &modbus), Ok(SaveOutcome::Unchanged));
    assert_eq!((store.saves(), store.erases()), (0, 0));
    assert_eq!(flash.steps, steps);
}

#[test]
fn reading_costs_nothing() {
    let mut flash = Flash::new();
    let Configuration { mut settings, mut modbus } = factory();
    assert_eq!(Store::new(&mut flash).load(&mut settings, &mut modbus), Ok(Loaded::Nothing));
    assert_eq!(flash.steps, 0);
}

#[test]
fn a_factory_reset_is_found_again() {
    let mut flash = Flash::new();
    let Configuration { mut settings, mut modbus } = numbered(7);
    let mut store = Store::new(&mut flash);
    assert_eq!(store.save(&settings, &modbus), Ok(SaveOutcome::Written));
    assert_eq!(store.factory_reset(), Ok(SaveOutcome::Written));
    assert_eq!(store.factory_reset(), Ok(SaveOutcome::Unchanged));
    assert_eq!(store.load(&mut settings, &mut modbus), Ok(Loaded::Factory));
    assert_eq!((store.saves(), store.erases()), (2, 1));
    // What is running goes on.
    assert_eq!(Configuration { settings, modbus }, numbered(7));
}

/// One store for years: what it remembers of the flash stays true.
#[test]
fn a_store_that_lives_long() {
    let mut flash = Flash::new();
    let mut store = Store::new(&mut flash);
    let Configuration { mut settings, mut modbus } = factory();
    for n in 0..100 {
        let wanted = if n % 3 == 0 { numbered(n) } else { longest(n) };
        assert_eq!(store.save(&wanted.settings, &wanted.modbus), Ok(SaveOutcome::Written));
        assert_eq!(store.save(&wanted.settings, &wanted.modbus), Ok(SaveOutcome::Unchanged));
        assert_eq!(store.load(&mut settings, &mut modbus), Ok(Loaded::Stored { version: 3 }));
        assert_eq!(Configuration { settings: settings.clone(), modbus }, wanted);
    }
    assert_eq!(store.saves(), 100);
    assert!(store.erases() > 6);
}

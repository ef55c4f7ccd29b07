//! The power is cut at every step of a workload: afterwards there is the old configuration or the new one.

mod support;

use clino_storage::{FlashError, Loaded, SaveError, SaveOutcome, Store};
use embedded_storage::nor_flash::NorFlashErrorKind;
use support::configurations::{Configuration, factory, longest, numbered};
use support::flash::{Flash, TORN_ERASES};
use support::random::Random;

/// What can be asked of the store.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Wish {
    Save(Box<Configuration>),
    FactoryReset,
}

impl Wish {
    fn carry_out(&self, flash: &mut Flash) -> Result<SaveOutcome, SaveError> {
        let mut store = Store::new(flash);
        match self {
            Wish::Save(wanted) => store.save(&wanted.settings, &wanted.modbus),
            Wish::FactoryReset => store.factory_reset(),
        }
    }
}

/// What the gateway finds when it starts; `None` if nothing was ever saved.
fn found(flash: &mut Flash) -> Option<Wish> {
    let Configuration { mut settings, mut modbus } = factory();
    match Store::new(flash).load(&mut settings, &mut modbus) {
        Ok(Loaded::Stored { .. }) => Some(Wish::Save(Box::new(Configuration { settings, modbus }))),
        Ok(Loaded::Factory) => Some(Wish::FactoryReset),
        Ok(Loaded::Nothing) => None,
        Err(error) => panic!("{error:?}"),
    }
}

#[derive(Default)]
struct Tally {
    words: u64,
    erases: u64,
    kept: u64,
    taken: u64,
    twice: u64,
}

/// Cuts one wish at one step; afterwards the flash serves as before.
fn cut(before: &Flash, old: &Option<Wish>, new: &Wish, after: u64, seed: u64, tally: &mut Tally) {
    let mut flash = before.clone();
    flash.cut_after(after, seed);
    assert_eq!(
        new.carry_out(&mut flash),
        Err(SaveError::Flash(FlashError::Driver(NorFlashErrorKind::Other)))
    );
    match flash.torn_erase {
        true => tally.erases += 1,
        false => tally.words += 1,
    }
    flash.power_on();
    let now = found(&mut flash);
    match &now {
        now if now == old => tally.kept += 1,
        Some(now) if now == new => tally.taken += 1,
        other => panic!("step {after}, seed {seed}: {other:?}"),
    }
    let next = Wish::Save(Box::new(numbered(4_711)));
    let mut random = Random(seed);
    if random.below(4) == 0 {
        // Once more, while it is put right.
        flash.cut_after(random.below(600), random.next());
        let done = next.carry_out(&mut flash);
        flash.power_on();
        let then = found(&mut flash);
        assert!(then == Some(next.clone()) || done.is_err() && then == now, "step {after}, seed {seed}");
        tally.twice += 1;
    }
    assert!(matches!(next.carry_out(&mut flash), Ok(SaveOutcome::Written | SaveOutcome::Unchanged)));
    assert_eq!(found(&mut flash), Some(next));
}

/// Cuts a workload at every step, each word in `tears` ways and each erase in all of them.
fn cut_everywhere(wishes: &[Wish], tears: u64) -> (Tally, Flash) {
    let mut tally = Tally::default();
    let mut flash = Flash::new();
    let mut old = None;
    for (number, new) in wishes.iter().enumerate() {
        let mut after = flash.clone();
        assert_eq!(new.carry_out(&mut after), Ok(SaveOutcome::Written));
        for step in 0..after.steps - flash.steps {
            let seed = (number as u64) << 32 | step << 8;
            for tear in 0..tears {
                let erases = tally.erases;
                cut(&flash, &old, new, step, seed + tear, &mut tally);
                if tally.erases > erases && tear == 0 {
                    (tears..TORN_ERASES * 4).for_each(|tear| {
                        cut(&flash, &old, new, step, seed + tear, &mut tally);
                    });
                }
            }
        }
        flash = after;
        old = Some(new.clone());
        assert_eq!(found(&mut flash), old);
    }
    (tally, flash)
}

/// Saves long enough to go once round the sectors and more, with factory resets between.
fn workload() -> Vec<Wish> {
    let save = |n: u32| match n % 6 {
        5 => Wish::FactoryReset,
        0 => Wish::Save(Box::new(numbered(n))),
        _ => Wish::Save(Box::new(longest(n))),
    };
    (1..=60).map(save).collect()
}

fn report(tears: u64) {
    let wishes = workload();
    let (tally, flash) = cut_everywhere(&wishes, tears);
    let compactions = flash.erases.iter().sum::<u32>() - 3;
    println!(
        "{} wishes, {compactions} compactions: {} torn words, {} torn erases; old {}, new {}; \
         cut again while put right {}; 0 failures",
        wishes.len(),
        tally.words,
        tally.erases,
        tally.kept,
        tally.taken,
        tally.twice
    );
    assert!(compactions >= 2, "{:?}", flash.erases);
    assert!(tally.taken > 0 && tally.kept > 0 && tally.erases > 0);
}

#[test]
fn old_or_new_wherever_the_power_is_cut() {
    report(1);
}

/// The same with every word torn in 16 ways.
#[test]
#[ignore = "minutes"]
fn campaign() {
    report(16);
}

/// Cuts one after the other, for a long time, without ever a save that ends: what was saved stays.
#[test]
fn power_that_never_lasts() {
    let mut flash = Flash::new();
    let kept = Wish::Save(Box::new(longest(1)));
    assert_eq!(kept.carry_out(&mut flash), Ok(SaveOutcome::Written));
    let mut random = Random(1);
    for n in 0..400 {
        // Less than the record needs, so that the new one is never whole.
        flash.cut_after(random.below(450), random.next());
        let new = Wish::Save(Box::new(longest(2 + n)));
        assert!(new.carry_out(&mut flash).is_err());
        flash.power_on();
        assert_eq!(found(&mut flash).as_ref(), Some(&kept), "cut {n}");
    }
    assert!(flash.erases.iter().sum::<u32>() > 3, "{:?}", flash.erases);
}

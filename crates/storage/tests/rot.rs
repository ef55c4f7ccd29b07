//! Flash with something in it that nobody has stored: it can be set up again, whatever that is.

mod support;

use clino_storage::{LoadError, Loaded, SaveError, Saved, Store};
use support::configurations::{Configuration, factory, numbered};
use support::flash::{Flash, PowerLost};
use support::other::put;

/// Words of a sector.
const SECTOR: usize = 4_096;

/// Everything can be stored, and is found.
fn serves(flash: &mut Flash) {
    let wanted = numbered(4_711);
    assert_eq!(Store::new(&mut *flash).save(&wanted.settings, &wanted.modbus), Ok(Saved::Written));
    let Configuration { mut settings, mut modbus } = factory();
    assert_eq!(Store::new(flash).load(&mut settings, &mut modbus), Ok(Loaded::Stored { version: 3 }));
    assert_eq!(Configuration { settings, modbus }, wanted);
}

fn load(flash: &mut Flash) -> Result<Loaded, LoadError<PowerLost>> {
    let Configuration { mut settings, mut modbus } = factory();
    Store::new(flash).load(&mut settings, &mut modbus)
}

/// A firmware that has more to store than this one has room for was here.
#[test]
fn a_record_that_is_too_long_is_replaced() {
    let mut flash = Flash::new();
    assert!(put(&[3; 3_000], &mut flash));
    assert_eq!(load(&mut flash), Err(LoadError::Library));
    serves(&mut flash);
}

/// No page is free, which never happens by itself.
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

/// Words that cannot be told from free ones until they are written.
#[test]
fn after_a_factory_reset_there_is_room() {
    let mut flash = Flash::new();
    let Configuration { settings, modbus } = numbered(1);
    assert_eq!(Store::new(&mut flash).save(&settings, &modbus), Ok(Saved::Written));
    flash.rot(100, vec![0; SECTOR - 200]);
    let wanted = numbered(2);
    let mut store = Store::new(&mut flash);
    assert!(matches!(store.save(&wanted.settings, &wanted.modbus), Err(SaveError::Flash(_))));
    assert_eq!(store.factory_reset(), Ok(Saved::Written));
    serves(&mut flash);
}

//! Records of other versions in flash: an older one is migrated, a newer one is reported and left alone.

mod support;

use clino_bus::{Duration, Serial, Timing};
use clino_gateway::BusSettings;
use clino_storage::{LoadError, Loaded, Reject, SaveOutcome, Store};
use support::configurations::{Configuration, factory, numbered};
use support::flash::Flash;
use support::other::put;

/// Version 1 with no slots; the T7 bus has 57600 bit/s, otherwise both are as in the factory. Checksum by zlib.
#[rustfmt::skip]
const VERSION_1: &[u8] = &[
    0x01, 0x00,
    0x80, 0xC2, 0x03, 0x57, 0xD0, 0x0F, 0xA8, 0xC3, 0x01, 0x57, 0xDC, 0x02, 0x57, 0xF0, 0x2E, 0xA8, 0xC3, 0x01, 0xD0,
    0x0F, 0x8F, 0x2E, 0x80, 0xC2, 0x03, 0x57, 0x00, 0x00, 0x00,
    0x80, 0x4B, 0x92, 0x08, 0xB8, 0x8E, 0x03, 0xE8, 0xBC, 0x18, 0x92, 0x08, 0xB1, 0x51, 0xA4, 0x10, 0xD0, 0x86, 0x03,
    0x80, 0xB5, 0x18, 0xD0, 0x86, 0x03, 0xBD, 0xAB, 0x10, 0x80, 0x4B, 0x92, 0x08, 0x00, 0x00, 0x00,
    0x00,
    0x7C, 0x9D, 0xF9, 0x6C,
];

/// Version 4, whatever that is. Checksum by zlib.
const VERSION_4: &[u8] = &[0x04, 0x2A, 0x2B, 0xA6, 0x44, 0x9F, 0x3B];

/// Flash with this record in it.
fn flash_with(record: &[u8]) -> Flash {
    let mut flash = Flash::new();
    assert!(put(record, &mut flash));
    flash
}

#[test]
fn an_older_one_is_migrated() {
    let mut flash = flash_with(VERSION_1);
    let mut store = Store::new(&mut flash);
    let Configuration { mut settings, mut modbus } = numbered(7);
    assert_eq!(store.load(&mut settings, &mut modbus), Ok(Loaded::Stored { version: 1 }));
    let mut expected = factory();
    // What follows from the bit rate does so now; the guard of 87 us was not its own.
    let timing = Timing { guard: Duration::from_micros(87), ..Timing::t7(Serial { baud: 57_600 }) };
    expected.settings.t7 = BusSettings::new(timing);
    assert_eq!(Configuration { settings: settings.clone(), modbus }, expected);

    // From now on as the version of today.
    assert_eq!(store.save(&settings, &modbus), Ok(SaveOutcome::Written));
    assert_eq!(store.save(&settings, &modbus), Ok(SaveOutcome::Unchanged));
    let Configuration { mut settings, mut modbus } = numbered(7);
    assert_eq!(store.load(&mut settings, &mut modbus), Ok(Loaded::Stored { version: 3 }));
    assert_eq!(Configuration { settings, modbus }, expected);
}

#[test]
fn a_newer_one_is_reported() {
    let mut flash = flash_with(VERSION_4);
    let steps = flash.steps;
    let mut store = Store::new(&mut flash);
    let Configuration { mut settings, mut modbus } = numbered(7);
    let newer = LoadError::Rejected(Reject::Newer { version: 4 });
    assert_eq!(store.load(&mut settings, &mut modbus), Err(newer));
    assert_eq!(Configuration { settings, modbus }, numbered(7));
    assert_eq!(flash.steps, steps);
}

//! What ends in a reset, or just does not: the watchdog over its oscillator's range, and a crystal that fails.

use std::sync::OnceLock;

use clino_board::elf::Image;
use clino_board::incident::{Event, Incident, ResetCause};
use clino_board::oscillators::{CrystalLife, Oscillators};
use clino_board::{Board, BoardModel, Stopped};

use super::{MS, built, ports};

/// Orders to the firmware.
const STARVE: u32 = 1;
const ERASE: u32 = 2;
const CRYSTAL: u32 = 3;

/// Its findings: see `RESULTS` there.
#[derive(Debug)]
struct Findings {
    starts: u32,
    ended: u32,
    nmis: u32,
    cr: u32,
    cfgr: u32,
    cause: u32,
    turns: u32,
    incidents: Vec<Incident>,
}

/// Watchdog and pin, in RCC_CSR from bit 25 on.
const WATCHDOG: u32 = 0b001_0010;
/// Power-on, pin and brown-out.
const POWER_ON: u32 = 0b000_0111;

/// Runs the firmware with `order` for `ns`.
fn run(oscillators: Oscillators, order: [u32; 4], ns: u64) -> Findings {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    let image = IMAGE
        .get_or_init(|| Image::read(&built().join("board-trials"), BoardModel::default()).expect("an image"));
    let results = image.symbol("RESULTS").expect("the results' symbol");
    let stored: Vec<u8> = order.iter().flat_map(|word| word.to_le_bytes()).collect();
    let image = image.clone().with_stored(&stored).expect("it fits");
    let mut board = Board::clocked_by(oscillators, &image, ports().0).expect("a board");
    board.run_until(ns).unwrap_or_else(|stopped: Stopped| panic!("{stopped}"));
    let result = |slot: u32| board.peek32(results + 4 * slot).expect("RAM");
    let [starts, ended, nmis, cr, cfgr, cause, turns] = std::array::from_fn(|slot| result(slot as u32));
    Findings { starts, ended, nmis, cr, cfgr, cause, turns, incidents: board.incidents() }
}

fn lsi(lsi_hz: u32) -> Oscillators {
    Oscillators { lsi_hz, ..Oscillators::default() }
}

fn crystal(stops_at: Option<u64>, returns_at: Option<u64>) -> Oscillators {
    Oscillators { crystal: CrystalLife { stops_at, returns_at }, ..Oscillators::default() }
}

#[test]
#[ignore = "needs the thumb target"]
fn a_starved_watchdog_bites_when_its_oscillator_says() {
    for lsi_hz in [17_000, 32_000, 47_000] {
        // A divider of 8, and 1000 periods of that: RM0090 section 21.3.
        let timeout = 8 * 1_000 * 1_000 * MS / u64::from(lsi_hz);
        for feeds in [0, 3] {
            let found = run(lsi(lsi_hz), [STARVE, 1, 999, feeds], 900 * MS);
            let [Incident { at, event: Event::Reset(ResetCause::Watchdog) }] = found.incidents[..] else {
                panic!("{found:?}")
            };
            let expected = u64::from(feeds) * 100 * MS + timeout;
            assert!(
                at.abs_diff(expected) <= timeout / 100,
                "{lsi_hz} Hz, {feeds}: {at} instead of {expected}"
            );
            // Memory is kept, and the cause is there.
            assert_eq!((found.starts, found.ended, found.cause), (2, 1, WATCHDOG));
        }
    }
}

#[test]
#[ignore = "needs the thumb target"]
fn the_watchdog_counts_on_while_flash_stalls_the_core() {
    // A sector takes 500 ms. 47 kHz divided by 8: 3055 periods are 520 ms, 2820 are 480 ms.
    for (reload, survives) in [(3_054, true), (2_819, false)] {
        let found = run(lsi(47_000), [ERASE, 1, reload, 0], 900 * MS);
        let [Incident { at, event: Event::Reset(ResetCause::Watchdog) }, ..] = found.incidents[..] else {
            // Fed after the erase: the next bite is at 1.02 s.
            assert!(survives && found.ended == 1 && found.starts == 1, "{found:?}");
            continue;
        };
        assert!(!survives && at.abs_diff(480 * MS) < 5 * MS && found.ended == 0, "{found:?}");
    }
}

const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const PLLON: u32 = 1 << 24;
/// SWS: the PLL is the source.
const ON_PLL: u32 = 0b10 << 2;

#[test]
#[ignore = "needs the thumb target"]
fn the_clock_security_system_goes_on_with_the_internal_oscillator() {
    let found = run(crystal(Some(30 * MS), None), [CRYSTAL, 1, 0, 0], 130 * MS);
    let [stopped, switched] = found.incidents[..] else { panic!("{found:?}") };
    assert_eq!((stopped.at, stopped.event), (30 * MS, Event::Crystal { swings: false }));
    assert_eq!(switched.event, Event::ClockSecurity);
    assert!(switched.at - stopped.at <= 1_000, "{switched}");
    // One NMI, ended by CSSC; the oscillators are off, the source is the internal one.
    assert_eq!((found.nmis, found.starts), (1, 1));
    assert_eq!((found.cr & (HSEON | HSERDY | PLLON), found.cfgr & 0b1111), (0, 0));
    // Turns of 160 000 cycles: 30 ms at 168 MHz, 100 ms at 16 MHz.
    assert!((40..=42).contains(&found.turns), "{found:?}");
}

#[test]
#[ignore = "needs the thumb target"]
fn without_it_the_core_stands_still_until_the_watchdog_bites() {
    let found = run(crystal(Some(30 * MS), None), [CRYSTAL, 0, 0, 0], 450 * MS);
    let [stopped, reset] = found.incidents[..] else { panic!("{found:?}") };
    assert_eq!(
        (stopped.event, reset.event),
        (Event::Crystal { swings: false }, Event::Reset(ResetCause::Watchdog))
    );
    // 12 800 periods of 32 kHz.
    assert!(reset.at.abs_diff(400 * MS) <= 4 * MS, "{reset}");
    assert_eq!((found.starts, found.nmis, found.cause), (2, 0, WATCHDOG));
    assert!((30..=32).contains(&found.turns), "{found:?}");
    assert_eq!((found.cr & (HSEON | HSERDY | PLLON), found.cfgr & 0b1100), (HSEON | HSERDY | PLLON, ON_PLL));
}

#[test]
#[ignore = "needs the thumb target"]
fn a_crystal_that_comes_back_lets_the_core_go_on() {
    let found = run(crystal(Some(30 * MS), Some(100 * MS)), [CRYSTAL, 0, 0, 0], 130 * MS);
    assert_eq!(found.incidents.len(), 2, "{found:?}");
    // 30 ms and 30 ms.
    assert!((60..=63).contains(&found.turns) && found.starts == 1, "{found:?}");
}

#[test]
#[ignore = "needs the thumb target"]
fn a_dead_crystal_is_waited_for_in_vain() {
    // The HAL waits for ever.
    let found = run(crystal(Some(0), None), [CRYSTAL, 0, 0, 0], 50 * MS);
    assert_eq!((found.turns, found.cr, found.cause), (0, 0, POWER_ON));
    let found = run(crystal(Some(0), Some(40 * MS)), [CRYSTAL, 0, 0, 0], 50 * MS);
    assert!((8..=11).contains(&found.turns), "{found:?}");
}

#[test]
#[ignore = "needs the thumb target"]
fn an_internal_oscillator_that_is_off_is_off_for_all() {
    // Fed three times at what should be 100 ms, and 8 % slow.
    let slow = Oscillators { hsi_hz: 14_720_000, ..lsi(32_000) };
    let found = run(slow, [STARVE, 1, 999, 3], 900 * MS);
    let expected = 300 * MS * 16_000 / 14_720 + 250 * MS;
    assert!(found.incidents[0].at.abs_diff(expected) <= 2_500_000, "{found:?}");
}

//! The shipped image hangs at every step of its start, with all interrupts masked: the watchdog ends it within 1.5 s, at the
//! slowest oscillator as well.
//!
//! Steps are told apart by what the chip's registers show while the core hangs. They are found by halving the time between two
//! instants whose registers differ, so that a step is met however short it is.

use std::collections::BTreeMap;
use std::path::Path;

use clino_board::incident::{Event, ResetCause};
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::image;

use crate::MS;

/// What is promised.
const LIMIT: u64 = 1_500 * MS;
/// The start is over by then.
const OVER: u64 = 12 * MS;
/// Steps that follow each other within this are taken for one, ns: 17 instructions at 168 MHz.
const FINEST: u64 = 100;
/// Slowest, typical and fastest oscillator of the watchdog (DS8626 table 41).
const LSI_HZ: [u32; 3] = [17_000, 32_000, 47_000];

/// What the chip is set up to (RM0090 sections 7.3, 18.4, 21.4, 30.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Chip {
    /// The time of the watchdog has been set.
    watchdog: bool,
    /// HSEON and PLLON of RCC_CR, SWS of RCC_CFGR.
    crystal: bool,
    pll: bool,
    pll_in_use: bool,
    /// RCC_AHB1ENR, APB1ENR, APB2ENR.
    clocks: [u32; 3],
    /// UE of USART1, 3, 2, 6; CEN of TIM4, 5, 2.
    running: [bool; 7],
}

impl Chip {
    fn of(run: &mut Run) -> Chip {
        let mut peek = |address| run.board().peek32(address).expect("a register");
        let (cr, cfgr) = (peek(0x4002_3800), peek(0x4002_3808));
        Chip {
            watchdog: peek(0x4000_3008) != 0xfff,
            crystal: cr & 1 << 16 != 0,
            pll: cr & 1 << 24 != 0,
            pll_in_use: cfgr >> 2 & 3 == 2,
            clocks: [0x4002_3830, 0x4002_3840, 0x4002_3844].map(&mut peek),
            running: [
                peek(0x4001_100c) & 1 << 13 != 0,
                peek(0x4000_480c) & 1 << 13 != 0,
                peek(0x4000_440c) & 1 << 13 != 0,
                peek(0x4001_140c) & 1 << 13 != 0,
                peek(0x4000_0800) & 1 != 0,
                peek(0x4000_0c00) & 1 != 0,
                peek(0x4000_0000) & 1 != 0,
            ],
        }
    }
}

/// A board that hangs from `at` on.
fn hanging(at: u64, lsi_hz: u32, more: &str) -> Run {
    let text = format!(
        "duration = \"5s\"\nlsi_hz = {lsi_hz}\n\
         plant = [{{ at = \"{at}ns\", what = \"masked_hang\", level = \"main\" }}]\n{more}"
    );
    let scenario = Scenario::parse(Path::new("bring-up"), &text).unwrap_or_else(|error| panic!("{error}"));
    Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"))
}

/// What the chip is set up to when it hangs at `at`.
fn chip(at: u64) -> Chip {
    let mut run = hanging(at, 32_000, "");
    run.board().run_until(at + 2 * MS).expect("it hangs");
    Chip::of(&mut run)
}

/// Each state between two instants, with an instant of it.
fn find(states: &mut BTreeMap<Chip, u64>, from: (u64, Chip), until: (u64, Chip)) {
    for (at, chip) in [from, until] {
        states.entry(chip).or_insert(at);
    }
    if from.1 != until.1 && until.0 - from.0 > FINEST {
        let middle = from.0.midpoint(until.0);
        let middle = (middle, chip(middle));
        find(states, from, middle);
        find(states, middle, until);
    }
}

/// How long a hang at `at` lasts; `None` if nothing has ended it after twice the limit.
fn lasts(at: u64, lsi_hz: u32, more: &str) -> Option<u64> {
    let mut run = hanging(at, lsi_hz, more);
    let mut until = at;
    let reset = loop {
        until += 10 * MS;
        run.board().run_until(until).expect("it hangs, and is reset");
        let reset = run.incidents().into_iter().find(|incident| matches!(incident.event, Event::Reset(_)));
        if reset.is_some() || until > at + 2 * LIMIT {
            break reset?;
        }
    };
    let planted =
        run.incidents().into_iter().find(|incident| matches!(incident.event, Event::Planted { .. }));
    let planted = planted.unwrap_or_else(|| panic!("{at} ns: it was to hang")).at;
    assert_eq!(reset.event, Event::Reset(ResetCause::Watchdog), "{at} ns");
    Some(reset.at - planted)
}

#[test]
fn a_hang_at_every_step_of_the_start_is_ended() {
    let mut states = BTreeMap::new();
    let (first, last) = (2_000, OVER);
    find(&mut states, (first, chip(first)), (last, chip(last)));
    let enabled = |chip: &Chip, bus: usize, bit: u32| chip.clocks[bus] & 1 << bit != 0;
    type Step<'a> = (&'a str, &'a dyn Fn(&Chip) -> bool);
    let steps: [Step<'_>; 14] = [
        ("before main, and before the watchdog's time is set", &|c| !c.watchdog),
        ("after that", &|c| c.watchdog && !c.crystal),
        ("the crystal starts", &|c| c.crystal && !c.pll),
        ("the PLL starts", &|c| c.pll && !c.pll_in_use),
        ("full speed", &|c| c.pll_in_use && !c.running[4]),
        ("the clock", &|c| c.running[4] && c.clocks[0] == 0x0010_0000),
        ("the ports", &|c| c.running[4] && enabled(c, 0, 0) && !enabled(c, 0, 3)),
        ("loading the configuration from flash", &|c| enabled(c, 0, 3) && !enabled(c, 2, 4)),
        ("USART1", &|c| c.running[0] && !c.running[1]),
        ("USART3", &|c| c.running[1] && !c.running[2]),
        ("USART2", &|c| c.running[2] && !c.running[3]),
        ("USART6", &|c| c.running[3] && !c.running[5]),
        ("TIM5", &|c| c.running[5] && !c.running[6]),
        ("TIM2, and all the rest", &|c| c.running[6]),
    ];
    println!("{} states of the chip", states.len());
    for (name, is_it) in steps {
        assert!(states.keys().any(is_it), "no instant of `{name}` was found");
    }
    let mut longest = 0;
    for (index, &at) in states.values().enumerate() {
        // The slowest is the one that counts; the others by turns.
        for lsi_hz in [LSI_HZ[0], LSI_HZ[1 + index % 2]] {
            let lasted = lasts(at, lsi_hz, "").unwrap_or_else(|| panic!("a hang at {at} ns never ends"));
            assert!(lasted <= LIMIT, "a hang at {at} ns lasts {} ms at {lsi_hz} Hz", lasted / MS);
            longest = longest.max(lasted);
        }
    }
    println!("longest: {} ms", longest / MS);
}

#[test]
fn a_hang_while_the_watchdogs_time_is_set_is_ended() {
    // Setting it takes five cycles of the oscillator for each of the two settings: 0.3 ms at 17 kHz.
    const STEP: u64 = 50_000;
    let set = |at: &u64| chip(*at).watchdog;
    let begin = (0..OVER / STEP).map(|n| n * STEP).find(set).expect("it is set");
    for at in (begin.saturating_sub(MS)..begin + MS).step_by(STEP as usize) {
        let lasted = lasts(at, 17_000, "").unwrap_or_else(|| panic!("a hang at {at} ns never ends"));
        assert!(lasted <= LIMIT, "a hang at {at} ns lasts {} ms", lasted / MS);
    }
}

#[test]
fn a_hang_while_a_dead_crystal_is_waited_for_is_ended() {
    let lasted = lasts(15 * MS, 17_000, "crystal = { dead = true }").expect("it ends");
    assert!(lasted <= LIMIT, "{} ms", lasted / MS);
}

#[test]
fn only_the_first_instructions_are_without_the_watchdog() {
    // A cycle of the internal oscillator is 62.5 ns. Reset vector, a call, four instructions.
    let without: Vec<u64> = (1..40).map(|n| n * 63).filter(|&at| lasts(at, 32_000, "").is_none()).collect();
    let last = without.last().copied().unwrap_or(0);
    println!("without the watchdog: {last} ns");
    assert!(last < 1_000, "{without:?}");
}

#[test]
fn a_start_is_far_shorter_than_the_watchdogs_shortest_time() {
    // As it is at reset, with the fastest oscillator: 4 * 4096 cycles of 47 kHz, 349 ms. With a dead crystal.
    let text = "duration = \"2s\"\nlsi_hz = 47000\ncrystal = { dead = true }\n";
    let ran = clino_host_tests::run(text);
    assert!(ran.incidents.iter().all(|incident| !matches!(incident.event, Event::Reset(_))));
    let first = ran.lines.first().expect("it speaks").began;
    assert!(first < 100 * MS, "{} ms", first / MS);
}

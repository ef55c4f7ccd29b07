//! When a bus is declared faulty, what it is called, and when it is well again. Exchanges are made up here.

use proptest::prelude::*;
use std::vec::Vec;

use super::*;

const SLOTS: usize = 4;
/// From one exchange to the next, µs.
const STEP: u64 = 30_000;

fn all() -> Bits {
    let mut all = Bits::EMPTY;
    (0..SLOTS).for_each(|slot| all.set(slot, true));
    all
}

struct Bench {
    watch: Watch,
    counters: BusCounters,
    living: Bits,
    now: u64,
}

impl Bench {
    fn new() -> Bench {
        Bench { watch: Watch::default(), counters: BusCounters::default(), living: all(), now: 1_000_000 }
    }

    fn fail(&mut self, slot: usize, verdict: Verdict) -> Consequence {
        self.now += STEP;
        self.watch.failed(slot, verdict, &self.counters, self.living, Instant::from_micros(self.now))
    }

    /// Runs `rounds` rounds, in all of which this is seen.
    fn rounds(
        &mut self,
        rounds: usize,
        mut seen: impl FnMut(&mut BusCounters) -> Verdict,
    ) -> Option<BusFault> {
        for slot in (0..SLOTS).cycle().take(rounds * SLOTS) {
            let verdict = seen(&mut self.counters);
            self.fail(slot, verdict);
        }
        self.watch.health().fault
    }

    fn answer(&mut self) -> bool {
        self.now += STEP;
        self.watch.answered(&self.counters)
    }
}

/// Long enough for half a second and two rounds.
const ENOUGH: usize = 6;

#[test]
fn each_fault_is_called_by_its_name() {
    let named = |seen: fn(&mut BusCounters) -> Verdict| Bench::new().rounds(ENOUGH, seen);
    assert_eq!(named(|_| Verdict::NoAnswer), Some(BusFault::Mute));
    assert_eq!(named(|_| Verdict::LineBusy), Some(BusFault::Babble));
    assert_eq!(named(|_| Verdict::NotSent), Some(BusFault::Driver));
    assert_eq!(named(|_| Verdict::Contention), Some(BusFault::Contention));
    assert_eq!(named(|_| Verdict::Checksum), Some(BusFault::Garbage));
    let broken = |counters: &mut BusCounters| {
        counters.breaks += 1;
        counters.framing += 1;
        Verdict::Garbled
    };
    assert_eq!(named(broken), Some(BusFault::Break));
    let wrong_rate = |counters: &mut BusCounters| {
        counters.breaks += 1;
        counters.framing += 3;
        Verdict::LineErrors
    };
    assert_eq!(named(wrong_rate), Some(BusFault::Garbage));
    let babble = |counters: &mut BusCounters| {
        counters.unasked += 1;
        Verdict::NoAnswer
    };
    assert_eq!(named(babble), Some(BusFault::Babble));
}

#[test]
fn a_babbler_that_pauses_is_one_and_a_single_spike_is_none() {
    let every = |n: u32| {
        let mut asked = 0;
        Bench::new().rounds(ENOUGH, move |counters| {
            asked += 1;
            counters.unasked += u32::from(asked % n == 0);
            Verdict::Garbled
        })
    };
    assert_eq!(every(SLOTS as u32), Some(BusFault::Babble));
    assert_eq!(every(100), Some(BusFault::Garbage));
}

#[test]
fn it_takes_two_rounds_and_half_a_second() {
    let mut bench = Bench::new();
    let began = bench.now + STEP;
    while bench.watch.health().fault.is_none() {
        let slot = (bench.watch.health().in_vain as usize) % SLOTS;
        bench.fail(slot, Verdict::NoAnswer);
    }
    // The round in which half a second is over is heard to its end.
    assert!((500_000..500_000 + SLOTS as u64 * STEP).contains(&(bench.now - began)), "{}", bench.now - began);
    assert_eq!(bench.watch.health().faults, 1);

    let mut slow = Bench::new();
    for slot in 0..SLOTS {
        slow.now += 10_000_000;
        assert_ne!(slow.fail(slot, Verdict::NoAnswer), Consequence::Faulty);
    }
}

#[test]
fn a_request_that_does_not_get_out_counts_for_all() {
    let mut bench = Bench::new();
    assert_ne!(bench.fail(0, Verdict::LineBusy), Consequence::Faulty);
    bench.now += 500_000;
    assert_eq!(bench.fail(1, Verdict::LineBusy), Consequence::Faulty);
    assert_eq!(bench.watch.health().fault, Some(BusFault::Babble));
}

#[test]
fn a_slot_that_was_not_asked_yet_is_sent_for_when_the_others_have_failed() {
    let mut bench = Bench::new();
    for slot in (0..SLOTS - 1).cycle().take(60) {
        let consequence = bench.fail(slot, Verdict::NoAnswer);
        assert_ne!(consequence, Consequence::Faulty);
        if bench.now > 2_000_000 {
            let Consequence::Ask(those) = consequence else { panic!("{consequence:?}") };
            assert_eq!(those.iter().collect::<Vec<_>>(), [SLOTS - 1]);
        }
    }
    assert_eq!(bench.watch.health().fault, None);
}

#[test]
fn the_dead_are_not_waited_for() {
    let mut bench = Bench::new();
    bench.living.set(2, false);
    for slot in [0, 1, 3].into_iter().cycle().take(30) {
        bench.fail(slot, Verdict::NoAnswer);
    }
    assert_eq!(bench.watch.health().fault, Some(BusFault::Mute));
}

#[test]
fn the_first_good_answer_ends_it() {
    let mut bench = Bench::new();
    bench.rounds(ENOUGH, |_| Verdict::NoAnswer);
    assert!(bench.answer());
    assert_eq!(bench.watch.health(), BusHealth { fault: None, in_vain: 0, faults: 1 });
    assert!(!bench.answer());
    assert_eq!(bench.rounds(ENOUGH, |_| Verdict::NoAnswer), Some(BusFault::Mute));
    assert_eq!(bench.watch.health().faults, 2);
}

#[test]
fn a_fault_that_becomes_another_is_called_so_and_counted_once() {
    let mut bench = Bench::new();
    assert_eq!(bench.rounds(ENOUGH, |_| Verdict::LineBusy), Some(BusFault::Babble));
    assert_eq!(bench.rounds(2, |_| Verdict::NoAnswer), Some(BusFault::Mute));
    assert_eq!(bench.watch.health().faults, 1);
}

const FAILURES: [Verdict; 7] = [
    Verdict::NoAnswer,
    Verdict::Garbled,
    Verdict::LineErrors,
    Verdict::Checksum,
    Verdict::Contention,
    Verdict::LineBusy,
    Verdict::NotSent,
];

/// The first of them may be the fault of the node that is asked; the others keep the request from getting out.
const OF_A_NODE: usize = 5;

proptest! {
    /// A node that never answers, among others that do, whatever that looks like.
    #[test]
    fn one_dead_node_among_living_ones_is_no_fault(
        dead in 0..SLOTS,
        exchanges in proptest::collection::vec((0..SLOTS, 0..OF_A_NODE, 0..200_000_u64, 0..3_u32), 1..400),
    ) {
        let mut bench = Bench::new();
        for (slot, failure, pause, unasked) in exchanges {
            bench.now += pause;
            bench.counters.unasked += unasked;
            if slot == dead {
                prop_assert_ne!(bench.fail(slot, FAILURES[failure]), Consequence::Faulty);
            } else {
                prop_assert!(!bench.answer());
            }
            prop_assert_eq!(bench.watch.health().fault, None);
        }
    }

    /// Whatever has happened: after one good answer the bus is well; when no node answers, it is faulty.
    #[test]
    fn no_verdict_sticks(
        exchanges in proptest::collection::vec((0..SLOTS, 0..=FAILURES.len(), 0..900_000_u64), 0..200),
    ) {
        let mut bench = Bench::new();
        for (slot, failure, pause) in exchanges {
            bench.now += pause;
            match FAILURES.get(failure) {
                Some(&verdict) => _ = bench.fail(slot, verdict),
                None => _ = bench.answer(),
            }
        }
        bench.answer();
        prop_assert_eq!(bench.watch.health().fault, None);
        prop_assert_eq!(bench.watch.health().in_vain, 0);
        prop_assert_eq!(bench.rounds(ENOUGH, |_| Verdict::NoAnswer), Some(BusFault::Mute));
    }
}

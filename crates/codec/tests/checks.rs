//! CheckCounters and the small sets.

use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::{Check, CheckCounters};

#[test]
fn every_layer_has_its_counter() {
    let mut counters = CheckCounters::new();
    assert_eq!(counters, CheckCounters::default());
    counters.accept();
    for (times, check) in [
        (1, Check::LineErrors),
        (2, Check::Checksum),
        (3, Check::Address),
        (4, Check::Command),
        (5, Check::Length),
        (6, Check::Value),
    ] {
        (0..times).for_each(|_| counters.refuse(check));
    }
    let expected =
        CheckCounters { good: 1, line_errors: 1, checksum: 2, address: 3, command: 4, length: 5, value: 6 };
    assert_eq!(counters, expected);
    assert_eq!(counters.refused(), 21);
}

#[test]
fn counters_stop_at_their_maximum() {
    let mut counters = CheckCounters { good: u32::MAX, checksum: u32::MAX, ..CheckCounters::new() };
    counters.accept();
    counters.refuse(Check::Checksum);
    counters.refuse(Check::Value);
    assert_eq!((counters.good, counters.checksum, counters.refused()), (u32::MAX, u32::MAX, u32::MAX));
}

#[test]
fn receiver_errors_are_a_set() {
    let all = [LineErrors::FRAMING, LineErrors::NOISE, LineErrors::OVERRUN, LineErrors::PARITY];
    let mut set = LineErrors::NONE;
    for error in all {
        assert!(!set.contains(error) && !error.is_none());
        set |= error;
        assert!(set.contains(error));
    }
    assert!(LineErrors::NONE.is_none() && set.contains(LineErrors::NONE));
    assert_eq!(LineErrors::FRAMING | LineErrors::NOISE, LineErrors::FRAMING.union(LineErrors::NOISE));
    assert_eq!(Character::clean(7), Character { byte: 7, errors: LineErrors::default() });
}

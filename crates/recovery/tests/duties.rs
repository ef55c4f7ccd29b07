//! Duties against the clock: nobody is late by a tick and blamed, nobody hangs and is forgotten.

use clino_recovery::{Duties, Duty, TICK_MS};

/// Ticks until somebody is blamed, who that is.
fn until_stalled(duties: &Duties, most: u32) -> Option<(u32, Duty)> {
    (1..=most).find_map(|tick| duties.tick().map(|duty| (tick, duty)))
}

#[test]
fn a_silent_duty_is_named_within_its_deadline_and_two_ticks() {
    for (duty, deadline_ms) in [
        (Duty::T7Bus, 500),
        (Duty::IsuBus, 500),
        (Duty::Pwm, 500),
        (Duty::Modbus, 500),
        (Duty::Console, 900),
        (Duty::Storage, 900),
    ] {
        let duties = Duties::new();
        duties.check_in(duty);
        let (ticks, named) = until_stalled(&duties, 1_000).expect("it is named");
        assert_eq!(named, duty);
        assert!(ticks * TICK_MS >= deadline_ms, "{named:?} after {} ms", ticks * TICK_MS);
        assert!(ticks * TICK_MS <= deadline_ms + 2 * TICK_MS, "{named:?} after {} ms", ticks * TICK_MS);
        // It stays named: nobody feeds again.
        assert_eq!(until_stalled(&duties, 1), Some((1, duty)));
    }
}

#[test]
fn everything_ends_within_a_second_and_a_half() {
    for duty in Duty::ALL {
        assert!(duty.longest_silence_ms() + 2 * TICK_MS <= 1_500 - 500, "{duty:?}");
    }
}

#[test]
fn duties_that_check_in_in_time_are_never_named() {
    let duties = Duties::new();
    for tick in 0..100_000u32 {
        for duty in Duty::ALL {
            if tick % (duty.longest_silence_ms() / TICK_MS) == 0 {
                duties.check_in(duty);
            }
        }
        assert_eq!(duties.tick(), None, "tick {tick}");
    }
}

#[test]
fn a_duty_that_rests_is_not_expected() {
    let duties = Duties::new();
    assert_eq!(until_stalled(&duties, 10_000), None, "nobody has checked in yet");
    duties.check_in(Duty::Storage);
    duties.tick();
    duties.rest(Duty::Storage);
    assert_eq!(until_stalled(&duties, 10_000), None);
}

#[test]
fn numbers_and_names_of_duties_do_not_change() {
    let told = Duty::ALL.map(|duty| (duty as u8, duty.name()));
    let expected = [(1, "t7_bus"), (2, "isu_bus"), (3, "pwm"), (4, "modbus"), (5, "console"), (6, "storage")];
    assert_eq!(told, expected);
    assert!(Duty::ALL.into_iter().all(|duty| Duty::from_number(duty as u32) == Some(duty)));
    assert_eq!(Duty::from_number(0), None);
}

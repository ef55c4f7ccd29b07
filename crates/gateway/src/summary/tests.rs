//! No declared fault anywhere leaves the summary clean: every part and every slot, by chance, against the list of what
//! is a fault, restated here.

use super::*;
use crate::alarm::Alarms;
use crate::config::PwmInput;
use clino_codec::{isu, t7};
use proptest::prelude::*;
use std::vec::Vec;

fn source() -> impl Strategy<Value = Source> {
    prop_oneof![
        (1_u8..100).prop_map(|number| Source::T7 {
            address: t7::Address::new(number).unwrap(),
            axis: t7::Axis::Two
        }),
        (1_u8..15).prop_map(|number| Source::Isu { address: isu::Address::new(number).unwrap() }),
        Just(Source::Pwm { input: PwmInput::Pwm1 }),
        Just(Source::Pwm { input: PwmInput::Pwm2 }),
    ]
}

fn standing(well: bool) -> impl Strategy<Value = Standing> {
    let status = if well {
        prop_oneof![Just(Status::Ok), Just(Status::Disabled)].boxed()
    } else {
        prop::sample::select(Status::ALL.to_vec()).boxed()
    };
    let health = if well { Just(0_u8).boxed() } else { (0_u8..8).boxed() };
    let alarms = if well { Just(0_u8).boxed() } else { any::<u8>().boxed() };
    (source(), status, health, alarms, prop::option::of(0_u64..1 << 50)).prop_map(
        |(source, status, health, alarms, age)| Standing {
            source,
            status,
            health: Health::from_bits(health),
            alarms: Alarms::from_bits(alarms),
            age_ms: age,
        },
    )
}

fn fault() -> impl Strategy<Value = Option<BusFault>> {
    prop::option::of(prop::sample::select(BusFault::ALL.map(|(fault, _)| fault).to_vec()))
}

fn bus_part() -> impl Strategy<Value = BusPart> {
    (fault(), any::<bool>(), any::<bool>()).prop_map(|(fault, forced, task)| BusPart { fault, forced, task })
}

fn parts() -> impl Strategy<Value = Parts> {
    (bus_part(), bus_part(), any::<[bool; 5]>()).prop_map(
        |(t7, isu, [unsaved, command, safe_mode, internal_clock, crashed])| Parts {
            t7,
            isu,
            unsaved,
            command,
            safe_mode,
            internal_clock,
            crashed,
        },
    )
}

fn of(slots: &[Standing], parts: &Parts) -> Summary {
    Summary::of(|slot| slots.get(slot).copied(), parts)
}

const QUIET: BusPart = BusPart { fault: None, forced: false, task: false };

proptest! {
    #[test]
    fn no_declared_fault_leaves_the_summary_clean(
        slots in prop::collection::vec(standing(false), 0..=MAX_SLOTS),
        parts in parts(),
    ) {
        let summary = of(&slots, &parts);
        let on = |standing: &&Standing| standing.status != Status::Disabled;
        let any_slot = slots.iter().filter(on).any(|slot| slot.status != Status::Ok || slot.health != Health::WELL);
        let Parts { unsaved, command, safe_mode, internal_clock, crashed, .. } = parts;
        let any_part = parts.t7 != QUIET || parts.isu != QUIET
            || unsaved || command || safe_mode || internal_clock || crashed;
        prop_assert_eq!(summary.signals.is_clean(), !any_slot && !any_part);
        prop_assert_eq!(summary.signals.names().next().is_none(), !any_slot && !any_part);
    }

    #[test]
    fn a_slot_of_a_faulty_bus_is_not_online(
        slots in prop::collection::vec(standing(false), 1..=MAX_SLOTS),
        parts in parts(),
    ) {
        let summary = of(&slots, &parts);
        for (index, slot) in slots.iter().enumerate() {
            let has = |set: u64| set >> index & 1 == 1;
            let faulty = match slot.source {
                Source::T7 { .. } => parts.t7.fault.is_some(),
                Source::Isu { .. } => parts.isu.fault.is_some(),
                _ => false,
            };
            prop_assert!(!(has(summary.online) && faulty), "{slot:?}");
            prop_assert_eq!(has(summary.valid), slot.status == Status::Ok);
            if !faulty {
                prop_assert_eq!(has(summary.online), slot.status.is_online());
            }
        }
        let on = slots.iter().filter(|slot| slot.status != Status::Disabled);
        prop_assert_eq!(usize::from(summary.enabled), on.clone().count());
        let oldest = on.map(|slot| slot.age_ms.unwrap_or(u64::MAX)).max().unwrap_or(0);
        prop_assert_eq!(summary.oldest_ms, oldest);
        prop_assert_eq!(summary.good(), summary.valid.count_ones());
    }

    /// Each signal alone: one part changed in a gateway that is well.
    #[test]
    fn each_part_sets_its_own_signal(slots in prop::collection::vec(standing(true), 1..=MAX_SLOTS)) {
        let clean = of(&slots, &Parts::default());
        prop_assert!(clean.signals.is_clean(), "{clean:?}");
        let part = |change: fn(&mut Parts)| {
            let mut parts = Parts::default();
            change(&mut parts);
            of(&slots, &parts).signals.names().collect::<Vec<_>>()
        };
        let told = [
            (part(|parts| parts.t7.forced = true), "driver_forced"),
            (part(|parts| parts.isu.forced = true), "driver_forced"),
            (part(|parts| parts.t7.task = true), "task"),
            (part(|parts| parts.isu.task = true), "task"),
            (part(|parts| parts.unsaved = true), "unsaved"),
            (part(|parts| parts.command = true), "command"),
            (part(|parts| parts.safe_mode = true), "safe_mode"),
            (part(|parts| parts.internal_clock = true), "internal_clock"),
            (part(|parts| parts.crashed = true), "crashed"),
        ];
        for (names, expected) in told {
            prop_assert_eq!(names, [expected]);
        }
        for (fault, _) in BusFault::ALL {
            let parts = Parts { isu: BusPart { fault: Some(fault), ..QUIET }, ..Parts::default() };
            let names: Vec<_> = of(&slots, &parts).signals.names().collect();
            prop_assert!(names.contains(&"isu_bus_fault") && !names.contains(&"t7_bus_fault"), "{names:?}");
        }
    }
}

#[test]
fn the_bits_are_those_of_the_map() {
    for (bit, (signal, ..)) in Signals::ALL.into_iter().enumerate() {
        assert_eq!(signal.bits(), 1 << bit);
    }
}

/// A pair that is stuck low makes bad answers, which are a sign of life on a bus without a fault only.
#[test]
fn a_pair_that_is_stuck_low_is_reported() {
    let isu = Source::Isu { address: isu::Address::new(1).unwrap() };
    let slot = Standing {
        source: isu,
        status: Status::BadAnswer,
        health: Health::WELL,
        alarms: Alarms::QUIET,
        age_ms: Some(5),
    };
    let broken = BusPart { fault: Some(BusFault::Break), ..QUIET };
    let summary = of(&[slot], &Parts { isu: broken, ..Parts::default() });
    let names: Vec<_> = summary.signals.names().collect();
    assert_eq!(names, ["isu_bus_dead", "isu_bus_fault", "slot_fault"]);
    assert_eq!((summary.online, summary.valid, summary.enabled), (0, 0, 1));
}

/// An alarm that waits for its acknowledgement is one, too; that of a slot that is off is none.
#[test]
fn alarms_are_summed_up_by_slot() {
    let source = Source::Pwm { input: PwmInput::Pwm1 };
    let slot = |status, bits| Standing {
        source,
        status,
        health: Health::WELL,
        alarms: Alarms::from_bits(bits),
        age_ms: Some(5),
    };
    let slots =
        [slot(Status::Ok, 0), slot(Status::Ok, 0x11), slot(Status::Ok, 0x80), slot(Status::Disabled, 0x11)];
    let summary = of(&slots, &Parts::default());
    assert_eq!((summary.alarms, summary.signals.names().collect::<Vec<_>>()), (0b0110, ["alarm"].to_vec()));
}

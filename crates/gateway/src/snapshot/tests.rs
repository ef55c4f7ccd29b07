//! A reader never sees a mix.

use std::sync::atomic::AtomicBool;
use std::thread;
use std::vec::Vec;

use super::*;
use crate::alarm::Alarms;
use crate::config::{PwmInput, Source};
use crate::{Health, Status};
use clino_bus::{Duration, Instant};
use clino_codec::angle::Angle;
use clino_codec::{isu, t7};

/// All numbers of a reading follow from one.
fn reading(slot: u8, n: u32) -> Reading {
    let source = match n % 5 {
        0 => Source::Off,
        1 => Source::T7 { address: t7::Address::new(slot + 1).unwrap(), axis: t7::Axis::Two },
        2 => Source::Isu { address: isu::Address::new(slot % 15).unwrap() },
        3 => Source::Pwm { input: PwmInput::Pwm1 },
        _ => Source::Pwm { input: PwmInput::Pwm2 },
    };
    Reading {
        slot,
        source,
        enabled: n.is_multiple_of(2),
        sequence: n,
        health: Health::from_bits(n as u8),
        alarms: Alarms::from_bits((n >> 2) as u8),
        fresh: n.is_multiple_of(3),
        status: Status::ALL[n as usize % Status::ALL.len()],
        raw: Angle::from_udeg(-(n as i32)),
        angle: Published::from_mdeg(n as i32),
        rate: -3 * n as i32,
        turns: n as i32 / 7,
        temperature: (!n.is_multiple_of(7)).then_some(-(n as i16)),
        measured: (!n.is_multiple_of(11)).then_some(Instant::from_micros(u64::from(n) * 0x1_0000_0001)),
        stale_after: Duration::from_micros(n + 1),
        period: Duration::from_micros(n + 2),
        report_every: Duration::from_micros(n + 3),
    }
}

/// The first slots.
fn first(count: usize) -> Bits {
    let mut bits = Bits::EMPTY;
    (0..count).for_each(|slot| bits.set(slot, true));
    bits
}

#[test]
fn a_reading_comes_back_as_it_was() {
    let snapshot = Snapshot::new();
    let mut publisher = snapshot.publisher();
    for n in 0..1_000 {
        publisher.publish(first(MAX_SLOTS), |slot| Some(reading(slot as u8, n + slot as u32)));
        snapshot.read(|view| {
            for slot in 0..MAX_SLOTS {
                assert_eq!(view.reading(slot), Some(reading(slot as u8, n + slot as u32)));
            }
        });
    }
}

#[test]
fn a_value_is_that_of_the_reading() {
    let snapshot = Snapshot::new();
    let mut publisher = snapshot.publisher();
    for n in 0..1_000_u32 {
        publisher.publish(first(1), |slot| Some(reading(slot as u8, n)));
        let measured = u64::from(n) * 0x1_0000_0001;
        // Before, at, and after the instant at which it grows stale.
        for late in [0, u64::from(n), u64::from(n) + 1, u64::from(n) + 2, 1 << 40] {
            let now = Instant::from_micros(measured + late);
            let view = snapshot.view();
            let (value, whole) = (view.value(0, now).unwrap(), view.reading(0).unwrap());
            let expected =
                Value { status: whole.status(now), angle: whole.angle(now), age_ms: whole.age_ms(now) };
            assert_eq!(value, expected, "{n} {late}");
            assert_eq!(view.brief(0, now), Some(whole.brief(now)), "{n} {late}");
            let Reading { source, health, alarms, .. } = whole;
            let standing =
                Standing { source, status: whole.status(now), health, alarms, age_ms: whole.age_ms(now) };
            assert_eq!(view.standing(0, now), Some(standing), "{n} {late}");
        }
    }
    assert_eq!(snapshot.view().value(MAX_SLOTS, Instant::ZERO), None);
}

#[test]
fn what_has_not_changed_is_there_in_both_buffers() {
    let snapshot = Snapshot::new();
    let mut publisher = snapshot.publisher();
    let mut now = [0_u32; MAX_SLOTS];
    // Of three slots at a time, and none sometimes.
    for n in 1..500_u32 {
        let mut changed = Bits::EMPTY;
        for slot in (0..n as usize % 4).map(|k| (n as usize * 7 + k * 11) % MAX_SLOTS) {
            now[slot] = n;
            changed.set(slot, true);
        }
        publisher.publish(changed, |slot| Some(reading(slot as u8, now[slot])));
        for (slot, &n) in now.iter().enumerate().filter(|&(_, &n)| n > 0) {
            assert_eq!(snapshot.read(|view| view.reading(slot)), Some(reading(slot as u8, n)));
        }
    }
}

#[test]
fn an_empty_snapshot_has_empty_slots() {
    let snapshot = Snapshot::new();
    for slot in 0..MAX_SLOTS {
        let reading = snapshot.read(|view| view.reading(slot)).unwrap();
        assert_eq!(
            (
                reading.source,
                reading.status(Instant::from_micros(0)),
                reading.age_ms(Instant::from_micros(0))
            ),
            (Source::Off, Status::Disabled, None)
        );
    }
    assert_eq!(snapshot.read(|view| view.reading(MAX_SLOTS)), None);
}

#[test]
fn a_disturbed_reader_looks_again() {
    let snapshot = Snapshot::new();
    let mut publisher = snapshot.publisher();
    let mut publish = |n| publisher.publish(first(2), |slot| Some(reading(slot as u8, n)));
    publish(1);
    let mut looks = 0;
    let seen = snapshot.read(|view| {
        looks += 1;
        let first = view.reading(0).unwrap().sequence;
        // Two generations while it looks: the buffer is no more what it was.
        if looks == 1 {
            publish(2);
            publish(3);
        }
        (first, view.reading(1).unwrap().sequence)
    });
    assert_eq!((looks, seen), (2, (3, 3)));
    // One generation does not disturb it.
    let mut looks = 0;
    snapshot.read(|_| {
        looks += 1;
        publish(4);
    });
    assert_eq!(looks, 1);
}

#[test]
fn no_reader_sees_two_generations_at_once() {
    let snapshot = Snapshot::new();
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut publisher = snapshot.publisher();
            for n in 1..20_000 {
                publisher.publish(first(MAX_SLOTS), |slot| Some(reading(slot as u8, n)));
            }
            done.store(true, Ordering::Relaxed);
        });
        let mut newest = 0;
        while !done.load(Ordering::Relaxed) {
            let all: Vec<Reading> =
                snapshot.read(|view| (0..MAX_SLOTS).filter_map(|slot| view.reading(slot)).collect());
            let n = all[0].sequence;
            assert!(n >= newest);
            newest = n;
            if n > 0 {
                assert!(all.iter().zip(0..).all(|(seen, slot)| *seen == reading(slot, n)), "{n}");
            }
        }
        assert!(newest > 0);
    });
}

//! Which slot is printed when.

use super::*;
use clino_bus::Duration;
use std::vec::Vec;

/// A slot whose value was ok at `measured` and is stale a second later.
#[derive(Clone, Copy)]
struct Row {
    slot: u8,
    sequence: u32,
    status: Status,
    alarms: Alarms,
    measured: Instant,
    report_every: Duration,
}

fn reading(slot: u8, sequence: u32, measured: u64, report_every_ms: u32) -> Row {
    Row {
        slot,
        sequence,
        status: Status::Ok,
        alarms: Alarms::QUIET,
        measured: Instant::from_micros(measured),
        report_every: Duration::from_millis(report_every_ms),
    }
}

impl Row {
    fn brief(&self, now: Instant) -> ReadingBrief {
        let stale = now > self.measured + Duration::from_millis(1_000);
        ReadingBrief {
            status: if self.status == Status::Ok && stale { Status::Stale } else { self.status },
            sequence: self.sequence,
            alarms: self.alarms,
            period: Duration::from_millis(33),
            report_every: self.report_every,
        }
    }
}

fn next(reporter: &mut Reporter, readings: &[Row], now_ms: u32) -> Option<u8> {
    let now = Instant::from_millis(now_ms);
    let next = reporter.next(|slot| readings.get(slot).map(|reading| reading.brief(now)), now);
    next.and_then(|report| readings.get(report.slot)).map(|reading| reading.slot)
}

#[test]
fn a_reading_is_printed_once() {
    let mut reporter = Reporter::new();
    let readings = [reading(0, 1, 0, 0)];
    assert_eq!(next(&mut reporter, &readings, 1), Some(0));
    assert_eq!(next(&mut reporter, &readings, 2), None);
    assert_eq!(next(&mut reporter, &[reading(0, 2, 0, 0)], 3), Some(0));
}

#[test]
fn a_slot_that_was_never_read_is_not_printed() {
    let never = Row { status: Status::NeverRead, ..reading(0, 0, 0, 0) };
    assert_eq!(next(&mut Reporter::new(), &[never], 1), None);
}

/// A sensor that is set up anew takes back the angle that was printed: a reader of the stream must not keep it.
#[test]
fn a_value_that_was_printed_is_taken_back() {
    let mut reporter = Reporter::new();
    assert_eq!(next(&mut reporter, &[reading(0, 1, 0, 1_000)], 1), Some(0));
    let never = Row { status: Status::NeverRead, ..reading(0, 2, 0, 1_000) };
    assert_eq!(next(&mut reporter, &[never], 2), Some(0), "at once");
    assert_eq!(next(&mut reporter, &[never], 5_000), None, "once");
}

#[test]
fn the_reporting_interval_is_kept_while_the_status_stays() {
    let mut reporter = Reporter::new();
    assert_eq!(next(&mut reporter, &[reading(0, 1, 0, 100)], 0), Some(0));
    assert_eq!(next(&mut reporter, &[reading(0, 2, 0, 100)], 99), None);
    assert_eq!(next(&mut reporter, &[reading(0, 3, 0, 100)], 100), Some(0));
}

#[test]
fn a_change_of_status_does_not_wait() {
    let mut reporter = Reporter::new();
    let ok = [reading(0, 1, 0, 0), reading(1, 1, 0, 1_000)];
    assert_eq!(next(&mut reporter, &ok, 0), Some(0));
    assert_eq!(next(&mut reporter, &ok, 0), Some(1));
    let lost = Row { status: Status::NoAnswer, ..reading(1, 2, 0, 1_000) };
    assert_eq!(next(&mut reporter, &[reading(0, 2, 0, 0), lost], 1), Some(1));
}

#[test]
fn growing_stale_is_a_change_of_status() {
    let mut reporter = Reporter::new();
    let readings = [reading(0, 1, 0, 0)];
    assert_eq!(next(&mut reporter, &readings, 0), Some(0));
    assert_eq!(next(&mut reporter, &readings, 1_000), None);
    assert_eq!(next(&mut reporter, &readings, 1_001), Some(0));
}

#[test]
fn the_slot_wanted_more_often_goes_first_and_none_starves() {
    // Slot 0 is to be printed every 33 ms, slots 1 to 3 every 100 ms; a line takes 9 ms.
    let mut reporter = Reporter::new();
    let mut printed: Vec<(u32, u8)> = Vec::new();
    for now in (0..2_000).step_by(9) {
        let sequence = now / 33;
        let readings = [
            reading(0, sequence, u64::from(now) * 1_000, 0),
            reading(1, now, u64::from(now) * 1_000, 100),
            reading(2, now, u64::from(now) * 1_000, 100),
            reading(3, now, u64::from(now) * 1_000, 100),
        ];
        printed.extend(next(&mut reporter, &readings, now).map(|slot| (now, slot)));
    }
    let times = |slot: u8| -> Vec<u32> { printed.iter().filter(|p| p.1 == slot).map(|p| p.0).collect() };
    let longest = |slot: u8| times(slot).windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    // A period, the rest of the line under way, one line.
    assert!(longest(0) <= 33 + 2 * 9, "{}", longest(0));
    for slot in 1..4 {
        assert!(longest(slot) <= 100 + 4 * 9, "slot {slot}: {}", longest(slot));
    }
}

/// A change of alarms is printed at once, one alarm at a time, and the reading keeps its turn.
#[test]
fn each_alarm_that_changes_is_printed_once_and_first() {
    let mut reporter = Reporter::new();
    let mut readings = [reading(0, 1, 0, 1_000), reading(1, 1, 0, 1_000)];
    let mut look = |readings: &[Row], now_ms| {
        let now = Instant::from_millis(now_ms);
        let report = reporter.next(|slot| readings.get(slot).map(|reading| reading.brief(now)), now);
        report.map(|report| (report.slot, report.alarm))
    };
    assert_eq!([look(&readings, 1), look(&readings, 1)], [Some((0, None)), Some((1, None))]);
    // High and rate are active, both unacknowledged.
    readings[1].alarms = Alarms::from_bits(0b0101_0101);
    let told = [look(&readings, 2), look(&readings, 2), look(&readings, 2)];
    assert_eq!(told, [Some((1, Some(Alarm::High))), Some((1, Some(Alarm::Rate))), None]);
    // High is acknowledged, rate has ended and latches.
    readings[1].alarms = Alarms::from_bits(0b0100_0001);
    let told = [look(&readings, 3), look(&readings, 3), look(&readings, 3)];
    assert_eq!(told, [Some((1, Some(Alarm::High))), Some((1, Some(Alarm::Rate))), None]);
}

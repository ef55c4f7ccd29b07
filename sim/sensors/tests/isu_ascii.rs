//! When an ISU sends ASCII lines ("Interfacing to an ISU Module", section 4).

mod common;

use clino_sim::isu::{Options, RxLow};
use clino_sim::latency::Latency;
use clino_sim::motion::Motion;
use clino_sim::node::Node;
use common::isu::{READ_ANGLE, bench};
use common::{Bench, MS, SECOND, US, bit, end};

#[test]
fn ascii_lines_as_long_as_rx_is_low_from_power_up() {
    let mut bench = bench(Options { motion: Motion::Constant(9_380_000), ..Options::default() });
    bench.node.power_off(0);
    bench.node_level(false);
    bench.node.power_on(0);
    bench.run_for(3 * SECOND);
    let starts: Vec<u64> = bench.bursts.iter().map(|b| b.drive_at).collect();
    assert_eq!(starts, (0..6).map(|k| 50 * MS + k * 8 * SECOND / 15).collect::<Vec<_>>());
    assert!(bench.bursts.iter().all(|b| b.bytes == b"+  9.38\r\n" && b.start_at - b.drive_at == MS));
    assert_eq!(bench.node.said().last().unwrap().microdegrees, 9_380_000);
    bench.node_level(true);
    bench.run_for(2 * SECOND);
    assert_eq!(bench.bursts.len(), 6);
    // From now on it takes a pulse.
    bench.node_level(false);
    bench.run_for(2 * SECOND);
    assert_eq!(bench.bursts.len(), 7);
}

#[test]
fn ascii_line_after_100_ms_low() {
    let mut bench = bench(Options::default());
    bench.run_for(SECOND);
    let fell = bench.now;
    bench.node_level(false);
    bench.run_for(100 * MS - US);
    bench.node_level(true);
    bench.run_for(SECOND);
    assert!(bench.bursts.is_empty(), "not quite 100 ms");
    assert_eq!(bench.now, fell + 1100 * MS - US);
    let fell = bench.now;
    bench.node_level(false);
    bench.run_for(3 * SECOND);
    assert_eq!(bench.bursts.len(), 1, "one line a pulse");
    assert_eq!(bench.bursts[0].drive_at, fell + 100 * MS);
}

#[test]
fn ascii_lines_never_come_faster_than_every_533_ms() {
    let mut bench = bench(Options::default());
    for _ in 0..10 {
        bench.node_level(false);
        bench.run_for(110 * MS);
        bench.node_level(true);
        bench.run_for(10 * MS);
    }
    bench.run_for(SECOND);
    let starts: Vec<u64> = bench.bursts.iter().map(|b| b.drive_at).collect();
    assert!(starts.len() >= 3, "{starts:?}");
    assert!(starts.windows(2).all(|w| w[1] - w[0] >= 8 * SECOND / 15), "{starts:?}");
}

#[test]
fn no_ascii_line_without_an_angle() {
    let mut bench = bench(Options::default());
    bench.node.eeprom.set_word(0, !bench.node.eeprom.word(0));
    bench.power_cycle(MS, SECOND);
    bench.node_level(false);
    bench.run_for(2 * SECOND);
    assert!(bench.bursts.is_empty());
}

#[test]
fn binary_characters_are_no_ascii_pulse() {
    let mut bench = bench(Options::default());
    // The level follows every bit of a command of zeros, as on a real pin.
    for i in 0..20 {
        bench.node_level(i % 2 == 0);
        bench.run_for(9 * bit(9_600));
    }
    bench.node_level(true);
    bench.run_for(SECOND);
    assert!(bench.bursts.is_empty());
}

#[test]
fn bursts_never_overlap() {
    let mut bench = bench(Options { latency: Latency::fixed(0), ..Options::default() });
    bench.node_level(false);
    // The line falls due in the middle of the answer.
    bench.run_for(94 * MS);
    bench.send(&READ_ANGLE);
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 2);
    assert!(bench.bursts[1].drive_at >= end(&bench.bursts[0]));
}

#[test]
fn half_a_command_before_a_line_is_forgotten() {
    let mut bench = bench(Options::default());
    // Write RAM of 200 bytes, of which no more come.
    bench.send(&[0xC8, 0x36]);
    bench.node_level(false);
    bench.run_for(120 * MS);
    bench.node_level(true);
    assert_eq!(bench.bursts.len(), 1);
    assert!(bench.ask_within(&READ_ANGLE, 20 * MS).is_some());
}

#[test]
fn a_module_with_rx_tied_low_prints_and_cannot_be_commanded() {
    let options = Options { motion: Motion::Constant(-4_310_000), ..Options::default() };
    let mut bench = Bench::new(RxLow::new(bench(options).node));
    bench.node_level(true);
    bench.run_for(SECOND);
    assert_eq!(bench.ask_within(&READ_ANGLE, 10 * MS), None);
    bench.run_until(3 * SECOND);
    let starts: Vec<u64> = bench.bursts.iter().map(|b| b.drive_at).collect();
    assert_eq!(starts, (0..6).map(|k| 50 * MS + k * 8 * SECOND / 15).collect::<Vec<_>>());
    assert!(bench.bursts.iter().all(|b| b.bytes == b"-  4.31\r\n"));
    // Still low when power comes back.
    bench.power_cycle(SECOND, SECOND);
    assert_eq!(bench.bursts.len(), 8);
}

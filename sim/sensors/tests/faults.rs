//! Sensors that misbehave on request, and nodes that stay in reach.

mod common;

use std::sync::{Arc, Mutex};

use clino_sim::fault::{AnswerFault, AnswerFaults};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu};
use clino_sim::node::Node;
use clino_sim::t7::{Identity, Options, StoredSettings, T7};
use common::{Bench, MS, SECOND, hex};

fn t7() -> T7 {
    T7::new(
        Identity::default(),
        StoredSettings { address: 5, ..StoredSettings::default() },
        Options::default(),
    )
    .unwrap()
}

fn isu() -> Isu {
    let content = Content { address: 3, ..Content::default() };
    let eeprom = Eeprom::factory(content, ChecksumScope::default(), 1);
    Isu::new(eeprom, clino_sim::isu::Options::default())
}

const ASK: &str = "05 01 83";
const GOOD: &str = "05 06 83 00 00 00 00 72";

#[test]
fn next_strikes_once() {
    for (fault, answer) in [
        (AnswerFault::BadChecksum, "05 06 83 00 00 00 00 8D"),
        (AnswerFault::Silent, ""),
        (AnswerFault::Truncated(3), "05 06 83"),
        (AnswerFault::Instead(hex("06 06 83")), "06 06 83"),
        (AnswerFault::WrongStatus(5), GOOD),
    ] {
        let mut bench = Bench::new(t7());
        bench.node.faults.next = Some(fault.clone());
        assert_eq!(bench.ask(ASK), answer, "{fault:?}");
        let told = if answer == GOOD { 1 } else { 0 };
        assert_eq!(bench.node.said().iter().count(), told, "{fault:?}");
        assert_eq!(bench.ask(ASK), GOOD);
        assert_eq!(bench.node.said().iter().count(), told + 1);
    }
}

#[test]
fn every_third() {
    let mut bench = Bench::new(t7());
    bench.node.faults = AnswerFaults { every: Some((3, AnswerFault::Silent)), ..AnswerFaults::default() };
    let heard: Vec<bool> = (0..7).map(|_| bench.ask(ASK) == GOOD).collect();
    assert_eq!(heard, [true, true, false, true, true, false, true]);
}

#[test]
fn wrong_status_is_under_a_right_checksum() {
    let mut bench = Bench::new(t7());
    bench.node.faults.next = Some(AnswerFault::WrongStatus(7));
    assert_eq!(bench.ask("05 04 89 02 01 6B"), "05 03 89 07 68");
}

#[test]
fn late_answer_comes_after_the_timeout() {
    let mut bench = Bench::new(t7());
    bench.node.faults.next = Some(AnswerFault::Late(30 * MS));
    let sent = bench.send(&hex(ASK));
    bench.run_for(SECOND);
    assert!(bench.bursts[0].start_at.abs_diff(sent + 32 * MS) <= 10);
    assert_eq!(bench.bursts[0].bytes, hex(GOOD));
    assert_eq!(bench.node.said().last().unwrap().at, bench.bursts[0].start_at);
}

#[test]
fn deaf_until_told_otherwise() {
    let mut bench = Bench::new(t7());
    bench.node.faults.deaf = true;
    assert_eq!(bench.ask(ASK), "");
    bench.node.faults.deaf = false;
    assert_eq!(bench.ask(ASK), GOOD);
}

#[test]
fn silent_set_is_carried_out() {
    let mut bench = Bench::new(t7());
    bench.node.faults.next = Some(AnswerFault::Silent);
    assert_eq!(bench.ask("05 04 8B 01 F4 77"), "");
    assert_eq!(bench.node.settings().damping_ms, 500);
}

#[test]
fn isu_faults() {
    let good = "04 35 58 00 00 8D";
    for (fault, answer) in [
        (AnswerFault::BadChecksum, "04 35 58 00 00 72"),
        (AnswerFault::Silent, ""),
        (AnswerFault::Truncated(5), "04 35 58 00 00"),
        (AnswerFault::WrongStatus(1), good),
    ] {
        let mut bench = Bench::new(isu());
        bench.node.faults.next = Some(fault.clone());
        assert_eq!(bench.ask("03 34 58 02 8E"), answer, "{fault:?}");
        assert_eq!(bench.ask("03 34 58 02 8E"), good);
    }
}

#[test]
fn a_shared_node_stays_in_reach() {
    let handle = Arc::new(Mutex::new(t7()));
    let boxed: Box<dyn Node> = Box::new(Arc::clone(&handle));
    let mut line = boxed;
    for (i, byte) in hex(ASK).into_iter().enumerate() {
        line.hear(clino_sim::node::Heard { at: i as u64 * 86_800, byte, framing_error: false });
    }
    handle.lock().unwrap().faults.next = Some(AnswerFault::Truncated(1));
    let at = line.next_event().unwrap();
    assert_eq!(line.act(at).unwrap().bytes, [5]);
}

#[test]
fn two_devices_with_one_address_answer_at_once() {
    let (mut a, mut b) = (Bench::new(t7()), Bench::new(t7()));
    a.ask(ASK);
    b.ask(ASK);
    assert_eq!(a.bursts[0].start_at, b.bursts[0].start_at);
}

//! Which slots read a node, and how long the node's answers are not used. The effect on a whole gateway is tested in
//! `crates/testkit/tests/meaning.rs`.

use super::*;
use crate::config::{PwmInput, SlotConfig};
use clino_codec::{isu, t7};
use std::vec::Vec;

fn t7(address: u8, axis: t7::Axis) -> SlotConfig {
    SlotConfig::usual(Source::T7 { address: t7::Address::of_request(address).unwrap(), axis })
}

fn isu(address: u8) -> SlotConfig {
    SlotConfig::usual(Source::Isu { address: isu::Address::new(address).unwrap() })
}

fn pwm(partner: Option<u8>) -> SlotConfig {
    SlotConfig { partner, ..SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 }) }
}

#[test]
fn every_slot_that_reads_a_node_is_found() {
    let table = [
        t7(3, t7::Axis::Zero),
        t7(3, t7::Axis::Two),
        t7(4, t7::Axis::Two),
        isu(3),
        isu(0),
        pwm(Some(3)),
        pwm(None),
        pwm(Some(2)),
        SlotConfig::OFF,
        t7(126, t7::Axis::Two),
        pwm(Some(47)),
    ];
    let slots: Vec<Polled> = table.into_iter().map(Polled::new).collect();
    let found = |bus, nodes| readers(&slots, bus, nodes).iter().collect::<Vec<_>>();
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 3)), [0, 1, 9]);
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 4)), [2, 7, 9], "and the input that is compared with it");
    assert_eq!(found(Bus::Isu, Nodes::at(Bus::Isu, 3)), [3, 4, 5]);
    assert_eq!(found(Bus::Isu, Nodes::at(Bus::Isu, 9)), [4], "every module answers to 0");
    assert_eq!(found(Bus::Isu, Nodes::at(Bus::Isu, 0)), [3, 4, 5]);
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 126)), [0, 1, 2, 7, 9]);
    assert_eq!(found(Bus::T7, Nodes::ALL), [0, 1, 2, 7, 9]);
    assert_eq!(found(Bus::T7, Nodes::NONE), []);
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 3).and(Nodes::at(Bus::T7, 4))), [0, 1, 2, 7, 9]);
}

#[test]
fn answers_are_used_again_after_the_end_of_the_task_and_the_settling_time() {
    let (node, other) = (Nodes::at(Bus::T7, 3), Nodes::at(Bus::T7, 4));
    let mut settling = Settling::default();
    assert!(!settling.holds(Nodes::ALL, Instant::from_micros(0)));
    settling.begin(node, Instant::from_micros(1_000));
    assert!(
        settling.holds(node, Instant::from_micros(900))
            && settling.holds(node, Instant::from_micros(9_999_999))
    );
    assert!(!settling.holds(other, Instant::from_micros(900)));
    settling.sent(Instant::from_micros(3_000));
    // What the task reads back changes nothing.
    settling.sent(Instant::from_micros(50_000));
    assert!(settling.holds(node, Instant::from_micros(9_999_999)), "the task goes on");
    settling.end();
    assert!(
        settling.holds(node, Instant::from_micros(2_999))
            && !settling.holds(node, Instant::from_micros(3_000))
    );
    // Once its time is over, the task of another node does not prolong it.
    settling.begin(other, Instant::from_micros(3_000));
    assert!(
        settling.holds(other, Instant::from_micros(4_000))
            && !settling.holds(node, Instant::from_micros(4_000))
    );
    // Before that it does.
    settling.sent(Instant::from_micros(8_000));
    settling.end();
    settling.begin(node, Instant::from_micros(7_000));
    assert!(settling.holds(other, Instant::from_micros(7_500)));
}

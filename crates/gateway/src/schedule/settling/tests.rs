//! Who is found, and how long a node is not believed. What a gateway makes of it is in `gateway/tests/meaning.rs`.

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
fn everybody_who_reads_a_node_is_found() {
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
    assert_eq!(found(Bus::Isu, Nodes::at(Bus::Isu, 9)), [4], "0 is every module's");
    assert_eq!(found(Bus::Isu, Nodes::at(Bus::Isu, 0)), [3, 4, 5]);
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 126)), [0, 1, 2, 7, 9]);
    assert_eq!(found(Bus::T7, Nodes::ALL), [0, 1, 2, 7, 9]);
    assert_eq!(found(Bus::T7, Nodes::NONE), []);
    assert_eq!(found(Bus::T7, Nodes::at(Bus::T7, 3).and(Nodes::at(Bus::T7, 4))), [0, 1, 2, 7, 9]);
}

#[test]
fn a_node_is_believed_when_the_task_has_ended_and_it_has_had_its_time() {
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
    // The task of another node does not bring it back, once its time is over.
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

//! Every warning, and a table without any.

use std::string::ToString;
use std::vec::Vec;

use super::*;
use crate::config::PwmInput;
use clino_bus::{Duration, Serial, Timing};
use clino_codec::{isu, t7};

fn t7(address: u8, ms: u32) -> SlotConfig {
    let address = t7::Address::of_request(address).unwrap();
    SlotConfig::usual(Source::T7 { address, axis: t7::Axis::Two }).every(Duration::from_millis(ms))
}

fn isu(address: u8, ms: u32) -> SlotConfig {
    SlotConfig::usual(Source::Isu { address: isu::Address::new(address).unwrap() })
        .every(Duration::from_millis(ms))
}

fn check(table: &[SlotConfig], damping_ms: fn(u8) -> Option<u16>) -> Vec<Finding> {
    let (t7, isu) = (BusSettings::new(Timing::t7(Serial::T7_DEFAULT)), BusSettings::new(Timing::isu()));
    let slot = |slot: u8| table.get(usize::from(slot)).copied();
    let mut findings = Vec::new();
    Lint { slot: &slot, t7: &t7, isu: &isu, damping_ms }.findings(&mut |finding| findings.push(finding));
    findings
}

fn said(table: &[SlotConfig]) -> Vec<std::string::String> {
    check(table, |_| None).iter().map(ToString::to_string).collect()
}

#[test]
fn a_full_table_has_no_warnings() {
    let pwm = |input| SlotConfig { partner: Some(32), ..SlotConfig::usual(Source::Pwm { input }) };
    let table: Vec<SlotConfig> = (1..=32)
        .map(|node| t7(node, 100))
        .chain((1..=14).map(|node| isu(node, 533)))
        .chain([pwm(PwmInput::Pwm1), pwm(PwmInput::Pwm2)])
        .collect();
    assert_eq!(check(&table, |_| Some(500)), []);
}

#[test]
fn the_load_is_that_of_the_documents() {
    let (t7_bus, isu_bus) =
        (BusSettings::new(Timing::t7(Serial::T7_DEFAULT)), BusSettings::new(Timing::isu()));
    let load = |table: &[SlotConfig], bus| {
        let slot = |slot: u8| table.get(usize::from(slot)).copied();
        Lint { slot: &slot, t7: &t7_bus, isu: &isu_bus, damping_ms: |_| None }.load(bus)
    };
    // 3.043 ms of 100 ms, 32 times: 97.4 %.
    let full: Vec<SlotConfig> = (1..=32).map(|node| t7(node, 100)).collect();
    assert_eq!(load(&full, Bus::T7), 98);
    assert_eq!(load(&full, Bus::Isu), 0);
    // 13.5 ms of 533 ms, 14 times: 35.5 %.
    let full: Vec<SlotConfig> = (1..=14).map(|node| isu(node, 533)).collect();
    assert_eq!(load(&full, Bus::Isu), 36);
    // 37 characters: 5.3 ms of 10 ms.
    let everything = SlotConfig { ask: Ask::Everything, ..t7(1, 10) };
    assert_eq!(load(&[everything], Bus::T7), 53);
    assert_eq!(load(&[SlotConfig { enabled: false, ..everything }], Bus::T7), 0);
    assert_eq!(load(&[t7(1, 0)], Bus::T7), 0, "as often as the bus can is not too often");
}

#[test]
fn each_finding_says_slot_and_limit() {
    let table: Vec<SlotConfig> = (1..=32).map(|node| t7(node, 90)).collect();
    assert_eq!(said(&table), ["bus t7: its slots ask for 109 % of what it can carry"]);
    assert_eq!(said(&[t7(1, 20), t7(2, 20), t7(1, 20)]), ["slot 2 reads the same as slot 0"]);
    assert_eq!(said(&[t7(1, 20), t7(126, 20)]), ["slot 1: all 2 nodes answer to address 126"]);
    assert_eq!(said(&[t7(126, 20)]), [""; 0], "one node may be asked so");
    assert_eq!(said(&[isu(0, 533), isu(3, 533)]), ["slot 0: all 2 nodes answer to address 0"]);
    assert_eq!(said(&[isu(1, 266)]), [""; 0], "as delivered");
    assert_eq!(said(&[isu(1, 265)]), ["slot 0: asked every 265 ms, new every 533 ms"]);
    let pwm = SlotConfig { partner: Some(0), ..SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 }) };
    assert_eq!(said(&[t7(1, 20), pwm]), ["slot 1: slot 0 reads no ISU"]);
    let damped = check(&[t7(1, 20), t7(2, 20)], |slot| Some(if slot == 0 { 124 } else { 125 }));
    assert_eq!(damped, [Finding::Damping { slot: 0, damping_ms: 124 }]);
    assert_eq!(damped[0].to_string(), "slot 0: damping 124 ms is less than the 125 ms of its bandwidth");
}

#[test]
fn two_axes_of_one_node_are_no_duplicate() {
    let axis = |axis| {
        let address = t7::Address::new(1).unwrap();
        SlotConfig::usual(Source::T7 { address, axis })
    };
    assert_eq!(said(&[axis(t7::Axis::Zero), axis(t7::Axis::One)]), [""; 0]);
}

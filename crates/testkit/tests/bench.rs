//! The rig itself: right answers come through it, and the wire carries what it should.

use clino_bus::{Isu, Serial, T7, Timing};
use clino_codec::t7::Axis;
use clino_codec::{isu, t7};
use clino_segment::log::{Fate, LineEvent, Talker};
use clino_segment::{Noise, SegmentSettings, chance::Chance};
use clino_sim::motion::Motion;
use clino_testkit::rig::{Bench, sensor};

const DEGREE: i64 = 1_000_000;

fn settings() -> SegmentSettings {
    SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() }
}

#[test]
fn a_t7_answers() {
    let options =
        clino_sim::t7::Options { motion: [const { Motion::Constant(30 * DEGREE) }; 3], ..Default::default() };
    let stored = clino_sim::t7::StoredSettings { address: 5, ..Default::default() };
    let node = clino_sim::t7::T7::new(clino_sim::t7::Identity::default(), stored, options).unwrap();
    let mut bench =
        Bench::<T7>::new(Timing::t7(Serial::T7_DEFAULT), settings(), vec![sensor("t7-5", Box::new(node))]);
    let address = t7::Address::new(5).unwrap();
    for _ in 0..3 {
        let answer = bench.ask(address, &t7::Request::GetAngle(Axis::Two)).result.expect("an answer");
        let t7::Response::GetAngle { angle, .. } = answer.response else { panic!("{answer:?}") };
        assert_eq!(angle, t7::Millidegrees(30_000));
    }
    let log = bench.port.log();
    let log = log.lock().unwrap();
    let sent: Vec<u16> = log
        .events
        .iter()
        .filter_map(|event| match event {
            LineEvent::Char { who: Talker::Gateway, word, fate: Fate::Clean, .. } => Some(*word),
            _ => None,
        })
        .collect();
    assert_eq!(sent, [5, 1, 0x83, 5, 1, 0x83, 5, 1, 0x83]);
}

#[test]
fn a_dead_isu_is_no_answer() {
    let mut bench = Bench::<Isu>::new(Timing::isu(), settings(), Vec::new());
    let outcome = bench.ask(isu::Address::new(3).unwrap(), &isu::Request::READ_ANGLE);
    assert!(matches!(outcome.result, Err(clino_bus::Fault::NoAnswer { .. })), "{:?}", outcome.result);
}

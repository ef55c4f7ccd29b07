//! Noise, unplugging, babble and spoilt answers.

use super::*;
use crate::log::Alteration;

const SECOND: Ns = 1_000_000_000;

fn probability(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

#[test]
fn bit_errors_come_as_often_as_asked_and_every_one_is_logged() {
    // Zeros have one falling edge a character: a receiver that lost a start bit is back at the next.
    let node = Puppet::default().says(1_000, &[0x00; 10_000]);
    let noise = Noise { bit_errors: probability(0.01), ..Noise::default() };
    let mut segment = on_at(SegmentSettings { noise, ..settings() }, vec![node.station()], BIT);
    let heard = listen(&mut segment, SECOND);
    // One start bit of a hundred is not seen, and 1 - 0.99^9 = 8.6 % of the others have a wrong bit.
    let lost = 10_000 - heard.len();
    let wrong = heard.iter().filter(|&&got| got != (0x00, false)).count();
    assert!((60..140).contains(&lost), "{lost}");
    assert!((740..970).contains(&wrong), "{wrong}");
    let flips: u32 = events(&segment)
        .iter()
        .map(|event| match event {
            LineEvent::Flipped { receiver: Talker::Gateway, bits, .. } => bits.count_ones(),
            _ => 0,
        })
        .sum();
    let wrong_bits: u32 = heard.iter().map(|&(word, framing)| word.count_ones() + u32::from(framing)).sum();
    assert_eq!(flips, wrong_bits);
}

#[test]
fn a_hit_bit_changes_that_bit_and_no_other() {
    let node = Puppet::default().says(1_000, &[0x00; 2_000]);
    let noise = Noise { bit_errors: probability(0.01), ..Noise::default() };
    let mut segment = on_at(SegmentSettings { noise, ..settings() }, vec![node.station()], BIT);
    listen(&mut segment, SECOND);
    let mut checked = 0;
    for pair in events(&segment).windows(2) {
        if let [LineEvent::Flipped { bits, .. }, LineEvent::Heard { word, framing_error, .. }] = pair {
            assert_eq!(*word, (bits >> 1) & 0xFF, "bits {bits:#x}");
            assert_eq!(*framing_error, bits & 0x200 != 0);
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn receivers_lose_characters_independently() {
    let talker = Puppet::default().says(1_000, &[0x55; 5_000]);
    let listeners = [Puppet::default(), Puppet::default()];
    let noise = Noise { drops: probability(0.1), ..Noise::default() };
    let stations = vec![talker.station(), listeners[0].station(), listeners[1].station()];
    let mut segment = on_at(SegmentSettings { noise, ..settings() }, stations, BIT);
    let gateway = listen(&mut segment, SECOND).len();
    for lost in [gateway, listeners[0].heard().len(), listeners[1].heard().len()].map(|got| 5_000 - got) {
        // Four standard deviations of 500.
        assert!((415..585).contains(&lost), "{lost}");
    }
    let logged = |receiver| {
        let hit = |event: &&LineEvent| matches!(event, LineEvent::Dropped { receiver: who, .. } if *who == receiver);
        events(&segment).iter().filter(hit).count()
    };
    assert_eq!(logged(Talker::Gateway), 5_000 - gateway);
    assert_eq!(logged(Talker::Node(1)), 5_000 - listeners[0].heard().len());
}

#[test]
fn noise_keeps_to_its_interval() {
    let node = Puppet::default().says(0, &[0x55; 1_000]);
    let within = Some((20_000_000, 40_000_000));
    let noise = Noise { bit_errors: probability(0.2), drops: probability(0.2), within };
    let mut segment = on_at(SegmentSettings { noise, ..settings() }, vec![node.station()], BIT);
    listen(&mut segment, SECOND);
    let hits: Vec<Ns> = events(&segment)
        .iter()
        .filter(|event| matches!(event, LineEvent::Flipped { .. } | LineEvent::Dropped { .. }))
        .map(LineEvent::at)
        .collect();
    assert!(hits.len() > 100);
    assert!(hits.iter().all(|at| (20_000_000..40_000_000 + CHAR_NS).contains(at)));
}

#[test]
fn an_unplugged_node_is_cut_in_mid_character_hears_nothing_and_comes_back() {
    let node = Puppet::default().says(1_000_000, &[0x00, 0x00]).says(9_000_000, &[0x77]);
    let cut = 1_000_000 + (9 * BIT / 2) / 1_000;
    let faults = Faults { unplugged: vec![(cut, 5_000_000)], ..Faults::default() };
    let mut segment = segment(vec![node.with(faults)]);
    play(&mut segment, 2_000_000);
    poll(&mut segment, 2_000_000, &[0x05]);
    poll(&mut segment, 6_000_000, &[0x06]);
    assert_eq!(listen(&mut segment, 10_000_000), [(0b1111_1000, false), (0x77, false)]);
    assert_eq!(node.heard(), [(0x06, false)]);
    assert_eq!(node.0.lock().unwrap().powers, [(cut, false), (5_000_000, true)]);
    let fates = fates(&segment, Talker::Node(0));
    assert_eq!(fates, [(0x00, Fate::Cut { at: cut }), (0x77, Fate::Clean)]);
}

#[test]
fn a_node_unplugged_from_the_start_is_dead() {
    let node = Puppet::default().says(1_000, &[0x12]);
    let faults = Faults { unplugged: vec![(0, SECOND)], ..Faults::default() };
    let mut segment = segment(vec![node.with(faults)]);
    poll(&mut segment, 1_000_000, &[0x05]);
    assert_eq!(listen(&mut segment, 10_000_000), []);
    assert_eq!(node.heard(), []);
}

#[test]
fn a_babbling_node_holds_the_line_for_its_interval() {
    let node = Puppet::default();
    let babble = vec![Babble { from: 1_000_000, until: 2_000_000, gap: 0 }];
    let mut segment = segment(vec![node.with(Faults { babble, ..Faults::default() })]);
    let heard = listen(&mut segment, 5_000_000);
    // 1 ms / 86.805 us = 11.5: twelve characters begin.
    assert_eq!(heard.len(), 12);
    let distinct: std::collections::BTreeSet<u16> = heard.iter().map(|got| got.0).collect();
    assert!(distinct.len() > 6, "{distinct:?}");
    let drives: Vec<(Ns, bool)> = events(&segment)
        .iter()
        .filter_map(|event| match *event {
            LineEvent::Drive { at, on, .. } => Some((at, on)),
            _ => None,
        })
        .collect();
    assert!(matches!(drives[..], [(1_000_000, true), (2_041_000..2_043_000, false)]), "{drives:?}");
}

#[test]
fn a_babbling_node_with_pauses_lets_go_between_and_never_answers() {
    let node = Puppet::default().says(1_500_000, &[0x99; 4]);
    let babble = vec![Babble { from: 1_000_000, until: 3_000_000, gap: 200_000 }];
    let mut segment = segment(vec![node.with(Faults { babble, ..Faults::default() })]);
    // One character every 286.8 us for 2 ms.
    assert_eq!(listen(&mut segment, 5_000_000).len(), 7);
    let drives = events(&segment).iter().filter(|event| matches!(event, LineEvent::Drive { .. })).count();
    assert_eq!(drives, 14);
}

#[test]
fn answers_are_spoilt_as_often_as_asked() {
    let answer = [0x05, 0x06, 0x83, 0x00, 0x00, 0x4E, 0xDE, 0x46];
    let mut node = Puppet::default();
    for n in 1..=1_000 {
        node = node.says(n * 1_000_000, &answer);
    }
    let faults = Faults { corrupt: probability(0.2), shorten: probability(0.1), ..Faults::default() };
    let mut segment = segment(vec![node.with(faults)]);
    let heard = listen(&mut segment, 2 * SECOND);
    let (mut corrupted, mut shortened, mut missing) = (0, 0, 0);
    for event in events(&segment) {
        match event {
            LineEvent::Altered { how: Alteration::Corrupted { mask, .. }, .. } => {
                assert_ne!(mask, 0);
                corrupted += 1;
            }
            LineEvent::Altered { how: Alteration::Shortened { length }, .. } => {
                assert!((1..8).contains(&length));
                shortened += 1;
                missing += 8 - length;
            }
            _ => {}
        }
    }
    assert!((60..140).contains(&shortened), "{shortened}");
    assert!((130..240).contains(&corrupted), "{corrupted}");
    assert_eq!(heard.len(), 8_000 - missing);
}

#[test]
fn thirty_two_nodes_for_a_minute_of_traffic_are_affordable() {
    // Not a benchmark: guards against a cost that grows with the length of the run.
    let nodes: Vec<Puppet> = (0..32).map(|_| Puppet::default()).collect();
    let mut segment = segment(nodes.iter().map(Puppet::station).collect());
    let mut now = 0;
    for _ in 0..1_000 {
        now = poll(&mut segment, now + 2_000_000, &[0x05, 0x01, 0x83]);
    }
    play(&mut segment, now + SECOND);
    assert!(nodes.iter().all(|node| node.heard().len() == 3_000));
    assert!(segment.line.remembered() < 20, "{}", segment.line.remembered());
}

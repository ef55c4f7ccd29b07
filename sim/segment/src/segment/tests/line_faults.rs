//! A shorted pair, and a driver of the gateway's that cannot be switched off.

use super::*;

const MS: Ns = 1_000_000;

fn stuck(from: Ns, until: Ns, high: bool, stations: Vec<Station>) -> Segment {
    let faults = LineFaults { stuck: vec![StuckLine { from, until, high }], ..LineFaults::default() };
    segment(stations).with_faults(faults)
}

fn shorted(from: Ns, until: Ns, echo: bool, stations: Vec<Station>) -> Segment {
    let faults = LineFaults { de_shorted: vec![(from, until)], ..LineFaults::default() };
    on_at(SegmentSettings { echo, ..settings() }, stations, BIT).with_faults(faults)
}

#[test]
fn a_line_shorted_low_is_one_character_of_zeros_and_then_nothing() {
    let node = Puppet::default().says(2 * MS, &[0x55]).says(9 * MS, &[0x77]);
    let other = Puppet::default();
    let stations = vec![node.station(), other.station()];
    let mut segment = stuck(MS, 8 * MS, false, stations);
    assert_eq!(listen(&mut segment, 7 * MS), [(0x00, true)]);
    // The end of the short is a rising edge, which is no character.
    assert_eq!(listen(&mut segment, 10 * MS), [(0x77, false)]);
    assert_eq!(other.heard(), [(0x00, true), (0x77, false)]);
    assert_eq!(fates(&segment, Talker::Node(0)), [(0x55, Fate::Fought), (0x77, Fate::Clean)]);
}

#[test]
fn each_time_the_gateway_lets_go_of_a_low_line_it_hears_zeros() {
    // RE̅ is off with DE on: RO is pulled up, and falls when DE does.
    let mut segment = stuck(MS / 2, 8 * MS, false, vec![]);
    assert_eq!(listen(&mut segment, MS), [(0x00, true)]);
    poll(&mut segment, 2 * MS, &[0x12, 0x34]);
    assert_eq!(listen(&mut segment, 7 * MS), [(0x00, true)]);
}

#[test]
fn a_line_shorted_high_is_silent() {
    let node = Puppet::default().says(2 * MS, &[0x55]).says(9 * MS, &[0x77]);
    let mut segment = stuck(MS, 8 * MS, true, vec![node.station()]);
    poll(&mut segment, 4 * MS, &[0x12]);
    assert_eq!(listen(&mut segment, 10 * MS), [(0x77, false)]);
    assert_eq!(node.heard(), [], "nor does the gateway reach a node");
}

#[test]
fn with_its_de_shorted_the_gateway_is_deaf_and_spoils_what_others_say() {
    let talker = Puppet::default().says(2 * MS, &[0x55; 40]).says(9 * MS, &[0x77]);
    let listener = Puppet::default();
    let stations = vec![talker.station(), listener.station()];
    let mut segment = shorted(MS, 8 * MS, false, stations);
    assert_eq!(listen(&mut segment, 10 * MS), [(0x77, false)]);
    let spoilt = listener.heard();
    assert_eq!(spoilt.last(), Some(&(0x77, false)));
    // Four zeros in each, every one of them left to chance: one in sixteen gets through.
    assert!(spoilt.iter().filter(|&&got| got == (0x55, false)).count() < 10, "{spoilt:?}");
    assert!(fates(&segment, Talker::Node(0)).iter().take(40).all(|&(_, fate)| fate == Fate::Fought));
}

#[test]
fn with_its_de_shorted_the_gateway_still_reaches_the_others() {
    let listener = Puppet::default();
    let mut segment = shorted(MS, 8 * MS, false, vec![listener.station()]);
    poll(&mut segment, 3 * MS, &[0x12, 0x34]);
    play(&mut segment, 10 * MS);
    assert_eq!(listener.heard(), [(0x12, false), (0x34, false)]);
    // Its pin is logged as it is, not what the short makes of it.
    let de = |event: &&LineEvent| matches!(event, LineEvent::De { .. });
    assert_eq!(events(&segment).iter().filter(de).count(), 2);
}

#[test]
fn with_its_de_shorted_a_receiver_that_is_always_on_hears_the_fight() {
    let talker = Puppet::default().says(2 * MS, &[0x55; 40]);
    let mut segment = shorted(MS, 8 * MS, true, vec![talker.station()]);
    let heard = listen(&mut segment, 8 * MS);
    assert!(heard.iter().filter(|&&got| got != (0x55, false)).count() > 10, "{heard:?}");
}

//! More than one talker.

use super::*;

fn contentions(segment: &Segment) -> Vec<(Ns, Ns, Vec<Talker>, bool)> {
    events(segment)
        .iter()
        .filter_map(|event| match event {
            LineEvent::Contention { from, until, who, fought } => Some((*from, *until, who.clone(), *fought)),
            _ => None,
        })
        .collect()
}

#[test]
fn two_answers_at_once_spoil_each_other_and_are_logged() {
    let a = Puppet::default().says(1_000_000, &[0x00; 8]);
    let b = Puppet::default().says(1_000_000, &[0xFF; 8]);
    let mut segment = segment(vec![a.station(), b.station()]);
    let heard = listen(&mut segment, 3_000_000);
    assert_ne!(heard, vec![(0x00, false); 8]);
    assert_ne!(heard, vec![(0xFF, false); 8]);
    assert!(fates(&segment, Talker::Node(0)).iter().all(|&(_, fate)| fate == Fate::Fought));
    assert!(fates(&segment, Talker::Node(1)).iter().all(|&(_, fate)| fate == Fate::Fought));
    let end = 1_000_000 + 80 * BIT / 1_000;
    assert_eq!(contentions(&segment), [(1_000_000, end, vec![Talker::Node(0), Talker::Node(1)], true)]);
    let noisy = events(&segment).iter().any(|event| matches!(event, LineEvent::Heard { noise: true, .. }));
    assert!(noisy);
}

#[test]
fn the_same_answer_at_the_same_time_is_an_overlap_without_harm() {
    let (a, b) = (Puppet::default().says(1_000_000, &[0x37]), Puppet::default().says(1_000_000, &[0x37]));
    let mut segment = segment(vec![a.station(), b.station()]);
    assert_eq!(listen(&mut segment, 3_000_000), [(0x37, false)]);
    assert!(matches!(contentions(&segment)[..], [(_, _, _, false)]));
}

#[test]
fn the_gateway_raising_de_while_a_node_still_holds_is_contention_and_a_start_bit_in_it_is_fought() {
    let hold = 50_000;
    let answer = Burst { drive_at: 1_000_000, start_at: 1_000_000, bytes: vec![0x11], baud: BAUD, hold };
    let released = 1_000_000 + CHAR_NS + hold;
    for (de, expected) in [(released - 20_000, Some(true)), (released + 1_000, None)] {
        let node = Puppet::default().bursts(answer.clone());
        let mut segment = segment(vec![node.station()]);
        poll(&mut segment, de, &[0x05]);
        play(&mut segment, 3_000_000);
        segment.advance(3_000_000);
        let got = contentions(&segment);
        assert_eq!(got.first().map(|&(.., fought)| fought), expected, "DE at {de}");
        if expected.is_some() {
            assert_eq!((got[0].0, got[0].1), (de, released));
            assert_eq!(got[0].2, [Talker::Gateway, Talker::Node(0)]);
        }
    }
}

#[test]
fn de_rising_within_an_answer_hides_the_rest_of_it_from_the_gateway() {
    let node = Puppet::default().says(1_000_000, &[0x00, 0x55]);
    let mut segment = segment(vec![node.station()]);
    // After data bit 1's centre (3 bits in), the receiver output is pulled up: bits 2 to 7 and stop read high.
    let de = 1_000_000 + 3 * BIT / 1_000;
    play(&mut segment, de);
    segment.drive_enable(de, true);
    assert_eq!(listen(&mut segment, 3_000_000), [(0b1111_1100, false)]);
}

#[test]
fn de_falling_within_a_zero_of_an_answer_looks_like_a_start_bit() {
    let node = Puppet::default().says(1_000_000, &[0x00]);
    let mut segment = segment(vec![node.station()]);
    segment.drive_enable(900_000, true);
    // At 4.0 bits the line is low: start bit there; then 5 low bits, stop and idle read as ones.
    let fall = 1_000_000 + (4 * BIT) / 1_000;
    play(&mut segment, fall);
    segment.drive_enable(fall, false);
    // 0x00 lasts to bit 9; DE falls at 4, start = bit 4, data 0..3 = bits 5..8, low; 4.. = stop and idle.
    assert_eq!(listen(&mut segment, 3_000_000), [(0b1111_0000, false)]);
}

#[test]
fn fights_go_the_same_way_for_the_same_seed_and_differ_between_seeds() {
    let run = |seed| {
        let a = Puppet::default().says(1_000_000, &[0x00; 16]);
        let b = Puppet::default().says(1_000_000, &[0xFF; 16]);
        let settings = SegmentSettings { chance: Chance::new(seed), ..settings() };
        let mut segment = on_at(settings, vec![a.station(), b.station()], BIT);
        listen(&mut segment, 5_000_000)
    };
    assert_eq!(run(1), run(1));
    assert!((2..20).any(|seed| run(seed) != run(1)));
}

#[test]
fn sharing_a_decoded_character_gives_what_each_would_have_sampled() {
    // The same traffic with listeners at the same rate (which share) and at rates one ppm apart (which cannot).
    let bytes: Vec<u8> = (0..=255).collect();
    let run = |bauds: [u32; 3]| {
        let talkers = [
            Puppet::default().says(1_000_000, &bytes).says(40_000_000, &[0x00; 40]),
            Puppet::default().says(40_030_000, &[0xA5; 30]),
        ];
        let listeners = bauds.map(|baud| Puppet::default().at_baud(baud));
        let stations = talkers.iter().chain(&listeners).map(Puppet::station).collect();
        let mut segment = segment(stations);
        segment.advance(60_000_000);
        listeners.map(|listener| listener.heard())
    };
    let shared = run([BAUD, BAUD, BAUD]);
    assert_eq!(shared[0], shared[1]);
    assert_eq!(shared[0], shared[2]);
    for baud in [BAUD - 1, BAUD, BAUD + 1] {
        // A lone listener shares only with the gateway's receiver.
        let alone = run([baud, BAUD - 20, BAUD + 20]);
        assert_eq!(alone[0], shared[0], "{baud}");
    }
}

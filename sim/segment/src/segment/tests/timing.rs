//! One talker at a time: what each receiver hears, and when.

use super::*;

#[test]
fn what_one_sends_the_others_hear_at_the_centre_of_the_stop_bit() {
    let (near, far) = (Puppet::default(), Puppet::default().says(5_000_000, &[0x00, 0xFF, 0x5A]));
    let mut segment = segment(vec![near.station(), far.station()]);
    poll(&mut segment, 1_000_000, &[0x05, 0x01, 0x83]);
    play(&mut segment, 5_000_000);
    let mut got = Vec::new();
    while let Some(next) = segment.next_event() {
        segment.advance(next);
        while let Some(received) = segment.take_received() {
            // It is there at the event, not before and not after.
            assert_eq!(received.at, next);
            got.push(received);
        }
    }
    let centres: Vec<Ns> =
        (0..3u64).map(|n| 5_000_000 + ((10 * n) * BIT + 19 * BIT / 2).div_ceil(1_000)).collect();
    assert_eq!(got.iter().map(|got| got.at).collect::<Vec<_>>(), centres);
    assert_eq!(got.iter().map(|got| got.word).collect::<Vec<_>>(), [0x00, 0xFF, 0x5A]);
    assert!(got.iter().all(|got| !got.framing_error && !got.noise));
    assert_eq!(near.heard(), [0x05, 0x01, 0x83, 0x00, 0xFF, 0x5A].map(|byte| (byte, false)));
    assert_eq!(far.heard(), [0x05, 0x01, 0x83].map(|byte| (byte, false)));
    assert!(fates(&segment, Talker::Gateway).iter().all(|&(_, fate)| fate == Fate::Clean));
}

#[test]
fn every_byte_value_survives_in_both_directions() {
    let all: Vec<u8> = (0..=255).collect();
    let node = Puppet::default().says(30_000_000, &all);
    let mut segment = segment(vec![node.station()]);
    poll(&mut segment, 1_000, &all);
    let heard = listen(&mut segment, 60_000_000);
    assert_eq!(heard, (0..=255).map(|byte| (byte, false)).collect::<Vec<(u16, bool)>>());
    assert_eq!(node.heard(), all.iter().map(|&byte| (byte, false)).collect::<Vec<_>>());
}

#[test]
fn with_de_low_nothing_reaches_the_line() {
    let node = Puppet::default();
    let mut segment = segment(vec![node.station()]);
    let end = send(&mut segment, 1_000, &[0x05]);
    segment.advance(end + CHAR_NS);
    assert_eq!(node.heard(), []);
    assert_eq!(fates(&segment, Talker::Gateway), [(0x05, Fate::Undriven)]);
}

#[test]
fn de_falling_within_a_character_cuts_it() {
    let node = Puppet::default();
    let mut segment = segment(vec![node.station()]);
    segment.drive_enable(1_000, true);
    send(&mut segment, 1_000, &[0x00]);
    // In the middle of data bit 3 of eight zeros: the bias makes the rest ones.
    let cut = 1_000 + (9 * BIT / 2) / 1_000;
    play(&mut segment, cut);
    segment.drive_enable(cut, false);
    play(&mut segment, 1_000_000);
    assert_eq!(node.heard(), [(0b1111_1000, false)]);
    segment.advance(1_000_000);
    assert_eq!(fates(&segment, Talker::Gateway), [(0x00, Fate::Cut { at: cut })]);
}

#[test]
fn de_rising_within_a_character_lets_only_its_tail_out() {
    let node = Puppet::default();
    let mut segment = segment(vec![node.station()]);
    send(&mut segment, 1_000, &[0x00]);
    let late = 1_000 + 2 * BIT / 1_000;
    segment.drive_enable(late, true);
    segment.advance(1_000_000);
    // Seven of nine low bits are left: one is taken for the start bit, six for data.
    assert_eq!(node.heard(), [(0b1100_0000, false)]);
    assert_eq!(fates(&segment, Talker::Gateway), [(0x00, Fate::Late { at: late })]);
}

#[test]
fn de_falling_at_the_very_end_of_the_stop_bit_cuts_nothing() {
    let mut segment = segment(vec![]);
    // A bit time of whole nanoseconds, so that the end is one too.
    segment.drive_enable(0, true);
    segment.send(Sent { start: 0, word: 0xA5, format: format(8_680_000) });
    segment.drive_enable(86_800, false);
    segment.advance(1_000_000);
    assert_eq!(fates(&segment, Talker::Gateway), [(0xA5, Fate::Clean)]);
}

#[test]
fn the_gateway_hears_itself_only_with_echo() {
    for (echo, expected) in [(false, vec![]), (true, vec![(0x12, false), (0x34, false)])] {
        let mut segment = on_at(SegmentSettings { echo, ..settings() }, vec![], BIT);
        poll(&mut segment, 1_000, &[0x12, 0x34]);
        assert_eq!(listen(&mut segment, 1_000_000), expected, "echo {echo}");
    }
}

#[test]
fn a_receiver_that_is_off_hears_nothing_and_one_switched_on_late_waits_for_a_start_bit() {
    let node = Puppet::default().says(1_000_000, &[0x00, 0x55]);
    let mut segment = Segment::new(settings(), vec![node.station()]);
    play(&mut segment, 1_030_000);
    // Within the zeros of the first character: low is no start bit, only the second counts.
    segment.set_receiver(1_030_000, Some(format(BIT)));
    assert_eq!(listen(&mut segment, 2_000_000), [(0x55, false)]);
}

#[test]
fn a_node_hears_itself_only_when_it_is_not_deaf() {
    let deaf = Puppet::default().says(1_000, &[0x42]);
    let open = Puppet::default().hears_itself().says(1_000_000, &[0x43]);
    let mut segment = segment(vec![deaf.station(), open.station()]);
    segment.advance(2_000_000);
    assert_eq!(deaf.heard(), [(0x43, false)]);
    assert_eq!(open.heard(), [(0x42, false), (0x43, false)]);
}

#[test]
fn half_the_baud_rate_comes_out_as_the_bytes_a_uart_would_sample() {
    // 0x57 at 57600 as seen at 115200: each bit twice. 0 11 10 11 ... computed by hand below.
    let node = Puppet::default().at_baud(57_600).says(1_000_000, &[0x57]);
    let mut segment = segment(vec![node.station()]);
    // Line in units of the fast bit: start 00, then 0x57 lsb first 1 1 1 0 1 0 1 0 doubled, stop 11.
    // First fast character: start 0, data 0 111111 0, stop 0 -> 0x7E, framing error, at fast bit 9.
    // Low until fast bit 10; then 11 (bits 10, 11); falling edge at 12: start 0, data 0 11 00 11 1, stop 1.
    let first = (0b0111_1110, true);
    let second = (0b1110_0110, false);
    assert_eq!(listen(&mut segment, 3_000_000), [first, second]);
}

#[test]
fn a_small_baud_error_does_no_harm_and_a_large_one_does() {
    let bytes = [0x00, 0xFF, 0x55, 0xAA, 0x80];
    let clean: Vec<(u16, bool)> = bytes.iter().map(|&byte| (u16::from(byte), false)).collect();
    // The stop bit's centre is 9.5 bits after the edge: half a bit of slack is 5.2 %.
    for (percent, harmless) in
        [(-4, true), (-2, true), (0, true), (2, true), (4, true), (-7, false), (7, false)]
    {
        let bit = (BIT as i64 * (100 + percent) / 100) as u64;
        let node = Puppet::default().says(1_000_000, &bytes);
        let mut segment = on_at(settings(), vec![node.station()], bit);
        let heard = listen(&mut segment, 3_000_000);
        assert_eq!(heard == clean, harmless, "{percent} %: {heard:02x?}");
    }
}

#[test]
fn nine_data_bits_are_carried() {
    let mut segment = on_at(SegmentSettings { echo: true, ..settings() }, vec![], BIT);
    let nine = Format { bit_ps: BIT, data_bits: 9, stop_halves: 4 };
    segment.set_receiver(0, Some(nine));
    segment.drive_enable(1_000, true);
    segment.send(Sent { start: 1_000, word: 0x1A5, format: nine });
    assert_eq!(listen(&mut segment, 1_000_000), [(0x1A5, false)]);
    let lengths: Vec<Ns> = events(&segment)
        .iter()
        .filter_map(|event| match event {
            LineEvent::Char { start, end, .. } => Some(end - start),
            _ => None,
        })
        .collect();
    assert_eq!(lengths, [12 * BIT / 1_000]);
}

#[test]
fn nodes_see_every_level_change_in_order() {
    let (talker, listener) = (Puppet::default().says(1_000_000, &[0x0F]), Puppet::default());
    let mut segment = segment(vec![talker.station(), listener.station()]);
    segment.advance(2_000_000);
    let at = |bits: u64| 1_000_000 + (bits * BIT).div_ceil(1_000);
    let expected = [(at(0), false), (at(1), true), (at(5), false), (at(9), true)];
    assert_eq!(listener.0.lock().unwrap().levels, expected);
}

#[test]
fn calling_advance_more_often_than_asked_changes_nothing() {
    let run = |step: Ns| {
        let near = Puppet::default();
        let far = Puppet::default().says(2_000_000, &[1, 2, 3]).says(2_900_000, &[4]);
        let noise = Noise {
            bit_errors: Probability::new(0.05).unwrap(),
            drops: Probability::new(0.05).unwrap(),
            within: None,
        };
        let mut segment =
            on_at(SegmentSettings { noise, ..settings() }, vec![near.station(), far.station()], BIT);
        poll(&mut segment, 1_000_000, &[9, 8, 7]);
        let mut now = 1_300_000;
        while now < 4_000_000 {
            segment.advance(now);
            now += step;
        }
        segment.advance(4_000_000);
        (events(&segment), near.heard(), far.heard())
    };
    assert_eq!(run(4_000_000), run(777));
}

//! Rules of "Interfacing to an ISU Module" beyond its examples: addresses, resynchronisation, time, error
//! states, ASCII mode.

mod common;

use clino_sim::isu::{AnswerAddress, Options, OthersAnswers, WriteRamEcho};
use clino_sim::latency::Latency;
use clino_sim::motion::Motion;
use clino_sim::node::{Heard, Node};
use common::isu::{READ_ANGLE, angle, at_address, bench, read_angle, summed};
use common::{MS, SECOND, US, bit, hex};

#[test]
fn answers_at_its_own_address_and_at_0_only() {
    for own in [0, 3, 14, 15] {
        for asked in 0..16 {
            let mut bench = at_address(own, Options::default());
            let answered = bench.ask_within(&read_angle(asked), SECOND);
            assert_eq!(answered.is_some(), asked == 0 || (asked == own && own != 15), "{own}, {asked}");
        }
    }
}

#[test]
fn answer_at_address_0_carries_0_or_the_own_address() {
    assert_eq!(bench(Options::default()).ask("03 04 58 02 5E"), "04 05 58 00 00 5D");
    let options = Options { answer_address: AnswerAddress::Own, ..Options::default() };
    assert_eq!(bench(options).ask("03 04 58 02 5E"), "04 35 58 00 00 8D");
}

#[test]
fn write_ram_echoes_byte_or_count() {
    let options = Options { write_ram_echo: WriteRamEcho::Count, ..Options::default() };
    assert_eq!(bench(options).ask("04 36 20 AB CD CE"), "03 37 20 02 59");
}

#[test]
fn wrong_checksum_for_another_module_is_not_ours() {
    assert_eq!(bench(Options::default()).ask("03 44 58 02 9F"), "");
}

#[test]
fn txen_leads_by_1_ms_after_the_latency() {
    let mut bench = bench(Options { latency: Latency::fixed(700 * US), ..Options::default() });
    let sent = bench.send(&READ_ANGLE);
    bench.run_for(SECOND);
    let burst = &bench.bursts[0];
    assert!(burst.drive_at.abs_diff(sent + 700 * US) <= 2 * US);
    assert_eq!((burst.start_at - burst.drive_at, burst.baud), (MS, 9_600));
    assert!(bench.node.deaf_while_sending());
}

#[test]
fn a_command_during_the_answer_is_not_heard() {
    let mut bench = bench(Options::default());
    bench.send(&READ_ANGLE);
    bench.run_for(5 * MS + 200 * US);
    assert_eq!(bench.bursts.len(), 1, "TXEN is on");
    bench.send(&READ_ANGLE);
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 1);
    assert_eq!(angle(&mut bench), 0);
}

#[test]
fn jitter_repeats_with_the_seed() {
    let run = |seed| {
        let options = Options { latency: Latency::between(MS, 9 * MS), seed, ..Options::default() };
        let mut bench = bench(options);
        (0..50)
            .map(|_| {
                let sent = bench.send(&READ_ANGLE);
                bench.run_for(50 * MS);
                let wait = bench.bursts.last().unwrap().drive_at - sent;
                assert!((MS..=9 * MS + 2 * US).contains(&(wait + US)));
                wait
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn a_new_angle_every_8_fifteenths_of_a_second() {
    // 36°/s is 6553.6 codes a second.
    let motion = Motion::Ramp { start: 0, rate: 36_000_000 };
    let mut bench = bench(Options { motion, phase: 100 * MS, ..Options::default() });
    let mut changes = Vec::new();
    let mut last = angle(&mut bench);
    while bench.now < 10 * SECOND {
        let now = angle(&mut bench);
        if now != last {
            let said = bench.node.said().last().unwrap();
            changes.push(said.sampled_at);
            assert_eq!(now, (said.sampled_at as f64 * 6553.6 / 1e9).round() as u16);
            assert!(said.at - said.sampled_at <= 534 * MS + 20 * MS);
            last = now;
        }
    }
    let expected: Vec<u64> = (0..changes.len() as u64).map(|k| 100 * MS + k * 8 * SECOND / 15).collect();
    assert_eq!(changes, expected);
    assert_eq!(changes.len(), 19);
}

#[test]
fn said_is_the_code_in_microdegrees() {
    let mut bench = bench(Options { motion: Motion::Constant(123_456_789), ..Options::default() });
    let code = angle(&mut bench);
    let told = bench.node.said().last().unwrap().microdegrees;
    assert!((told as f64 - f64::from(code) * 360e6 / 65536.0).abs() <= 0.5);
    assert!((told - 123_456_789).abs() <= 2_747);
}

#[test]
fn invalid_pairs_are_skipped_until_a_valid_one_begins() {
    let mut bench = bench(Options::default());
    // Read RAM with length 2; a lone byte; then the real command.
    for stray in ["02 34", "05 38 FF", "03 03 03", "01 3F", "00 00 00"] {
        bench.send(&hex(stray));
        assert_eq!(angle(&mut bench), 0, "after {stray}");
    }
}

#[test]
fn a_valid_pair_in_stray_characters_is_waited_out() {
    let mut bench = bench(Options::default());
    // Write RAM of 200 bytes: a valid pair that swallows what follows for 400 ms after it began.
    bench.send(&hex("C8 36"));
    let began = bench.now;
    assert_eq!(bench.ask_within(&READ_ANGLE, 10 * MS), None);
    bench.run_until(began + 399 * MS - 2 * 10 * bit(9_600));
    bench.send(&[0x03]);
    bench.run_for(2 * MS);
    assert_eq!(bench.ask_within(&READ_ANGLE[1..], 20 * MS), None, "its first byte was still swallowed");
    bench.run_for(400 * MS);
    assert_eq!(angle(&mut bench), 0);
}

#[test]
fn a_command_of_more_than_400_ms_is_given_up() {
    let mut bench = bench(Options::default());
    let characters = 4 * 10 * bit(9_600);
    bench.send_with_gap(&READ_ANGLE, (400 * MS - characters) / 4 + US);
    bench.run_for(SECOND);
    assert!(bench.bursts.is_empty());
    bench.send_with_gap(&READ_ANGLE, (400 * MS - characters) / 4 - US);
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 1);
}

#[test]
fn a_framing_error_discards_the_message() {
    let mut bench = bench(Options::default());
    bench.send(&hex("C8 36"));
    let at = bench.now + 9 * bit(9_600);
    bench.hear(Heard { at, byte: 0, framing_error: true });
    bench.run_until(at + bit(9_600));
    assert_eq!(angle(&mut bench), 0);
}

#[test]
fn answers_of_other_modules() {
    // Angle 5606H of module 5: "58 56" could begin a Write RAM command of 88 bytes.
    let answer = summed(4, &[0x55, 0x58, 0x56, 0x06]);
    let mut followed = bench(Options::default());
    followed.send(&answer);
    assert_eq!(angle(&mut followed), 0);

    let mut scanned = bench(Options { others_answers: OthersAnswers::Scanned, ..Options::default() });
    scanned.send(&answer);
    assert_eq!(scanned.ask_within(&READ_ANGLE, 50 * MS), None);
    scanned.run_for(400 * MS);
    assert_eq!(angle(&mut scanned), 0);
}

#[test]
fn a_module_without_power_is_silent() {
    let mut bench = bench(Options::default());
    bench.send(&READ_ANGLE);
    bench.node.power_off(bench.now);
    assert_eq!(bench.node.next_event(), None);
    assert_eq!(bench.ask_within(&READ_ANGLE, SECOND), None);
    bench.node.power_on(bench.now);
    bench.run_for(SECOND);
    assert_eq!(angle(&mut bench), 0);
}

#[test]
fn noise_never_costs_more_than_400_ms() {
    let mut random = oorandom::Rand64::new(7);
    for others_answers in [OthersAnswers::Followed, OthersAnswers::Scanned] {
        let mut bench = bench(Options { others_answers, ..Options::default() });
        // Noise may reset the null position or write the EEPROM; the question here is only whether it
        // answers.
        for _ in 0..300 {
            let noise: Vec<u8> = (0..random.rand_range(1..40)).map(|_| random.rand_u64() as u8).collect();
            bench.send(&noise);
            bench.run_for(2 * SECOND);
            assert!(bench.ask_within(&read_angle(0), SECOND).is_some(), "after {noise:02X?}");
        }
    }
}

#[test]
fn every_kind_of_answer_is_followed() {
    for answer in [
        "01 51 51",
        "01 53 53",
        "04 55 58 36 06 E9",
        "03 57 20 36 AD",
        "04 59 48 00 36 D7",
        "03 5B 48 02 A5",
        "01 5D 5D",
        "01 FF FF",
        "01 FD FD",
        "02 F1 34 25",
    ] {
        let mut bench = bench(Options::default());
        bench.send(&hex(answer));
        assert_eq!(angle(&mut bench), 0, "after {answer}");
    }
}

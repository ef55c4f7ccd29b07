//! Rules of "T7 Communication User Guide" 1.7 beyond its examples: status codes, framing, time, memory.

mod common;

use clino_sim::latency::Latency;
use clino_sim::node::Heard;
use clino_sim::t7::{BadOption, Identity, Model, Options, OutputRange, StoredSettings, T7, TwinsAnswers};
use common::t7::{bench, make, settings, status};
use common::{MS, SECOND, US, bit, hex};

#[test]
fn wrong_checksum_is_status_4_and_changes_nothing() {
    let commands = [
        "05 07 84 02 00 00 29 04 42",
        "05 07 86 02 00 00 75 30 C6",
        "05 04 89 02 01 6A",
        "05 04 8B 01 F4 76",
        "05 03 8D 01 69",
        "05 03 8F 04 64",
        "05 08 91 04 00 00 61 C9 01 34",
    ];
    let mut bench = bench();
    let before = bench.node.settings().clone();
    for command in commands {
        let answer = hex(&bench.ask(command));
        assert_eq!((answer[1], answer[3]), (3, 4), "{command}");
    }
    assert_eq!(*bench.node.settings(), before);
}

#[test]
fn other_statuses() {
    let mut bench = bench();
    let before = bench.node.settings().clone();
    for (command, expected) in [
        // Axis 3; axes that a single-axis device has not; angles outside the range; no such values.
        ("05 07 84 03 00 00 00 00", 3),
        ("05 07 86 00 00 00 00 00", 3),
        ("05 07 84 02 00 02 BF 20", 3),
        ("05 07 86 02 FF FD 40 DF", 3),
        ("05 04 89 02 02", 3),
        ("05 04 8B 00 01", 3),
        ("05 04 8B 13 89", 3),
        ("05 03 8D 02", 3),
        ("05 03 8F 05", 3),
        ("05 04 8D 01 00", 3),
        ("05 08 91 04 00 00 61 C9 00", 9),
        ("05 08 91 04 00 00 61 C9 65", 9),
        ("05 08 91 04 00 00 61 C9 7F", 9),
    ] {
        assert_eq!(status(&mut bench, command), expected, "{command}");
    }
    assert_eq!(*bench.node.settings(), before);
    assert_eq!(bench.ask("05 01 90"), "05 03 90 01 67", "unknown command");
    assert_eq!(bench.ask("05 02 8C 00"), "05 03 8C 01 6B", "Get command with a parameter");
}

#[test]
fn limits_of_parameters_are_accepted() {
    let mut bench = bench();
    for command in [
        "05 04 8B 00 02",
        "05 04 8B 13 88",
        "05 07 86 02 FF FD 40 E0",
        "05 07 86 02 00 02 BF 1F",
        "05 03 8D 01",
        "05 07 86 02 00 05 7E 3F",
        "05 08 91 04 00 00 61 C9 64",
    ] {
        assert_eq!(status(&mut bench, command), 0, "{command}");
    }
    assert_eq!(bench.node.settings().address, 100);
}

#[test]
fn get_is_answered_in_2_ms_and_set_in_25_at_the_latest() {
    let mut bench = bench();
    let sent = bench.send(&hex("05 01 83"));
    bench.run_for(SECOND);
    let get = bench.bursts[0].clone();
    assert!(get.start_at.abs_diff(sent + 2 * MS) <= 10, "{} after {sent}", get.start_at);
    assert_eq!((get.start_at - get.drive_at, get.hold, get.baud), (US, 40 * US, 115_200));
    let sent = bench.send(&hex("05 04 89 02 01 6B"));
    bench.run_for(SECOND);
    assert!(bench.bursts[1].start_at <= sent + 25 * MS + 10);
}

#[test]
fn immediate_answer_does_not_drive_into_the_command() {
    let options = Options { get_latency: Latency::fixed(0), ..Options::default() };
    let mut bench = make(Model::T71, settings(), options);
    let sent = bench.send(&hex("05 01 83"));
    bench.run_for(MS);
    assert!(bench.bursts[0].drive_at + 10 >= sent);
}

#[test]
fn jitter_stays_in_its_range_and_repeats_with_the_seed() {
    let run = |seed| {
        let options = Options { get_latency: Latency::between(200 * US, 2 * MS), seed, ..Options::default() };
        let mut bench = make(Model::T71, settings(), options);
        (0..200)
            .map(|_| {
                let sent = bench.send(&hex("05 01 83"));
                bench.run_for(4 * MS);
                bench.bursts.last().unwrap().start_at - sent
            })
            .collect::<Vec<_>>()
    };
    let waits = run(1);
    assert!(waits.iter().all(|wait| (200 * US - 10..=2 * MS + 10).contains(wait)));
    assert!(waits.iter().min().unwrap() + MS < *waits.iter().max().unwrap());
    assert_eq!(waits, run(1));
    assert_ne!(waits, run(2));
}

#[test]
fn impossible_devices_are_refused() {
    let new = |settings, options| T7::new(Identity::default(), settings, options).err();
    let slow = Options { get_latency: Latency::between(0, 2 * MS + 1), ..Options::default() };
    assert_eq!(new(settings(), slow), Some(BadOption::Latency { longest: 2 * MS + 1, limit: 2 * MS }));
    let slow = Options { set_latency: Latency::fixed(26 * MS), ..Options::default() };
    assert_eq!(new(settings(), slow), Some(BadOption::Latency { longest: 26 * MS, limit: 25 * MS }));
    for address in [0, 101, 126, 128, 255] {
        let settings = StoredSettings { address, ..StoredSettings::default() };
        assert_eq!(new(settings, Options::default()), Some(BadOption::Address(address)));
    }
    let bad = StoredSettings { baud_index: 5, ..StoredSettings::default() };
    assert_eq!(new(bad, Options::default()), Some(BadOption::BaudIndex(5)));
    let bad = StoredSettings { damping_ms: 1, ..StoredSettings::default() };
    assert_eq!(new(bad, Options::default()), Some(BadOption::Damping(1)));
    assert_eq!(new(StoredSettings::default(), Options::default()), None);
}

#[test]
fn a_command_of_500_ms_is_discarded() {
    let mut bench = bench();
    let characters = 2 * 10 * bit(115_200);
    bench.send_with_gap(&hex("05 01 83"), (500 * MS - characters) / 2 + US);
    bench.run_for(SECOND);
    assert!(bench.bursts.is_empty());
    // What the discarded command left behind does not spoil the next one, a second later.
    assert_ne!(bench.ask("05 01 83"), "");
    bench.send_with_gap(&hex("05 01 83"), (500 * MS - characters) / 2 - US);
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 2);
}

#[test]
fn others_are_skipped_whole() {
    let mut bench = bench();
    // A command for address 6, its answer with our own command hidden in the angle, an unknown node,
    // length 0.
    bench.send(&hex("06 01 83"));
    bench.send(&hex("06 06 83 05 01 83 00 E8"));
    bench.send(&hex("C8 02 05 01"));
    bench.send(&hex("05 00"));
    assert_ne!(bench.ask("05 01 83"), "");
    assert_eq!(bench.bursts.len(), 1);
}

#[test]
fn a_false_length_puts_the_receiver_out_of_step_for_half_a_second() {
    let mut bench = bench();
    // Another node's answer with the printed length: six bytes stay over and begin with FC CC.
    bench.send(&hex("06 0A 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC CC"));
    assert_eq!(bench.ask_within(&hex("05 01 83"), 10 * MS), None);
    bench.run_for(500 * MS);
    assert_ne!(bench.ask("05 01 83"), "");
}

#[test]
fn a_framing_error_discards_the_frame() {
    let mut bench = bench();
    bench.send(&hex("06 FF 11"));
    let at = bench.now + 9 * bit(115_200);
    bench.hear(Heard { at, byte: 0, framing_error: true });
    bench.run_until(at + bit(115_200));
    assert_ne!(bench.ask("05 01 83"), "");
}

#[test]
fn half_a_message_before_its_own_answer_is_forgotten() {
    let mut bench = bench();
    bench.send(&hex("05 01 83"));
    bench.send(&hex("06 FF"));
    bench.run_for(4 * MS);
    assert_eq!(bench.bursts.len(), 1);
    assert!(bench.ask_within(&hex("05 01 83"), 4 * MS).is_some());
}

#[test]
fn a_command_heard_while_busy_is_dropped() {
    let mut bench = bench();
    bench.send(&hex("05 04 89 02 01 6B"));
    bench.send(&hex("05 01 83"));
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 1);
    assert_eq!(bench.bursts[0].bytes, hex("05 03 89 00 6F"));
}

#[test]
fn all_respond_address() {
    let mut bench = bench();
    assert_eq!(bench.ask("7E 01 83"), "05 06 83 00 00 00 00 72");
    for short in ["81", "82", "83", "88", "8A", "8C"] {
        assert!(bench.ask(&format!("7E 01 {short}")).starts_with("05 "), "{short}");
    }
    for long in ["80", "85", "87", "8E"] {
        assert_eq!(bench.ask(&format!("7E 01 {long}")), "", "{long}");
    }
    assert_eq!(status(&mut bench, "7E 04 89 02 01"), 0);
    assert_eq!(status(&mut bench, "7E 08 91 04 00 00 61 C9 09"), 0);
    assert_eq!(bench.ask("7E 01 8C"), "09 03 8C 00 68");
}

#[test]
fn noise_never_costs_more_than_half_a_second() {
    let mut random = oorandom::Rand64::new(7);
    let mut bench = bench();
    for _ in 0..300 {
        let noise: Vec<u8> = (0..random.rand_range(1..40)).map(|_| random.rand_u64() as u8).collect();
        bench.send(&noise);
        bench.run_for(500 * MS);
        let before = bench.bursts.len();
        let address = bench.node.settings().address;
        bench.send(&[address, 1, 0x8C]);
        bench.run_for(3 * MS);
        assert_eq!(bench.bursts.len(), before + 1, "after {noise:02X?}");
    }
}

#[test]
fn answers_of_a_device_with_the_same_address() {
    for (twins_answers, angle, status) in [
        (TwinsAnswers::Dropped, "", ""),
        (TwinsAnswers::TakenForCommands, "05 03 83 01 74", "05 03 84 03 71"),
    ] {
        let mut bench = make(Model::T71, settings(), Options { twins_answers, ..Options::default() });
        assert_eq!(bench.ask("05 06 83 FF FF 4E FF 27"), angle);
        assert_eq!(bench.ask("05 03 84 00 74"), status);
        // This one is a command as well.
        assert_eq!(bench.ask("05 03 8D 01 6A"), "05 03 8D 00 6B");
        assert_eq!(bench.ask("05 03 8D 00 6B"), "05 03 8D 00 6B");
        assert_eq!(bench.node.settings().range, OutputRange::Bidirectional);
    }
}

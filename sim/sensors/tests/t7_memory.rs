//! A T7's non-volatile settings, address, bit rate and power cuts ("T7 Communication User Guide" 1.7,
//! sections 1.3, 2.7.2, 2.8).

mod common;

use clino_sim::node::{Heard, Node};
use clino_sim::t7::{Flash, Model};
use common::t7::{bench, status, summed, turned};
use common::{MS, SECOND, US, bit, end, hex};

#[test]
fn set_address_names_its_device() {
    for command in ["05 08 91 01 00 00 61 C9 01", "05 08 91 04 00 00 61 C8 01", "05 08 91 04 01 00 61 C9 01"]
    {
        let mut bench = bench();
        assert_eq!(bench.ask(&summed(command)), "", "{command}");
        assert_eq!(bench.node.settings().address, 5);
    }
    let mut bench = turned(Model::T73, [0; 3]);
    assert_eq!(status(&mut bench, "05 08 91 01 00 00 61 C9 01"), 0);
}

#[test]
fn bit_rate_changes_10_ms_after_the_answer() {
    for (index, baud) in [115_200, 57_600, 38_400, 19_200, 9_600].into_iter().enumerate().skip(1) {
        let mut bench = bench();
        bench.send(&hex(&summed(&format!("05 03 8F 0{index}"))));
        bench.run_for(27 * MS);
        let answer = bench.bursts[0].clone();
        assert_eq!(answer.baud, 115_200);
        bench.run_until(end(&answer) + 10 * MS - US);
        assert_eq!(bench.node.baud(), 115_200);
        bench.run_until(end(&answer) + 10 * MS + US);
        assert_eq!(bench.node.baud(), baud);
        assert_ne!(bench.ask("05 01 83"), "");
        assert_eq!(bench.bursts[1].baud, baud);
    }
}

#[test]
fn settings_survive_a_power_cut_and_nothing_else_does() {
    let mut bench = bench();
    assert_eq!(status(&mut bench, "05 07 86 02 00 00 75 30"), 0);
    bench.send(&hex("05 01"));
    bench.power_cycle(SECOND, 100 * MS);
    bench.send(&hex("83"));
    bench.run_for(SECOND);
    assert_eq!(bench.bursts.len(), 1, "half a command is forgotten");
    assert!(bench.ask("05 01 85").contains("00 00 75 30"));
}

#[test]
fn a_device_without_power_is_silent() {
    let mut bench = bench();
    bench.send(&hex("05 01 83"));
    bench.node.power_off(bench.now);
    assert_eq!(bench.node.next_event(), None);
    assert_eq!(bench.ask("05 01 83"), "");
    bench.node.power_on(bench.now);
    assert_eq!(bench.ask_within(&hex("05 01 83"), 10 * MS), None, "still starting");
    bench.run_for(SECOND);
    assert_ne!(bench.ask("05 01 83"), "");
}

#[test]
fn power_cut_at_any_time_leaves_the_old_setting_or_the_new_one() {
    let command = hex("05 08 91 04 00 00 61 C9 01 33");
    let mut seen = Vec::new();
    for cut in (0..40 * MS).step_by(43_000) {
        let mut bench = bench();
        let sent_by = command.len() as u64 * 10 * bit(115_200);
        for (i, &byte) in command.iter().enumerate() {
            let at = (i as u64 * 10 + 9) * bit(115_200);
            if at <= cut {
                bench.run_until(at);
                bench.hear(Heard { at, byte, framing_error: false });
            }
        }
        bench.run_until(cut);
        bench.power_cycle(MS, 30 * MS);
        let written = bench.node.settings().address == 1;
        // The default write time is 20 ms.
        assert_eq!(written, cut >= sent_by + 20 * MS, "cut at {cut}");
        assert_eq!(bench.ask_within(&hex("01 01 8C"), 10 * MS).is_some(), written);
        assert_eq!(bench.ask_within(&hex("05 01 8C"), 10 * MS).is_some(), !written);
        seen.push((written, bench.bursts.len()));
    }
    assert!(seen.contains(&(true, 1)), "written, but the answer never came");
}

#[test]
fn power_cut_between_answer_and_rate_change_brings_the_new_rate() {
    let mut bench = bench();
    bench.send(&hex("05 03 8F 04 65"));
    bench.run_for(26 * MS);
    assert_eq!((bench.bursts.len(), bench.node.baud()), (1, 115_200));
    bench.power_cycle(MS, MS);
    assert_eq!(bench.node.baud(), 9_600);
}

#[test]
fn a_flash_that_fails_stores_nothing_and_says_so() {
    for (flash, expected) in [(Flash::Fails, 5), (Flash::EraseFails, 7), (Flash::ProgramFails, 8)] {
        let mut bench = bench();
        let before = bench.node.settings().clone();
        bench.node.flash = flash;
        for command in [
            "05 07 84 02 00 00 29 04",
            "05 07 86 02 00 00 75 30",
            "05 04 89 02 01",
            "05 04 8B 01 F4",
            "05 03 8D 01",
            "05 03 8F 04",
            "05 08 91 04 00 00 61 C9 01",
        ] {
            assert_eq!(status(&mut bench, command), expected, "{command}");
        }
        // What is wrong with the command itself is found before anything is written.
        assert_eq!(status(&mut bench, "05 04 8B 00 01"), 3);
        assert_eq!(bench.ask("05 04 8B 01 F4 78"), "05 03 8B 04 69");
        bench.run_for(SECOND);
        assert_eq!(*bench.node.settings(), before);
        assert_eq!((bench.node.baud(), bench.node.writes()), (115_200, 0));
        bench.node.flash = Flash::Sound;
        assert_eq!(status(&mut bench, "05 04 8B 01 F4"), 0);
        assert_eq!((bench.node.settings().damping_ms, bench.node.writes()), (500, 1));
    }
}

#[test]
fn every_set_is_a_write_the_same_value_included() {
    let mut bench = bench();
    for _ in 0..3 {
        assert_eq!(status(&mut bench, "05 04 8B 01 F4"), 0);
    }
    bench.ask("05 01 8A");
    assert_eq!(bench.node.writes(), 3);
}

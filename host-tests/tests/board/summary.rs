//! What the image says of itself as a whole while something is wrong: status word, bitmaps, `list`, the stream. That no
//! declared fault anywhere leaves it clean is in `crates/gateway/src/summary/tests.rs`.

use clino_host_tests::{Ran, modbus, run};

/// Bits of *gateway status* (`docs/modbus.md`).
const ISU_BUS_DEAD: u16 = 1 << 1;
const ISU_BUS_FAULT: u16 = 1 << 9;
const SLOT_FAULT: u16 = 1 << 10;
/// The slot is *noisy* because this many of its requests failed, until 200 more have succeeded, in 53 s.
const HEALTH: u16 = 1 << 11;

/// Status word and the bits of the slots that are online and valid.
fn words(exchange: &modbus::Exchange) -> (u16, u32, u32) {
    let registers = exchange.registers().expect("an answer");
    let wide = |at: usize| u32::from(registers[at]) << 16 | u32::from(registers[at + 1]);
    (registers[10], wide(16), wide(18))
}

fn summaries(ran: &Ran) -> Vec<(u64, &str)> {
    let lines = ran.lines.iter().map(|line| (line.began / 1_000_000, line.text.as_str()));
    lines.filter(|(_, text)| text.starts_with(r#"{"summary":"#)).collect()
}

/// The issue's example: *break* was told in the bus's own registers, the status word was 0, and the slot online.
#[test]
fn a_pair_stuck_low_is_in_every_summary() {
    let mut scenario = String::from(
        r#"
        seed = 1
        duration = "7s"
        t7 = [
            { address = 1, motion.constant = 12.5 },
            { address = 2, motion.constant = -12.5 },
            { address = 3, motion.constant = 0.5 },
        ]
        isu = [{ address = 1, motion.constant = 90.0 }]
        pwm = [{ channel = 1, motion.constant = 90.0 }, { channel = 2, motion.constant = 90.0 }]
        segments.isu.stuck = [{ from = "2s", until = "5s", level = "low" }]
        typed = [{ at = "4500ms", line = "list" }]
        [modbus]
        "#,
    );
    for at in [1_800, 4_000, 6_800] {
        scenario += &modbus::request(&[4, 0, 0, 0, 27], at);
    }
    let ran = run(&scenario);
    let exchanges = modbus::exchanges(&ran.bus_log);
    let [before, during, after] = &exchanges[..] else { panic!("three answers") };
    assert_eq!(words(before), (0, 0b111111, 0b111111));
    assert_eq!(words(during), (ISU_BUS_DEAD | ISU_BUS_FAULT | SLOT_FAULT | HEALTH, 0b110111, 0b110111));
    assert_eq!(words(after), (HEALTH, 0b111111, 0b111111));
    let summaries = summaries(&ran);
    let (first, text) = summaries[0];
    assert!(first < 50 && text.contains("slot_fault"), "nothing is read yet: {text}");
    let clean = r#"{"summary":[],"enabled":6,"online":6,"ok":6}"#;
    let broken =
        r#"{"summary":["isu_bus_dead","isu_bus_fault","slot_fault","health"],"enabled":6,"online":5,"ok":5}"#;
    let noisy = r#"{"summary":["health"],"enabled":6,"online":6,"ok":6}"#;
    for (at, text) in &summaries {
        match at {
            1_000..2_000 => assert_eq!(*text, clean, "at {at} ms"),
            6_500.. => assert_eq!(*text, noisy, "at {at} ms"),
            3_500..5_000 => assert_eq!(*text, broken, "at {at} ms"),
            _ => {}
        }
    }
    // Typed at 4.5 s, and out when the lines before it are.
    assert!(summaries.iter().any(|(at, _)| (4_500..4_700).contains(at)), "`list` has it, too: {summaries:?}");
}

//! What an image does whose only door is the Modbus port, with a console or without: the angles are there, and the command
//! *save* only if the image can store (`CLINO_FUNCTIONS`, which `cargo xtask test` sets).

use std::path::Path;

use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::{image, modbus};

/// Millidegrees of slots 0 to 5 (address 0x0020): three T7s, an ISU, two PWM inputs.
const ANGLES: [i32; 4] = [12_500, -12_500, 500, 90_000];

#[test]
fn the_angles_are_at_the_modbus_port() {
    let mut text = String::from(
        r#"
        duration = "3s"
        t7 = [
            { address = 1, motion.constant = 12.5 },
            { address = 2, motion.constant = -12.5 },
            { address = 3, motion.constant = 0.5 },
        ]
        isu = [{ address = 1, motion.constant = 90.0 }]
        [modbus]
        "#,
    );
    text += &modbus::request(&[4, 0, 0x20, 0, 8], 1_900);
    // The command *save*.
    text += &modbus::request(&[6, 0x1F, 0x00, 0, 1], 2_000);
    let scenario =
        Scenario::parse(Path::new("modbus alone"), &text).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"));
    run.finish(|_| {});
    let mut bus_log = Vec::new();
    run.write_bus_log(&mut bus_log).expect("memory does not fail");
    let exchanges = modbus::exchanges(&bus_log);
    let registers = exchanges[0].registers().expect("an answer");
    let angles: Vec<i32> =
        registers.chunks(2).map(|word| (u32::from(word[0]) << 16 | u32::from(word[1])) as i32).collect();
    assert!(angles.iter().zip(ANGLES).all(|(angle, truth)| (angle - truth).abs() <= 3), "{angles:?}");
    let saved = exchanges[1].answer.as_ref().expect("an answer").bytes[1];
    let cannot_store = std::env::var("CLINO_FUNCTIONS").is_ok_and(|functions| functions.is_empty());
    // 0x86 is an exception to function 6.
    assert_eq!(saved, if cannot_store { 0x86 } else { 0x06 });
    assert_eq!(run.board().stats().resets, 0);
}

//! What an image does that leaves parts out (`CLINO_FUNCTIONS`, which `cargo xtask test` sets): what is there works, what is not
//! is in no list and has no registers.

use std::path::Path;

use clino_board::elf::Image;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::modbus::{self, Exchange};
use clino_host_tests::{elf, image, model};

/// Three T7s and an ISU.
const SENSORS: &str = r#"
    duration = "3s"
    t7 = [
        { address = 1, motion.constant = 12.5 },
        { address = 2, motion.constant = -12.5 },
        { address = 3, motion.constant = 0.5 },
    ]
    isu = [{ address = 1, motion.constant = 90.0 }]
"#;

/// Millidegrees of slots 0 to 2; and of slot 3, where an image with ISUs reads one.
const T7_ANGLES: [i32; 3] = [12_500, -12_500, 500];
const ISU_ANGLE: i32 = 90_000;

/// The image's parts.
fn parts() -> String {
    std::env::var("CLINO_FUNCTIONS").unwrap_or_else(|_| String::from("full"))
}

/// Whether the image has a part.
fn has(part: &str) -> bool {
    let parts = parts();
    parts == "full" || parts.split(',').any(|name| name == part)
}

/// The image that has all parts: this one, or the shipped one, which is built beside the small ones.
fn whole() -> Image {
    if parts() == "full" {
        return image().clone();
    }
    let file = elf().with_file_name("clino-firmware");
    Image::read(&file, model()).unwrap_or_else(|error| panic!("{error}"))
}

/// The millidegrees of two registers, the upper one first.
fn angle(registers: &[u16]) -> i32 {
    (u32::from(registers[0]) << 16 | u32::from(registers[1])) as i32
}

/// Whether the answer is one, and no exception; `None` without one.
fn is_done(exchange: &Exchange) -> Option<bool> {
    exchange.answer.as_ref().map(|answer| answer.bytes[1] & 0x80 == 0)
}

/// The run of a scenario, and what the console printed. An image without its log has none to be decoded.
fn ran(text: &str) -> (Run, Vec<String>) {
    let scenario = Scenario::parse(Path::new("parts"), text).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"));
    let mut lines = Vec::new();
    run.finish(|line| lines.push(line.text.clone()));
    assert_eq!(run.board().stats().resets, 0);
    (run, lines)
}

#[test]
fn the_modbus_port_has_what_is_there_and_nothing_else() {
    let requests: [(&[u8], bool); 8] = [
        // Angles of slots 0 to 3.
        (&[4, 0, 0x20, 0, 8], true),
        // The counters of bus 1, and its bit rate.
        (&[4, 0x09, 0x40, 0, 2], has("isu")),
        (&[4, 0x18, 0x10, 0, 2], has("isu")),
        // Slot 10 reads an ISU; a PWM input.
        (&[6, 0x11, 0x41, 0, 2], has("isu")),
        (&[6, 0x11, 0x41, 0, 3], has("pwm")),
        // Results of a command, findings of a scan.
        (&[4, 0x09, 0xC0, 0, 1], has("commissioning")),
        // The command *scan*, at the bus's bit rate.
        (&[16, 0x1F, 0x00, 0, 4, 8, 0, 7, 0, 0, 0, 0, 0, 0], has("commissioning")),
        // The command *save*.
        (&[6, 0x1F, 0x00, 0, 1], has("storage") && !has("commissioning")),
    ];
    let mut text = format!("{SENSORS}[modbus]\n");
    for (place, (request, _)) in requests.iter().enumerate() {
        // A scan takes longer than the scenario: with one, *save* is refused as busy.
        text += &modbus::request(request, 1_900 + 50 * place as u64);
    }
    let (run, _) = ran(&text);
    let mut bus_log = Vec::new();
    run.write_bus_log(&mut bus_log).expect("memory does not fail");
    let exchanges = modbus::exchanges(&bus_log);
    assert_eq!(exchanges.len(), requests.len());
    for (exchange, (request, is_there)) in exchanges.iter().zip(requests) {
        let expected = has("modbus").then_some(is_there);
        assert_eq!(is_done(exchange), expected, "{request:02x?}: {:02x?}", exchange.answer);
    }
    if !has("modbus") {
        return;
    }
    let registers = exchanges[0].registers().expect("an answer");
    let angles: Vec<i32> = registers.chunks(2).map(angle).collect();
    let truths = T7_ANGLES.into_iter().chain(has("isu").then_some(ISU_ANGLE));
    assert!(angles.iter().zip(truths).all(|(angle, truth)| (angle - truth).abs() <= 3), "{angles:?}");
}

#[test]
fn the_console_has_what_is_there_and_nothing_else() {
    let mut text = String::from(SENSORS);
    for (place, line) in ["help", "help set", "slot 9 isu 1", "slot 9 pwm 1", "zero 0"].iter().enumerate() {
        text += &format!("[[typed]]\nat = \"{}ms\"\nline = {line:?}\n", 1_000 + 300 * place);
    }
    let (_, lines) = ran(&text);
    if !has("console") {
        assert!(lines.is_empty(), "{lines:?}");
        return;
    }
    let is_there = |begin: &str| lines.iter().any(|line| line.starts_with(begin));
    for (begin, expected) in [
        (r#"{"command":"list","#, true),
        (r#"{"command":"modbus","#, has("modbus")),
        (r#"{"command":"t7","#, has("commissioning")),
        (r#"{"command":"cancel","#, has("commissioning")),
        (r#"{"command":"isu","#, has("commissioning") && has("isu")),
        (r#"{"setting":"baud","of":"t7","#, true),
        (r#"{"setting":"baud","of":"isu","#, has("isu")),
        (r#"{"setting":"parity","of":"modbus","#, has("modbus")),
    ] {
        assert_eq!(is_there(begin), expected, "{begin}: {lines:#?}");
    }
    let done = lines.iter().filter(|line| *line == r#"{"done":true}"#).count();
    assert_eq!(done, 1 + usize::from(has("isu")) + usize::from(has("pwm")), "{lines:#?}");
    for (slot, truth) in [(0, "12.500"), (1, "-12.500"), (2, "0.500")] {
        let is_told = |line: &String| {
            line.starts_with(&format!("{{\"slot\":{slot},"))
                && line.contains(&format!("\"angle_deg\":{truth},"))
        };
        assert!(lines.iter().any(is_told), "slot {slot}");
    }
}

/// Millidegrees of slot 0 at the end of a run.
fn slot_0(run: &Run, lines: &[String]) -> i32 {
    if has("console") {
        let told = lines.iter().rev().find(|line| line.starts_with(r#"{"slot":0,"#)).expect("slot 0");
        let angle = told.split(r#""angle_deg":"#).nth(1).and_then(|rest| rest.split(',').next());
        return angle.expect("an angle").replace('.', "").parse().expect("a number");
    }
    let mut bus_log = Vec::new();
    run.write_bus_log(&mut bus_log).expect("memory does not fail");
    let registers = modbus::exchanges(&bus_log).last().and_then(Exchange::registers).expect("an answer");
    angle(&registers)
}

/// The whole image stores settings: slot 0 reads another T7, and there are slots of every kind. An image without one of these kinds
/// does not read them and runs as delivered, it does not write, and the whole image finds them again.
#[test]
fn settings_of_a_part_that_is_absent_are_left_for_the_image_that_has_it() {
    let whole = whole();
    let typed = |at: u64, line: &str| format!("[[typed]]\nat = \"{at}ms\"\nline = {line:?}\n");
    let set = [SENSORS, &typed(300, "slot 0 t7 2"), &typed(600, "save")].concat();
    let read = format!("{SENSORS}[modbus]\n{}", modbus::request(&[4, 0, 0x20, 0, 2], 2_900));
    let scenario = |text: &str| Scenario::parse(Path::new("parts"), text).expect("a scenario");
    let stored_by = |image: &Image, text: &str| {
        let mut run = Run::new(image, &scenario(text)).expect("it runs");
        let mut lines = Vec::new();
        run.finish(|line| lines.push(line.text.clone()));
        (run.board().stored(), run, lines)
    };
    let (stored, _, lines) = stored_by(&whole, &set);
    assert!(lines.iter().any(|line| line == r#"{"what":"saved","stored":"written"}"#), "{lines:#?}");

    let small = image().clone().with_stored(&stored).expect("it fits");
    let (kept, run, lines) = stored_by(&small, &read);
    let reads_them = has("storage") && has("isu") && has("pwm");
    let [delivered, set, _] = T7_ANGLES;
    assert_eq!(slot_0(&run, &lines), if reads_them { set } else { delivered });
    assert_eq!(kept, stored);

    if has("console") && !reads_them {
        // Nor is it written over without a word.
        let (kept, _, lines) = stored_by(&small, &(read.clone() + &typed(1_000, "save")));
        assert!(lines.iter().any(|line| line.contains(r#""error":"#)), "{lines:#?}");
        assert_eq!(kept, stored);
    }
    let (kept_again, _, lines) = stored_by(&whole.with_stored(&kept).expect("it fits"), &read);
    let told = lines.iter().rev().find(|line| line.starts_with(r#"{"slot":0,"#)).expect("slot 0");
    assert!(told.contains(r#""angle_deg":-12.500,"#), "{told}");
    assert_eq!(kept_again, stored);
}

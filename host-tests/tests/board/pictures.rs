//! The pictures of `docs/bring-up.md`: drawn from captures of the virtual board with the shipped image, and within the limits
//! that the page states.
//!
//! `cargo xtask pictures` writes them anew.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use clino_board::BoardModel;
use clino_board::run::{Extras, Run};
use clino_board::scenario::Scenario;
use clino_hil::capture::{self, Line};
use clino_hil::picture::Picture;
use clino_host_tests::{image, model};

type Lines = HashMap<String, Line>;

const US: u64 = 1_000;
const MS: u64 = 1_000_000;

const SENSORS: &str = r#"
duration = "500ms"
t7 = [
    { address = 1, motion.constant = 12.345 },
    { address = 2, motion.constant = -170.5 },
    { address = 3, motion.constant = 0.001 },
]
isu = [{ address = 1, motion.constant = 271.25 }]
pwm = [{ channel = 1, motion.constant = 89.56 }, { channel = 2, motion.constant = 333.3 }]
"#;

const T7: &[(&str, Option<u64>)] = &[("t7_pair", Some(115_200)), ("t7_de", None)];

/// Bits of a request for the angle of a T7: three characters.
const REQUEST_BITS: u64 = 30;

fn lines(scenario: &str) -> Lines {
    let scenario = Scenario::parse(Path::new("test"), scenario).unwrap_or_else(|why| panic!("{why}"));
    let extras = Extras { levels: true, ..Extras::default() };
    let mut run = Run::with(image(), &scenario, extras).unwrap_or_else(|why| panic!("{why}"));
    run.finish(|_| ());
    let mut dump = Vec::new();
    run.write_vcd(&mut dump).expect("memory does not fail");
    capture::parse(dump.as_slice()).unwrap_or_else(|why| panic!("{why}"))
}

/// Compares the picture with the one in the documents, or writes it. They are drawn on the default board; on another one only
/// the limits count.
fn settle(name: &str, picture: &Picture<'_>, lines: &Lines) {
    if model() != BoardModel::default() {
        return;
    }
    let fresh = picture.svg(lines).unwrap_or_else(|why| panic!("{why}"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pictures").join(format!("{name}.svg"));
    if fs::read_to_string(&path).is_ok_and(|shown| shown == fresh) {
        return;
    }
    assert!(
        std::env::var_os("UPDATE").is_some(),
        "docs/pictures/{name}.svg is not what the image does now; `cargo xtask pictures` writes it anew"
    );
    fs::write(&path, fresh).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
}

/// First rise and fall of a driver enable after this time.
fn frame(lines: &Lines, de: &str, after: u64) -> (u64, u64) {
    let frames = lines[de].highs();
    *frames.iter().find(|(rise, _)| *rise > after).unwrap_or_else(|| panic!("no {de} after {after}"))
}

fn us(from: u64, until: u64) -> String {
    format!("{:.2} us", (until - from) as f64 / US as f64)
}

fn ms(from: u64, until: u64) -> String {
    format!("{:.1} ms", (until - from) as f64 / MS as f64)
}

/// The first bit of a T7 request: the start bit of 01, between two edges. Its length in ns.
fn bit(lines: &Lines, name: &'static str, title: &'static str) -> u64 {
    let (rise, fall) = frame(lines, "t7_de", 200 * MS);
    let pair = &lines["t7_pair"];
    let start = pair.falling(rise).expect("a start bit");
    let rising = pair.changes.iter().find(|(at, high)| *at > start && *high).expect("an edge").0;
    let end = start + REQUEST_BITS * (rising - start);
    let spans = vec![
        (format!("one bit, {}", us(start, rising)), start, rising),
        (format!("three characters, {}", us(start, end)), start, end),
    ];
    let picture =
        Picture { title, lines: T7, from: rise - 40 * US, zero: start, until: fall + 40 * US, spans };
    settle(name, &picture, lines);
    rising - start
}

#[test]
fn bit_times() {
    let bit = bit(&lines(SENSORS), "bit-times", "A T7 request: bit times");
    // 1/115200 s is 8681 ns; the divider of 84 MHz is 0.02 % off.
    assert!((8_670..=8_690).contains(&bit), "{bit} ns");
}

#[test]
fn crystal_lifted() {
    let scenario = format!("{SENSORS}crystal = {{ dead = true, internal_error = 0.02 }}\n");
    let bit = bit(&lines(&scenario), "crystal-lifted", "The same on an internal oscillator that is 2 % fast");
    assert!((8_490..=8_530).contains(&bit), "{bit} ns");
}

#[test]
fn de_against_the_stop_bit() {
    let lines = lines(SENSORS);
    let (rise, fall) = frame(&lines, "t7_de", 200 * MS);
    let start = lines["t7_pair"].falling(rise).expect("a start bit");
    let stop = start + REQUEST_BITS * 1_000_000_000 / 115_200;
    let stop_bit = stop - 1_000_000_000 / 115_200;
    assert!(stop < fall && fall - stop <= 10 * US, "{stop} {fall}");
    assert!(start - rise < stop - stop_bit, "{rise} {start}");
    let spans = vec![
        (format!("DE high to the start bit, {}", us(rise, start)), rise, start),
        (format!("stop bit to DE low, {}", us(stop, fall)), stop, fall),
    ];
    let title = "DE around a T7 request";
    let picture =
        Picture { title, lines: T7, from: rise - 10 * US, zero: rise, until: fall + 10 * US, spans };
    settle("de", &picture, &lines);
}

#[test]
fn exchanges() {
    let lines = lines(SENSORS);
    let (rise, fall) = frame(&lines, "t7_de", 200 * MS);
    let answer = lines["t7_pair"].falling(fall).expect("an answer");
    // A T7 answers within 2 ms; the simulated one takes just that.
    assert!((1_900 * US..=2_100 * US).contains(&(answer - fall)), "{}", answer - fall);
    let spans = vec![(format!("to the answer, {}", ms(fall, answer)), fall, answer)];
    let from = rise - 200 * US;
    let picture = Picture {
        title: "An exchange with a T7",
        lines: T7,
        from,
        zero: rise,
        until: rise + 3_400 * US,
        spans,
    };
    settle("t7-exchange", &picture, &lines);

    let (rise, fall) = frame(&lines, "isu_de", 200 * MS);
    let answer = lines["isu_pair"].falling(fall).expect("an answer");
    assert!((5 * MS..=7 * MS).contains(&(answer - fall)), "{}", answer - fall);
    let isu = &[("isu_pair", Some(9_600)), ("isu_de", None)];
    let spans = vec![(format!("to the answer, {}", ms(fall, answer)), fall, answer)];
    let from = rise - MS;
    let picture = Picture {
        title: "An exchange with an ISU",
        lines: isu,
        from,
        zero: rise,
        until: rise + 20 * MS,
        spans,
    };
    settle("isu-exchange", &picture, &lines);
}

#[test]
fn the_start() {
    let lines = lines(SENSORS);
    let console = lines["console_tx"].falling(0).expect("a line");
    let (de, _) = frame(&lines, "t7_de", 0);
    assert!(console < 20 * MS && de < 30 * MS, "{console} {de}");
    let shown =
        &[("console_tx", Some(115_200)), ("t7_pair", Some(115_200)), ("t7_de", None), ("isu_de", None)];
    let spans = vec![
        (format!("first line of the console, {}", ms(0, console)), 0, console),
        (format!("first request, {}", ms(0, de)), 0, de),
    ];
    let title = "Power-up: console and first requests";
    settle("start", &Picture { title, lines: shown, from: 0, zero: 0, until: 40 * MS, spans }, &lines);
}

#[test]
fn pwm() {
    let lines = lines(SENSORS);
    let (rise, fall) = frame(&lines, "pwm1", 100 * MS);
    let (next, _) = frame(&lines, "pwm1", rise);
    let spans = vec![
        (format!("high, {}", ms(rise, fall)), rise, fall),
        (format!("period, {}: 89.56 deg", ms(rise, next)), rise, next),
    ];
    // Angle = 6.749 · duty − 157.45, the duty in per cent; a step is 1/7680 of a period.
    let duty = (fall - rise) as f64 * 100.0 / (next - rise) as f64;
    assert!((6.749 * duty - 157.45 - 89.56).abs() < 0.05, "{duty}");
    let shown = &[("pwm1", None), ("pwm2", None)];
    let picture = Picture {
        title: "The PWM inputs",
        lines: shown,
        from: rise - 5 * MS,
        zero: rise,
        until: rise + 95 * MS,
        spans,
    };
    settle("pwm", &picture, &lines);
}

#[test]
fn save() {
    let typed = "duration = \"2500ms\"\ntyped = [{ at = \"1s\", line = \"\" }, { at = \"1200ms\", line = \"save\" }]\n";
    let lines = lines(&SENSORS.replace("duration = \"500ms\"\n", typed));
    let frames = lines["t7_de"].highs();
    let longest = frames.windows(2).max_by_key(|two| two[1].0 - two[0].1).expect("frames");
    let (from, until) = (longest[0].1, longest[1].0);
    // A sector takes 250 to 500 ms to be erased (DS8626 table 40), and the bus begins with a silence of its own.
    assert!((250 * MS..=600 * MS).contains(&(until - from)), "{from} {until}");
    let shown = &[("console_tx", None), ("t7_de", None), ("isu_de", None)];
    let spans = vec![(format!("a sector is erased, no request for {}", ms(from, until)), from, until)];
    let title = "save: the core stands still while flash is erased";
    settle(
        "save",
        &Picture { title, lines: shown, from: from - 200 * MS, zero: from, until: until + 200 * MS, spans },
        &lines,
    );
}

#[test]
fn planted_hang() {
    let plant = "duration = \"3s\"\nplant = [{ at = \"1s\", what = \"hang\", level = \"bus\" }]\n";
    let lines = lines(&SENSORS.replace("duration = \"500ms\"\n", plant));
    let reset = lines["nrst"].falling(0).expect("a reset");
    let last = lines["t7_de"].highs().iter().rfind(|(_, fall)| *fall < reset).expect("a frame").1;
    let (again, _) = frame(&lines, "t7_de", reset);
    // `docs/recovery.md` promises the longest.
    assert!(reset - last < 2_000 * MS && again - reset < 100 * MS, "{last} {reset} {again}");
    let shown = &[("nrst", None), ("console_tx", None), ("t7_de", None), ("isu_de", None)];
    let spans = vec![
        (format!("the bus level hangs, {}", ms(last, reset)), last, reset),
        (format!("reset to the first request, {}", ms(reset, again)), reset, again),
    ];
    let title = "A hang of the bus level, and the reset that ends it";
    let (from, until) = (last - 150 * MS, again + 150 * MS);
    settle("hang", &Picture { title, lines: shown, from, zero: last, until, spans }, &lines);
}

/// Each picture is shown, and each that is shown is drawn here.
#[test]
fn the_page_shows_every_picture() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let page = fs::read_to_string(docs.join("bring-up.md")).expect("the page");
    let drawn = include_str!("pictures.rs");
    let mut count = 0;
    for entry in fs::read_dir(docs.join("pictures")).expect("a folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("text");
        let stem = name.strip_suffix(".svg").unwrap_or_else(|| panic!("{name}"));
        assert!(page.contains(&format!("(pictures/{name})")), "{name} is not shown");
        assert!(drawn.contains(&format!("\"{stem}\"")), "{name} is not drawn");
        count += 1;
    }
    assert_eq!(count, 9);
}

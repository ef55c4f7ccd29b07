//! What comes in at the console of the shipped image: terminals' keys, damaged lines, pastes, lines typed ahead, a console
//! that is left alone.
//!
//! Damage on the way to the receiver is in `altered.rs`.

use std::fmt::Write as _;

use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;

/// Three T7s and an ISU at rest, and these lines typed.
fn typed(duration_ms: u64, lines: &[(u64, String)]) -> Ran {
    let mut scenario = format!(
        "seed = 1\nduration = \"{duration_ms}ms\"\n\
         t7 = [{{ address = 1, motion.constant = 12.5 }}, {{ address = 3, motion.constant = 0.5 }}]\n\
         isu = [{{ address = 1, motion.constant = 90.0 }}]\n"
    );
    for (at, line) in lines {
        let mut text = String::new();
        for character in line.chars() {
            match character {
                '"' | '\\' => write!(text, "\\{character}"),
                _ if character.is_control() => write!(text, "\\u{:04X}", u32::from(character)),
                _ => write!(text, "{character}"),
            }
            .expect("memory");
        }
        writeln!(scenario, "[[typed]]\nat = \"{at}ms\"\nline = \"{text}\"").expect("memory");
    }
    run(&scenario)
}

fn lines(lines: &[(u64, &str)]) -> Vec<(u64, String)> {
    lines.iter().map(|&(at, line)| (at, line.to_owned())).collect()
}

/// Lines from one time to another, without those of the stream.
fn said(ran: &Ran, from_ms: u64, until_ms: u64) -> Vec<&str> {
    let stream = [
        "{\"slot\":",
        "{\"stats\"",
        "{\"line\"",
        "{\"times\"",
        "{\"bus_fault\"",
        "{\"summary\"",
        "{\"stream\":\"started\"",
    ];
    let within = ran.lines.iter().filter(|line| (from_ms * MS..until_ms * MS).contains(&line.began));
    within
        .map(|line| line.text.as_str())
        .filter(|text| !stream.iter().any(|begin| text.starts_with(begin)))
        .collect()
}

fn count(said: &[&str], part: &str) -> usize {
    said.iter().filter(|line| line.contains(part)).count()
}

/// The value behind a name in a list for people, or in an object.
fn value<'a>(said: &[&'a str], name: &str) -> &'a str {
    let found = said.iter().rev().find_map(|line| line.trim_start().strip_prefix(name));
    found.unwrap_or_else(|| panic!("{name} in {said:?}")).trim()
}

const NOT_CARRIED_OUT: &str = "error: line not carried out, ";

/// Row 1: a minus sign from a document was dropped, and +500 written into the sensor. Row 3: a long line was cut, and run.
/// Row 5: `ESC [` swallowed the line end.
#[test]
fn lines_that_are_not_what_was_typed_are_refused_and_write_nothing() {
    let long = format!("t7 zero 3 --yes{}", " ".repeat(80));
    let ran = typed(
        4_000,
        &[
            (300, "t7 offset 3 \u{2212}500 --yes".to_owned()),
            (400, long.clone()),
            (500, "t7 zero 3 --yes\u{1b}[".to_owned()),
            (600, String::new()),
            (700, "t7 offset 3 \u{2212}500 --yes".to_owned()),
            (800, long),
            (900, "set 0 period 2\u{1b}[".to_owned()),
            (910, "set 1 period 400".to_owned()),
            (1_000, "t7 zero 3 --yes\u{1b}[".to_owned()),
            (1_100, "t7 info 3".to_owned()),
            (2_500, "show 0".to_owned()),
            (2_700, "show 1".to_owned()),
        ],
    );
    let program = said(&ran, 300, 600);
    assert_eq!(
        program,
        [
            r#"{"error":{"kind":"damaged_line","reason":"not_ascii","characters":3}}"#,
            r#"{"error":{"kind":"line_too_long","most":80,"characters":15}}"#,
            r#"{"error":{"kind":"damaged_line","reason":"control","characters":1}}"#,
        ]
    );
    let person = said(&ran, 700, 1_100);
    assert_eq!(count(&person, NOT_CARRIED_OUT), 4, "{person:?}");
    assert_eq!(count(&person, "characters that are not ASCII: 3"), 1);
    assert_eq!(count(&person, "characters more than 80: 15"), 1);
    assert_eq!(count(&person, "control sequences"), 2);
    let info = said(&ran, 1_100, 2_500);
    let identity =
        info.iter().find(|line| line.starts_with("identity: ")).unwrap_or_else(|| panic!("{info:?}"));
    assert!(identity.contains("offset_2_mdeg 0"), "the sensor's offset is as it was: {identity}");
    assert_eq!(value(&said(&ran, 2_500, 2_700), "period_ms"), "20");
    assert_eq!(value(&said(&ran, 2_700, 4_000), "period_ms"), "400");
}

/// Row 2: 110 lines behind `help`; the queue overflowed, and two lines became one.
#[test]
fn a_paste_that_is_too_fast_loses_lines_but_joins_none() {
    let mut paste = lines(&[(200, ""), (300, "help")]);
    paste.extend((0..110).map(|n| (300, format!("set 2 period {}", [20, 400][n % 2]))));
    paste.extend((0..20).map(|n| (1_500, format!("set 2 period {}", [20, 400][n % 2]))));
    paste.extend(lines(&[(2_800, "show 2"), (3_000, "counters")]));
    let ran = typed(3_500, &paste);
    let all = said(&ran, 300, 1_500);
    let (done, lost) = (count(&all, "done"), count(&all, "characters lost"));
    println!("{done} lines carried out, {lost} refused");
    assert!(done > 5 && lost >= 1, "{all:?}");
    assert_eq!(count(&all, "error: "), lost, "no line but those with a loss is wrong: {all:?}");
    // What was lost at the end of the paste may have been the begin of a line: the next one is refused. Then all is well.
    let later = said(&ran, 1_500, 2_800);
    let (done, late) = (count(&later, "done"), count(&later, "characters lost"));
    assert!(done + late == 20 && late <= 1, "{later:?}");
    assert_eq!(count(&later, "error: "), late, "{later:?}");
    assert_eq!(value(&said(&ran, 2_800, 3_000), "period_ms"), "400");
    let counters = said(&ran, 3_000, 3_500);
    assert_eq!(value(&counters, "damaged"), (lost + late).to_string(), "{counters:?}");
    assert!(value(&counters, "lost").parse::<u32>().expect("a number") > 0);
}

/// Row 4: of `t7 zero 3`, typed while a task worked, the tail was carried out.
#[test]
fn lines_typed_while_a_task_works_are_refused_whole() {
    let mut script = lines(&[(200, ""), (300, "t7 info 2"), (305, "t7 zero 3"), (1_300, "t7 scan")]);
    // A line every 6.5 ms, which is how long the answer takes: the end of the task falls into one of them.
    script.extend((0..200).map(|n| (1_310 + n * 13 / 2, "t7 zero 3".to_owned())));
    script.extend(lines(&[(4_000, "\u{3}"), (4_100, "show 3")]));
    let ran = typed(4_500, &script);
    let all = said(&ran, 300, 4_000);
    assert_eq!(count(&said(&ran, 300, 1_300), "a task is running"), 1, "{all:?}");
    assert!(count(&all, "a task is running") > 50, "{all:?}");
    // Behind the end of the task the first whole line asks, and what comes behind it is no answer.
    assert_eq!(count(&all, "zeroed"), 0);
    assert!(count(&all, "not done") >= 1, "{all:?}");
    assert_eq!(count(&all, "done") - count(&all, "not done") - count(&all, "under way: done"), 0, "{all:?}");
    assert_eq!(value(&said(&ran, 4_100, 4_500), "zero_deg"), "0");
}

/// A question is answered by what is typed after it was asked.
#[test]
fn a_paste_does_not_answer_the_question_in_its_middle() {
    let ran = typed(
        5_000,
        &lines(&[
            (200, ""),
            // All at once, as a paste comes.
            (300, "t7 zero 3"),
            (300, "y"),
            (300, "save"),
            (300, "zero 3"),
            (300, "y"),
            (1_000, "t7 offset 3 500"),
            (1_500, "y"),
            (3_000, "version"),
        ]),
    );
    let pasted = said(&ran, 300, 1_000);
    assert_eq!((count(&pasted, "Go on? y/N"), count(&pasted, "not done")), (1, 1), "{pasted:?}");
    assert_eq!(count(&pasted, "characters too early"), 1, "{pasted:?}");
    assert_eq!(count(&pasted, "saved") + count(&pasted, "zeroed"), 0, "{pasted:?}");
    // And this is how it is answered.
    let answered = said(&ran, 1_000, 3_000);
    assert_eq!(count(&answered, "changed: offset_mdeg 500, from 0, writes 1"), 1, "{answered:?}");
    assert_eq!(count(&said(&ran, 3_000, 5_000), "uptime_ms"), 1);
}

/// *Stranger's terminal*: the keys of seven programs, as they send them unless they are told otherwise.
struct Program {
    name: &'static str,
    /// What it sends for Enter, before the carriage return that a typed line ends with.
    enter: &'static str,
    backspace: &'static str,
    left: &'static str,
    right: &'static str,
    up: &'static str,
    home: &'static str,
    end: &'static str,
    delete: &'static str,
}

const XTERM: Program = Program {
    name: "picocom, tio (in an xterm)",
    enter: "",
    backspace: "\x7f",
    left: "\x1b[D",
    right: "\x1b[C",
    up: "\x1b[A",
    home: "\x1b[H",
    end: "\x1b[F",
    delete: "\x1b[3~",
};

const PROGRAMS: [Program; 7] = [
    XTERM,
    Program { name: "PuTTY", home: "\x1b[1~", end: "\x1b[4~", ..XTERM },
    Program {
        name: "PuTTY, application cursor keys",
        left: "\x1bOD",
        right: "\x1bOC",
        up: "\x1bOA",
        ..XTERM
    },
    Program {
        name: "screen",
        home: "\x1b[1~",
        end: "\x1b[4~",
        left: "\x1bOD",
        right: "\x1bOC",
        up: "\x1bOA",
        ..XTERM
    },
    Program { name: "minicom", backspace: "\x08", home: "\x1b[1~", end: "\x1b[4~", ..XTERM },
    Program { name: "Windows Terminal", backspace: "\x08", left: "\x1b[1;2D", right: "\x1b[1;2C", ..XTERM },
    Program {
        name: "miniterm (rxvt)",
        backspace: "\x08",
        home: "\x1b[7~",
        end: "\x1b[8~",
        enter: "",
        ..XTERM
    },
];

#[test]
fn keys_of_strangers_terminals_edit_as_they_do() {
    let mut script = lines(&[(200, "")]);
    let mut at = 300;
    for Program { backspace, left, right, up, home, end, delete, enter, .. } in &PROGRAMS {
        let keys = [
            format!("versiom{backspace}n{enter}"),
            format!("vrsion{left}{left}{left}{left}{left}e{enter}"),
            format!("ersio{home}v{end}n{enter}"),
            format!("xvfersion{home}{delete}{right}{delete}{enter}"),
            format!("{up}{enter}"),
            format!("junk\u{15}version{enter}"),
            format!("version junk\u{17}{enter}"),
            format!("junk\u{3}version{enter}"),
            format!("junk\u{1}\u{b}version\u{2}\u{6}\u{5}{enter}"),
            // Function keys, page up, a mouse, an answer of the terminal, a lone escape.
            format!("\u{1b}version\u{1b}OP\u{1b}[15~\u{1b}[5~\u{1b}[24;80R\u{1b}[[A{enter}"),
            format!("\u{1b}[200~version\u{1b}[201~{enter}"),
            "vers\t".to_owned(),
        ];
        for line in keys {
            script.push((at, line));
            at += 20;
        }
    }
    let ran = typed(at + 200, &script);
    let mut at = 300;
    for Program { name, .. } in &PROGRAMS {
        for line in 0..12 {
            let answers = said(&ran, at, at + 20);
            assert_eq!(count(&answers, "clino: version "), 1, "{name}, line {line}: {answers:?}");
            assert_eq!(count(&answers, "error"), 0, "{name}, line {line}: {answers:?}");
            at += 20;
        }
    }
}

#[test]
fn enter_is_one_key_however_it_is_sent() {
    // A line ends with CR; what stands before it here are whole lines with other ends.
    let ran =
        typed(1_000, &lines(&[(200, ""), (300, "version\nversion\r\nversion\r\u{0}version\u{1b}OMversion")]));
    let answers = said(&ran, 300, 1_000);
    assert_eq!(count(&answers, "clino: version "), 5, "{answers:?}");
    assert_eq!(count(&answers, "error"), 0, "{answers:?}");
}

/// Row 10: one stray line end, and the stream was gone for good. Row 12: what was not printed meanwhile was made up for.
#[test]
fn a_console_left_alone_comes_back_to_the_stream() {
    // No slot is read, so that the minutes pass quickly.
    let mut script: Vec<_> = (0..6).map(|slot| (100 + 20 * slot, format!("slot {slot} off"))).collect();
    script.extend(lines(&[(1_000, ""), (70_000, ""), (75_000, "json on"), (90_000, "watch")]));
    let ran = typed(100_000, &script);
    let resumed: Vec<u64> = ran
        .lines
        .iter()
        .filter(|line| line.text.starts_with(r#"{"stream":"resumed","why":"idle""#))
        .map(|line| line.began / MS)
        .collect();
    let [resumed] = resumed[..] else { panic!("once: {resumed:?}") };
    assert!((61_000..61_200).contains(&resumed), "{resumed} ms");
    let rounds = |from: u64, until: u64| {
        let within = ran.lines.iter().filter(|line| (from * MS..until * MS).contains(&line.began));
        within.filter(|line| line.text.starts_with("{\"stats\":\"t7\"")).count()
    };
    assert_eq!(rounds(1_050, 60_900), 0, "a prompt");
    assert!((1..=2).contains(&rounds(60_900, 62_000)), "{}", rounds(60_900, 62_000));
    assert!((7..=9).contains(&rounds(62_000, 70_000)), "{}", rounds(62_000, 70_000));
    assert_eq!(rounds(75_100, 89_900), 0, "a program");
    assert!((10..=12).contains(&rounds(90_000, 100_000)), "{}", rounds(90_000, 100_000));
    assert!(rounds(90_000, 90_900) <= 1, "nothing is made up for");
}

/// Row 24: of a sensor that is not there, `read` told that it is well and its value new.
#[test]
fn read_of_a_dead_sensor_claims_nothing() {
    let ran = typed(
        1_500,
        &lines(&[(500, "read 1"), (600, "read 0"), (700, ""), (800, "read 1"), (1_000, "read 0")]),
    );
    let of = |from: u64, until: u64| {
        let within = ran.lines.iter().filter(|line| (from * MS..until * MS).contains(&line.began));
        within.map(|line| line.text.as_str()).find(|line| line.contains("\"raw_deg\"")).expect("an answer")
    };
    let (dead, alive) = (of(500, 600), of(600, 700));
    assert!(dead.contains(r#""status":"no_answer","angle_deg":null,"#), "{dead}");
    assert!(dead.contains(r#""rate_deg_s":null,"turns":null,"temperature_c":null,"fresh":null"#), "{dead}");
    assert!(
        alive.contains(r#""status":"ok","angle_deg":12.500,"#) && alive.contains(r#""fresh":true"#),
        "{alive}"
    );
    let (dead, alive) = (said(&ran, 800, 1_000), said(&ran, 1_000, 1_500));
    assert_eq!((value(&dead, "health"), value(&dead, "fresh")), ("unknown", "none"), "{dead:?}");
    assert_eq!((value(&alive, "health"), value(&alive, "fresh")), ("well", "yes"), "{alive:?}");
}

/// Row 10: with `stty sane; cat` at the other end, errors went back and forth for ever.
#[test]
fn a_port_that_echoes_causes_no_output_without_end() {
    for (by, delay) in [("line", "1ms"), ("line", "500ms"), ("terminal", "100ms")] {
        let mut scenario =
            String::from("seed = 1\nduration = \"5s\"\nt7 = [{ address = 1, motion.constant = 12.5 }]\n");
        // An empty line, a wrong one, a right one; a prompt.
        let typed = ["", "nonsense", "set 0 report 500", "\\u0003", "help", "version"];
        for (line, at) in typed.iter().zip([500, 900, 1_300, 1_700, 1_710, 1_720]) {
            write!(scenario, "[[typed]]\nat = \"{at}ms\"\nline = \"{line}\"\n").expect("memory");
        }
        write!(scenario, "[console]\necho = {{ delay = \"{delay}\", by = \"{by}\" }}\n").expect("memory");
        let ran = run(&scenario);
        let what = format!("by {by}, after {delay}");
        // While readings and echo share the line, they join: then this is an error at most.
        let other = said(&ran, 0, 5_000);
        let last = said(&ran, 3_500, 5_000);
        println!("{what}: {} lines that are no readings, {} in the last 1.5 s", other.len(), last.len());
        assert!(other.len() < 150, "{what}: {other:?}");
        assert_eq!(last, [""; 0], "{what}");
        // Nothing has changed: the angle is what it was.
        let angles: Vec<_> = ran.slot(0).filter_map(|spoken| spoken.reading.angle_deg).collect();
        assert!(angles.len() > 5 && angles.iter().all(|angle| *angle == 12.5), "{what}: {angles:?}");
        let readings = ran.slot(0).filter(|spoken| spoken.began > 3_500 * MS).count();
        assert!(readings >= 2, "{what}: the stream goes on");
    }
}

//! The console transcripts of the documents are what the shipped image prints.
//!
//! A fenced block with `<!-- transcript: NAME -->` on the line before it belongs to the scenario of that name below. The
//! scenario types the lines; what the console then prints has to be the block.
//! `cargo xtask transcripts` writes the blocks anew. That no block lacks its mark is checked by
//! `xtask/tests/documents.rs`, which needs no image.
//!
//! Sensors stand still, so that angles are the same however long the image takes. What depends on the microsecond at
//! which the image does something is not compared: it moves with every change of the firmware or its compiler. These are
//! the digits of ages and up-times, of `seq`, of a task's progress, and of the statistics lines.

use std::fs::{self, File};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

use clino_host_tests::run;

/// A transcript, and the run that makes it.
struct Transcript {
    name: &'static str,
    /// The document it is in, from the root of the repository on.
    document: &'static str,
    /// What is connected.
    sensors: &'static str,
    /// What is typed, and when, in ms.
    typed: &'static [(u32, &'static str)],
    duration: &'static str,
    shown: Shown,
}

/// What of a run is shown.
enum Shown {
    /// All from the first prompt to the end.
    Session,
    /// The stream: this many lines, the first of which is the first that begins like this.
    Lines(&'static str, usize),
    /// The stream without its readings: this many lines, from the first on that begins like this.
    WithoutReadings(&'static str, usize),
}

/// As delivered, but for the T7 at address 2, which is not there.
const USUAL: &str = "\
t7 = [{ address = 1, motion.constant = 12.345 }, { address = 3, motion.constant = 0.5 }]
isu = [{ address = 1, motion.constant = 90.0 }]
pwm = [{ channel = 1, motion.constant = 90.0 }, { channel = 2, motion.constant = 45.0 }]
";

/// A T7 as its maker delivers it, alone on the bus.
const NEW: &str = "t7 = [{ address = 127, motion.constant = 12.345 }]\n";

/// A T7 at address 5 that was set to another bit rate.
const SLOW: &str = "t7 = [{ address = 5, baud = 9600, motion.constant = 12.345 }]\n";

static TRANSCRIPTS: [Transcript; 11] = [
    Transcript {
        name: "readme-stream",
        document: "README.md",
        sensors: USUAL,
        typed: &[],
        duration: "2500ms",
        shown: Shown::Lines("{\"slot\":1,", 2),
    },
    Transcript {
        name: "readme",
        document: "README.md",
        sensors: USUAL,
        typed: &[
            (2_000, ""),
            (2_200, "list"),
            (2_600, "zero 0"),
            (2_800, "slot 1 off"),
            (3_200, "list"),
            (3_400, "save"),
        ],
        duration: "4s",
        shown: Shown::Session,
    },
    Transcript {
        name: "stream",
        document: "docs/console.md",
        sensors: USUAL,
        typed: &[],
        duration: "2500ms",
        shown: Shown::Lines("{\"stream\":\"started\"", 10),
    },
    Transcript {
        name: "statistics",
        document: "docs/console.md",
        sensors: USUAL,
        typed: &[],
        duration: "2500ms",
        shown: Shown::WithoutReadings("{\"stats\":\"t7\"", 9),
    },
    Transcript {
        name: "session",
        document: "docs/console.md",
        sensors: USUAL,
        typed: &[
            (1_500, ""),
            (1_700, "list"),
            (1_900, "t7 info 1"),
            (2_500, "t7 zero 1"),
            (3_500, "y"),
            (5_000, "set 0 period 40 name boom"),
            (5_200, "set 0 stale 30"),
            (5_400, "read 0"),
            (5_600, "reset-cause"),
        ],
        duration: "6s",
        shown: Shown::Session,
    },
    Transcript {
        name: "bit-rate",
        document: "docs/console.md",
        sensors: SLOW,
        typed: &[
            (1_500, ""),
            (1_700, "t7 scan all"),
            (30_000, "bus t7 -b 9600"),
            (31_000, "t7 baud 5 115200"),
            (32_000, "y"),
            (34_000, "slot 0 t7 5"),
            (35_500, "list"),
        ],
        duration: "36s",
        shown: Shown::Session,
    },
    Transcript {
        name: "program",
        document: "docs/console.md",
        sensors: USUAL,
        typed: &[
            (1_500, ""),
            (1_700, "json on"),
            (1_800, "set 0 period 50"),
            (2_400, "t7 zero 1"),
            (2_500, "t7 zero 1 --yes"),
            (5_000, "set 0 period 99999999"),
        ],
        duration: "5500ms",
        shown: Shown::Session,
    },
    Transcript {
        name: "damaged",
        document: "docs/console.md",
        sensors: USUAL,
        typed: &[(1_800, "t7 offset 1 \u{2212}500 --yes")],
        duration: "2500ms",
        shown: Shown::Lines("{\"error\"", 1),
    },
    Transcript {
        name: "alarms",
        document: "docs/alarms.md",
        sensors: USUAL,
        typed: &[
            (1_500, ""),
            (1_700, "set 0 alarm both high 10 hysteresis 0.5 latch on"),
            (1_900, "set 0 -- low -2.5"),
            (2_100, "set 0 delay 0.2 no_value 5"),
            (2_400, "alarms"),
            (2_900, "acknowledge 0"),
            (3_200, "alarms"),
        ],
        duration: "3500ms",
        shown: Shown::Session,
    },
    Transcript {
        name: "alarm-line",
        document: "docs/alarms.md",
        sensors: USUAL,
        typed: &[(1_500, "set 0 alarm high high 10")],
        duration: "2500ms",
        shown: Shown::Lines("{\"alarm\"", 1),
    },
    Transcript {
        name: "new-t7",
        document: "docs/quick-start.md",
        sensors: NEW,
        typed: &[
            (1_500, ""),
            (1_700, "t7 scan"),
            (12_000, "t7 address 127 5"),
            (13_000, "y"),
            (15_000, "slot 0 t7 5"),
            (15_300, "zero 0"),
            (15_500, "list"),
            (15_700, "save"),
        ],
        duration: "17s",
        shown: Shown::Session,
    },
];

#[test]
fn readme_stream() {
    compare("readme-stream");
}

#[test]
fn readme() {
    compare("readme");
}

#[test]
fn stream() {
    compare("stream");
}

#[test]
fn statistics() {
    compare("statistics");
}

#[test]
fn session() {
    compare("session");
}

#[test]
fn bit_rate() {
    compare("bit-rate");
}

#[test]
fn program() {
    compare("program");
}

#[test]
fn damaged() {
    compare("damaged");
}

#[test]
fn alarms() {
    compare("alarms");
}

#[test]
fn alarm_line() {
    compare("alarm-line");
}

#[test]
fn new_t7() {
    compare("new-t7");
}

const MARK: &str = "<!-- transcript: ";

/// No block is marked that no scenario here makes, and each is in its document once.
#[test]
fn every_marked_block_has_its_run() {
    let mut documents: Vec<PathBuf> = vec![root().join("README.md")];
    let pages = fs::read_dir(root().join("docs")).expect("docs");
    documents.extend(pages.map(|page| page.expect("a file").path()));
    documents.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    let mut marked: Vec<(String, PathBuf)> = Vec::new();
    for path in documents {
        let text = fs::read_to_string(&path).expect("a document");
        let marks = text.split(MARK).skip(1).filter_map(|rest| rest.split_once(" -->"));
        marked.extend(marks.map(|(name, _)| (name.to_owned(), path.clone())));
    }
    let mut made: Vec<(String, PathBuf)> =
        TRANSCRIPTS.iter().map(|made| (made.name.to_owned(), root().join(made.document))).collect();
    marked.sort();
    made.sort();
    assert_eq!(marked, made);
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn compare(name: &str) {
    let transcript = TRANSCRIPTS.iter().find(|transcript| transcript.name == name).expect("a transcript");
    let fresh = transcript.print();
    println!("{fresh}");
    let path = root().join(transcript.document);
    // Tests of several processes may write to one document.
    let mut file = File::options().read(true).write(true).open(&path).expect("a document");
    file.lock().expect("a lock");
    let mut text = String::new();
    file.read_to_string(&mut text).expect("text");
    let (before, rest) = text.split_once(&format!("{MARK}{name} -->\n```")).expect("a marked block");
    let (kind, rest) = rest.split_once('\n').expect("the language of the block");
    let (shown, after) = rest.split_once("```").expect("the end of the block");
    if steady(shown) == steady(&fresh) {
        return;
    }
    let document = transcript.document;
    assert!(
        std::env::var_os("UPDATE").is_some(),
        "{document}, transcript {name}: the image prints\n{fresh}and the document says\n{shown}"
    );
    let text = format!("{before}{MARK}{name} -->\n```{kind}\n{fresh}```{after}");
    file.rewind().and_then(|()| file.set_len(0)).expect("an empty file");
    file.write_all(text.as_bytes()).expect("it is written");
}

impl Transcript {
    /// What the image prints.
    fn print(&self) -> String {
        let Transcript { sensors, typed, duration, shown, .. } = self;
        let mut scenario = format!("seed = 1\nduration = \"{duration}\"\n{sensors}");
        for (at, line) in *typed {
            scenario += &format!("[[typed]]\nat = \"{at}ms\"\nline = \"{line}\"\n");
        }
        let ran = run(&scenario);
        let lines = ran.lines.iter().map(|line| line.text.as_str());
        let from = |first: &'static str| lines.clone().skip_while(move |line| !line.starts_with(first));
        let shown: Vec<&str> = match *shown {
            Shown::Session => from("clino> ").collect(),
            Shown::Lines(first, count) => from(first).take(count).collect(),
            Shown::WithoutReadings(first, count) => {
                from(first).filter(|line| !line.starts_with("{\"slot\"")).take(count).collect()
            }
        };
        shown.iter().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}

/// Lines with statistics: all of their numbers are left out.
const STATISTICS: [&str; 4] = ["{\"stats\"", "{\"line\"", "{\"times\"", "{\"bus_fault\""];
/// What stands before a number that is left out.
const BEFORE: [&str; 5] = ["\"age_ms\":", "\"seq\":", "\"uptime_ms\":", "uptime_ms ", "under way: done "];

/// The text without what is not compared.
fn steady(text: &str) -> String {
    text.lines().map(|line| steady_line(line) + "\n").collect()
}

fn steady_line(line: &str) -> String {
    let all = STATISTICS.iter().any(|begin| line.starts_with(begin));
    let mut steady = String::new();
    let mut rest = line;
    while let Some(digits) = rest.find(|character: char| character.is_ascii_digit()) {
        let (before, number) = rest.split_at(digits);
        let end = number.find(|character: char| !character.is_ascii_digit()).unwrap_or(number.len());
        let (number, after) = number.split_at(end);
        steady += before;
        if after.starts_with(" ms ") {
            // Ages stand in a column.
            steady.truncate(steady.trim_end().len());
            steady += " #";
        } else if all || BEFORE.iter().any(|name| steady.ends_with(name)) {
            steady += "#";
        } else {
            steady += number;
        }
        rest = after;
    }
    steady + rest
}

#[test]
fn what_is_not_compared_is_left_out() {
    for (line, expected) in [
        ("   0  t7       1     12.345      3 ms  ok", "   0  t7       1     12.345 # ms  ok"),
        (
            r#"{"slot":0,"angle_deg":12.345,"age_ms":13,"seq":7}"#,
            r##"{"slot":0,"angle_deg":12.345,"age_ms":#,"seq":#}"##,
        ),
        (r#"{"stats":"t7","requests":12}"#, r##"{"stats":"t#","requests":#}"##),
        ("clino: version 0.1.0, uptime_ms 812, boots 1", "clino: version 0.1.0, uptime_ms #, boots 1"),
    ] {
        assert_eq!(steady_line(line), expected);
    }
}

//! The decoders of `tools/sigrok`, in stock `sigrok-cli`: a capture of the virtual board decodes to what its bus log says, and
//! the examples of the vendors' documents to what they mean.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clino_board::vcd::{self, Signal};
use clino_testkit::programs::{Sigrok, said, skipped};
use serde_json::Value;

use super::board::command;

/// sigrok-cli takes one sample of this many nanoseconds: 87 for a bit at 115200 bit/s.
const SAMPLE_NS: u64 = 100;

/// `sigrok-cli`, if it can be had.
fn sigrok() -> Option<&'static Sigrok> {
    static SIGROK: OnceLock<Result<Sigrok, String>> = OnceLock::new();
    SIGROK.get_or_init(|| Sigrok::get(Path::new(env!("CARGO_TARGET_TMPDIR")))).as_ref().map_or_else(
        |why| {
            skipped("sigrok", &format!("sigrok-cli is not installed, and could not be downloaded\n{why}"));
            None
        },
        Some,
    )
}

/// A line of a decoder: its times in ns, and its text.
#[derive(Clone, Debug)]
struct Annotation {
    begin: u64,
    end: u64,
    text: String,
}

/// What the decoder makes of a signal.
struct Decoded {
    /// Commands and responses.
    messages: Vec<Annotation>,
    /// The bytes of each frame.
    bytes: Vec<Annotation>,
    errors: Vec<Annotation>,
}

/// Runs a decoder on a signal of a capture.
fn decode(sigrok: &Sigrok, capture: &Path, uart: &str, decoder: &str) -> Decoded {
    let one = |classes: &str| {
        let mut command = sigrok.command();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/sigrok");
        command.env("SIGROKDECODE_DIR", folder);
        command.args(["-I", &format!("vcd:downsample={SAMPLE_NS}"), "-i"]).arg(capture);
        command.args(["-P", &format!("uart:{uart},{decoder}"), "-A", &format!("{decoder}={classes}")]);
        let output = command.arg("--protocol-decoder-samplenum").output().expect("sigrok-cli runs");
        assert!(output.status.success(), "{command:?}: {}", said(&output));
        let text = String::from_utf8(output.stdout).expect("text");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("rror"), "{command:?}: {stderr}");
        text.lines().map(annotation).collect()
    };
    Decoded { messages: one("command:response"), bytes: one("bytes"), errors: one("error") }
}

/// `101120-103725 usdigital_t7-1: command 1 get_angle: axis 2`
fn annotation(line: &str) -> Annotation {
    let parsed = || {
        let (times, rest) = line.split_once(' ')?;
        let (begin, end) = times.split_once('-')?;
        let ns = |samples: &str| samples.parse::<u64>().ok().map(|samples| samples * SAMPLE_NS);
        Some(Annotation { begin: ns(begin)?, end: ns(end)?, text: rest.split_once(": ")?.1.to_owned() })
    };
    parsed().unwrap_or_else(|| panic!("not an annotation: {line:?}"))
}

/// A character of the bus log.
#[derive(Debug)]
struct Character {
    begin: u64,
    end: u64,
    byte: u8,
}

fn characters(bus_log: &str, bus: &str) -> Vec<Character> {
    let parsed = |line: &str| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [begin, of, "char", _, byte, end, _, fate] = fields[..] else { return None };
        assert!(of != bus || fate == "clean", "{line}");
        let end = end.strip_prefix("end=")?.parse().ok()?;
        let byte = u8::from_str_radix(byte, 16).ok()?;
        (of == bus).then_some(Character { begin: begin.parse().ok()?, end, byte })
    };
    bus_log.lines().filter_map(parsed).collect()
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Runs the image and returns its capture and its bus log.
fn capture(name: &str, scenario: &str, duration: &str) -> (PathBuf, String) {
    let [toml, dump, log] = ["toml", "vcd", "log"].map(|ending| file(&format!("{name}.{ending}")));
    fs::write(&toml, scenario).expect("the target directory can be written");
    let mut board = command();
    board
        .arg("--scenario")
        .arg(toml)
        .args(["--duration", duration, "--vcd"])
        .arg(&dump)
        .arg("--bus-log")
        .arg(&log);
    let output = board.output().expect("the program starts");
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", said(&output));
    (dump, fs::read_to_string(log).expect("it was written"))
}

/// Every byte of the log is in one frame, in order, and frames have its times: their start within two samples, their end
/// within a bit.
fn assert_same_bytes(decoded: &Decoded, log: &[Character], bit_ns: u64) {
    let mut log = log.iter();
    let mut frames = 0;
    for frame in &decoded.bytes {
        let mut first_and_last: Option<(&Character, &Character)> = None;
        for byte in frame.text.split(' ') {
            let heard = log.next().unwrap_or_else(|| panic!("the log has ended: {frame:?}"));
            assert_eq!(u8::from_str_radix(byte, 16), Ok(heard.byte), "{frame:?}: {heard:?}");
            first_and_last = Some((first_and_last.map_or(heard, |(first, _)| first), heard));
        }
        let (first, last) = first_and_last.expect("a frame has bytes");
        assert!(first.begin.abs_diff(frame.begin) <= 2 * SAMPLE_NS, "{frame:?}: {first:?}");
        assert!(last.end.abs_diff(frame.end) <= bit_ns, "{frame:?}: {last:?}");
        frames += 1;
    }
    // A frame that the end of the run has cut, and one whose end a pause would tell.
    let left = log.count();
    assert!(left <= 36, "{left} characters of the log were not decoded");
    assert!(frames >= 10, "{frames} frames are too few to tell");
}

const SENSORS: &str = "\
[[t7]]\naddress = 1\nmotion.constant = 12.345\nfault = { every = 7, what = \"bad_checksum\" }
[[t7]]\naddress = 2\nmotion.constant = -170.5
[[t7]]\naddress = 3\nmotion.constant = 0.001
[[isu]]\naddress = 1\nmotion.constant = 271.25\nfault = { every = 4, what = \"bad_checksum\" }
";

#[test]
fn a_capture_of_the_board_decodes_to_its_bus_log() {
    let Some(sigrok) = sigrok() else { return };
    let (dump, log) = capture("capture", SENSORS, "3s");

    let t7 = decode(sigrok, &dump, "rx=t7_pair:baudrate=115200", "usdigital_t7");
    assert_same_bytes(&t7, &characters(&log, "t7"), 8_681);
    for (address, angle) in [(1, "12.345"), (2, "-170.500"), (3, "0.001")] {
        let of = |text: &str| format!("response {address} {text}");
        let angles = t7.messages.iter().filter(|it| it.text.starts_with(&of("get_angle:"))).count();
        let right = of(&format!("get_angle: axis 2, angle {angle} deg"));
        let as_true = t7.messages.iter().filter(|it| it.text == right).count();
        assert!(angles > 20, "{angles} angles of {address}");
        assert_eq!(angles, as_true, "address {address}");
        let commands =
            t7.messages.iter().filter(|it| it.text == format!("command {address} get_angle: axis 2"));
        assert!(commands.count() >= angles, "address {address}");
    }
    assert!(t7.errors.len() > 3, "{:?}", t7.errors);
    assert!(t7.errors.iter().all(|error| error.text.starts_with("checksum ")), "{:?}", t7.errors);

    let isu = decode(sigrok, &dump, "rx=isu_pair:baudrate=9600", "stt_isu");
    assert_same_bytes(&isu, &characters(&log, "isu"), 104_167);
    let angles: Vec<f64> = isu.messages.iter().filter_map(|it| degrees(&it.text)).collect();
    assert!(angles.len() > 5, "{:?}", isu.messages);
    assert!(angles.iter().all(|angle| (angle - 271.25).abs() <= 360.0 / 65_536.0), "{angles:?}");
    assert!(isu.errors.iter().any(|error| error.text.starts_with("checksum ")), "{:?}", isu.errors);
}

/// `response 1 read_ram: angle 350.00244 deg`
fn degrees(text: &str) -> Option<f64> {
    text.strip_prefix("response 1 read_ram: angle ")?.strip_suffix(" deg")?.parse().ok()
}

#[test]
fn the_examples_of_the_documents_mean_what_they_say() {
    let Some(sigrok) = sigrok() else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/codec/tests/vectors/documented.jsonl");
    let vectors: Vec<Value> = fs::read_to_string(path)
        .expect("the vectors are there")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    for (protocol, baud, decoder, count) in
        [("t7", 115_200, "usdigital_t7", 35), ("isu", 9_600, "stt_isu", 9)]
    {
        let of: Vec<&Value> = vectors.iter().filter(|vector| vector["protocol"] == protocol).collect();
        assert_eq!(of.len(), count);
        let frames: Vec<Vec<u8>> = of.iter().map(|vector| bytes(vector)).collect();
        let dump = file(&format!("documented-{protocol}.vcd"));
        let (signal, end) = line(&frames, baud);
        vcd::write(&[signal], end, fs::File::create(&dump).expect("a file")).expect("it is written");
        let decoded = decode(sigrok, &dump, &format!("rx=pair:baudrate={baud}"), decoder);
        assert!(decoded.errors.is_empty(), "{:?}", decoded.errors);
        let hex: Vec<&str> = decoded.bytes.iter().map(|frame| frame.text.as_str()).collect();
        let sent: Vec<String> =
            of.iter().map(|vector| vector["hex"].as_str().unwrap().to_lowercase()).collect();
        assert_eq!(hex, sent);
        for (vector, message) in of.iter().zip(&decoded.messages) {
            let kind = vector["kind"].as_str().unwrap();
            assert!(message.text.starts_with(kind), "{vector}: {}", message.text);
            for word in meaning(&vector["want"]) {
                assert!(message.text.contains(&word), "{vector}: {word:?} in {:?}", message.text);
            }
        }
        assert_eq!(decoded.messages.len(), of.len());
    }
}

/// Two damages that a frame may suffer: a bit is inverted, the end is missing.
#[test]
fn damaged_examples_are_no_messages() {
    let Some(sigrok) = sigrok() else { return };
    let mut frames: Vec<Vec<u8>> = Vec::new();
    let whole = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
    for place in 2..whole.len() {
        for bit in 0..8 {
            let mut frame = whole.to_vec();
            frame[place] ^= 1 << bit;
            frames.push(frame);
        }
    }
    frames.extend((1..whole.len()).map(|length| whole[..length].to_vec()));
    // Ends the last incomplete one.
    frames.push(whole.to_vec());
    let dump = file("damaged.vcd");
    let (signal, end) = line(&frames, 115_200);
    vcd::write(&[signal], end, fs::File::create(&dump).expect("a file")).expect("it is written");
    let decoded = decode(sigrok, &dump, "rx=pair:baudrate=115200", "usdigital_t7");
    assert_eq!(decoded.messages.len(), 1, "{:?}", decoded.messages);
    assert_eq!(decoded.errors.len(), frames.len() - 1);
}

/// What the example says, in the decoder's words.
fn meaning(want: &Value) -> Vec<String> {
    let mut words = Vec::new();
    let degrees = |mdeg: &Value| format!("{:.3}", mdeg.as_i64().expect("a number") as f64 / 1e3);
    let list = |values: &Value, each: &dyn Fn(&Value) -> String| {
        values.as_array().expect("a list").iter().map(each).collect::<Vec<_>>().join(" ")
    };
    let plain = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    for (key, value) in want.as_object().into_iter().flatten() {
        words.push(match key.as_str() {
            "address" => format!(" {value} "),
            "angles_mdeg" => format!("angles {} deg", list(value, &degrees)),
            "offsets_mdeg" => format!("offsets {} deg", list(value, &degrees)),
            "angle_mdeg" => format!("angle {} deg", degrees(value)),
            "temperature_centi_c" => format!("temperature {:.2} C", value.as_f64().expect("a number") / 1e2),
            "accelerations_raw" => format!("accelerations {}", list(value, &plain)),
            "directions" => format!("directions {}", list(value, &plain)),
            "damping_ms" => format!("damping {value} ms"),
            "output_range" | "device_error" => plain(value),
            "calibration_state" => format!("calibration {value}"),
            other => format!("{other} {}", plain(value)),
        });
    }
    words
}

fn bytes(vector: &Value) -> Vec<u8> {
    let hex = vector["hex"].as_str().expect("hex");
    hex.split(' ').map(|byte| u8::from_str_radix(byte, 16).expect("a byte")).collect()
}

/// A line with these frames, 20 characters of silence between them, and when it ends.
fn line(frames: &[Vec<u8>], baud: u64) -> (Signal, u64) {
    let bit = |number: u64| number * 1_000_000_000 / baud;
    let mut changes = Vec::new();
    let mut bits = 200;
    for frame in frames {
        for byte in frame {
            let word = u16::from(*byte) << 1 | 1 << 9;
            changes.extend((0..10).map(|place| (bit(bits + place), word >> place & 1 == 1)));
            bits += 10;
        }
        bits += 200;
    }
    changes.dedup_by_key(|change| change.1);
    (Signal { name: "pair".to_owned(), initial: true, changes }, bit(bits))
}

/// The words of `tools/sigrok` about how to start it are those that work.
#[test]
fn the_line_of_the_readme_runs() {
    let Some(sigrok) = sigrok() else { return };
    let (dump, _) = capture("readme-capture", SENSORS, "200ms");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/sigrok");
    let readme = fs::read_to_string(folder.join("README.md")).expect("it is there");
    let line = readme.split("```sh").nth(1).and_then(|rest| rest.split("```").next()).expect("a block");
    let line = line.replace("\\\n", " ");
    let words: Vec<&str> = line.split_whitespace().collect();
    let [variable, "sigrok-cli", arguments @ ..] = &words[..] else { panic!("{words:?}") };
    let (name, value) = variable.split_once('=').expect("a variable");
    let mut command = sigrok.command();
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")).env(name, value);
    for argument in arguments {
        match *argument {
            "board.vcd" => command.arg(&dump),
            other => command.arg(other),
        };
    }
    let output = command.output().expect("sigrok-cli runs");
    let mut shown = String::new();
    write!(shown, "{}", said(&output)).expect("memory");
    assert!(shown.contains("response 1 get_angle: axis 2, angle 12.345 deg"), "{shown}");
}

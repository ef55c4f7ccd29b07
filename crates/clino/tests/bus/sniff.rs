//! `clino sniff`: on a pair with a master and a sensor, and on captures; the bus log of the virtual board against its own
//! record of who sent what.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use clino_pty::Terminal;
use clino_testkit::programs::skipped;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use super::common::{CLINO, clino, fed};

/// Objects of a capture.
fn decoded(line: &str, capture: &str) -> Vec<Value> {
    let run = fed(&format!("sniff {line} --from - --json"), capture);
    assert_eq!(run.stderr, "", "{run:?}");
    run.objects()
}

#[test]
fn both_directions_of_both_protocols_with_times() {
    let t7 = "1.000000 05 01 83\n1.002260 05 06 83 00 00 30 39 09\n";
    let objects = decoded("t7", t7);
    let brief = |object: &Value| (object["at_us"].as_u64(), object["direction"].as_str().map(str::to_owned));
    assert_eq!(brief(&objects[0]), (Some(1_000_000), Some("command".to_owned())));
    assert_eq!(brief(&objects[1]), (Some(1_002_260), Some("answer".to_owned())));
    assert_eq!(objects[1]["angle_mdeg"], 12_345);
    // 2260 us after the first byte; a character has 87, rounded.
    assert_eq!(objects[1]["after_us"], 2_260 - 3 * 87);
    let isu = "0.5 03 34 58 02 8E\n0.520000 04 35 58 40 00 CD\n0.6 02 F1 04 F5\n";
    let objects = decoded("isu", isu);
    assert_eq!((&objects[0]["function"], &objects[0]["direction"]), (&"read_ram".into(), &"command".into()));
    assert_eq!(objects[1]["angle_udeg"], 90_000_000);
    assert_eq!(objects[2]["device_error"], "hardware_error");
    let run = fed("sniff t7 --from -", t7);
    let expected = "    1.000000 -> 05 01 83                   address 5, command get_angle, axis 2\n    \
                    1.002260 <- 05 06 83 00 00 30 39 09    address 5, command get_angle, axis 2, angle_mdeg 12345, after_us 1999\n";
    assert_eq!((run.status, run.stdout.as_str()), (0, expected));
}

#[test]
fn set_commands_and_answers_that_look_alike_are_told_apart() {
    // Set Angle Output Range to 1, and the answer with status 1: the same bytes.
    let frame = super::common::t7_frame(&[0x05, 0x03, 0x8D, 0x01]);
    let objects = decoded("t7", &format!("1.0 {frame}\n1.02 {frame}\n1.2 {frame}\n"));
    let directions: Vec<_> =
        objects.iter().map(|object| object["direction"].as_str().unwrap_or("none")).collect();
    assert_eq!(directions, ["command", "answer", "command"], "{objects:?}");
}

#[test]
fn errors_and_gaps_are_told_and_make_the_status_1() {
    let run = fed(
        "sniff t7 --from - --json",
        "1.0 05 01 83\n2.0 05 01 83\n2.1 05 06 83 00 00\n3.0 05 06 83 00 00 30 38 09\n",
    );
    assert_eq!(run.status, 1, "{run:?}");
    let kinds: Vec<String> = run
        .objects()
        .iter()
        .map(|object| {
            let direction = object["direction"].as_str().unwrap_or("none");
            format!("{direction} {}", object["error"]["kind"].as_str().unwrap_or("good"))
        })
        .collect();
    assert_eq!(
        kinds,
        ["command good", "command no_answer", "command good", "none no_frame", "none checksum"]
    );
    for (line, part) in [
        ("sniff t7 --from /no/such/file", "/no/such/file"),
        ("sniff t7", "--from"),
        ("sniff isu --baud 9600 --port x", "leave --baud out"),
        ("sniff t7 --from x --port y", "cannot be used with"),
    ] {
        let run = clino(line);
        assert_eq!(run.status, 2, "{run:?}");
        assert!(run.stderr.contains(part), "{line}: {run:?}");
    }
}

#[test]
fn sigroks_export_is_read() {
    // 1 MHz: the number of a sample is its microsecond.
    let export = "1000000-1000086 uart-1: 05\n1000087-1000173 uart-1: 01\n1000174-1000260 uart-1: 83\n";
    let objects = decoded("t7 --samplerate 1000000", export);
    assert_eq!(objects.len(), 1, "{objects:?}");
    assert_eq!(
        (objects[0]["at_us"].as_u64(), &objects[0]["command"]),
        (Some(1_000_000), &"get_angle".into())
    );
}

/// Until it has the port open and set up, what is handed over is lost.
fn wait_until_open(child: &Child, port: impl AsRef<Path>) {
    let began = Instant::now();
    let has_it = || {
        let open = std::fs::read_dir(format!("/proc/{}/fd", child.id())).unwrap();
        open.flatten().any(|file| std::fs::read_link(file.path()).is_ok_and(|path| path == port.as_ref()))
    };
    while !has_it() {
        assert!(began.elapsed() < Duration::from_secs(60), "it does not open the port");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
}

#[test]
fn a_listener_at_a_port_sends_nothing_and_hears_both() {
    let mut terminal = Terminal::open(115_200).unwrap();
    let line = format!("sniff t7 --json --port {}", terminal.path());
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    wait_until_open(&child, terminal.path());
    for piece in [&[0x05, 0x01, 0x83][..], &[0x05, 0x06, 0x83, 0x00], &[0x00, 0x30, 0x39, 0x09]] {
        terminal.deliver(piece).unwrap();
        std::thread::sleep(Duration::from_millis(3));
    }
    let objects = [0, 1].map(|_| serde_json::from_str::<Value>(&lines.next().unwrap().unwrap()).unwrap());
    assert_eq!((&objects[0]["direction"], &objects[1]["direction"]), (&"command".into(), &"answer".into()));
    assert_eq!(objects[1]["angle_mdeg"], 12_345);
    let mut buffer = [0; 16];
    assert_eq!(terminal.read(&mut buffer).unwrap(), b"", "a listener sends nothing");
    // Inverted, as with A and B swapped on an adapter that shows no stop bits: the cause is named.
    for _ in 0..20 {
        terminal.deliver(&[0xF5, 0x7F, 0x9F, 0xFD]).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "what is no frame was heard");
}

#[test]
fn a_listener_that_hears_nothing_sensible_is_told_the_cause() {
    let mut terminal = Terminal::open(115_200).unwrap();
    let line = format!("sniff t7 --port {}", terminal.path());
    let child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_until_open(&child, terminal.path());
    for _ in 0..20 {
        terminal.deliver(&[0xF5, 0x7F, 0x9F, 0xFD]).unwrap();
        std::thread::sleep(Duration::from_millis(60));
    }
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("A and B are swapped") && said.contains("1. "), "{said}");
}

/// Who sent a frame, the microsecond of its first byte, its bytes.
type Sent = (bool, u64, Vec<u8>);

/// What the bus log itself says: characters of one sender without a pause.
fn sent(log: &str, bus: &str, gap_ns: u64) -> Vec<Sent> {
    let mut characters: Vec<(u64, bool, u8)> = log
        .lines()
        .filter_map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [time, on, "char", sender, ..] = words[..] else { return None };
            let end = words.iter().position(|word| word.starts_with("end="))?;
            let byte = u8::from_str_radix(words[end - 1], 16).ok()?;
            (on == bus).then(|| (time.parse().unwrap(), sender == "gateway", byte))
        })
        .collect();
    characters.sort();
    let mut frames: Vec<Sent> = Vec::new();
    let mut last = (0, false);
    for (at, by_gateway, byte) in characters {
        match frames.last_mut().filter(|_| last.1 == by_gateway && at - last.0 < gap_ns) {
            Some((_, _, bytes)) => bytes.push(byte),
            None => frames.push((by_gateway, at / 1_000, vec![byte])),
        }
        last = (at, by_gateway);
    }
    frames
}

#[test]
fn a_bus_log_of_the_virtual_board_is_decoded_as_the_board_recorded_it() {
    let [elf, vboard] = ["CLINO_ELF", "CLINO_VBOARD"].map(std::env::var_os);
    let (Some(elf), Some(vboard)) = (elf, vboard) else {
        let why =
            "CLINO_ELF and CLINO_VBOARD name no image and no virtual board: run with `cargo xtask test`";
        return skipped("a_bus_log_of_the_virtual_board_is_decoded_as_the_board_recorded_it", why);
    };
    let log = std::env::temp_dir().join(format!("clino-bus-log-{}", std::process::id()));
    let output =
        Command::new(vboard).arg("--elf").arg(elf).args(["--duration", "2s", "--bus-log"]).arg(&log).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(&log).unwrap();
    for (bus, gap_ns, least) in [("t7", 200_000, 200), ("isu", 2_000_000, 5)] {
        let expected = sent(&text, bus, gap_ns);
        assert!(expected.len() > least, "{bus}: {} frames", expected.len());
        let run = clino(&format!("sniff {bus} --json --from {}", log.display()));
        assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{bus}");
        let found: Vec<Sent> = run
            .objects()
            .iter()
            .map(|object| {
                let bytes = object["bytes"].as_str().unwrap().split(' ');
                let bytes = bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
                (object["direction"] == "command", object["at_us"].as_u64().unwrap(), bytes)
            })
            .collect();
        // The last frame may be cut off by the end of the run.
        let whole = expected.len() - 1;
        assert_eq!(found[..whole], expected[..whole], "{bus}");
    }
    std::fs::remove_file(log).unwrap();
}

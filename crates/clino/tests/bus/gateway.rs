//! `clino gateway`: the shipped image on the virtual board, through the pseudo-terminal of its console.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use clino_testkit::programs::skipped;

use super::common::clino;
use super::port::Port;
use super::server::{PATIENCE, Server};

/// A virtual board, ended with the test.
struct Board {
    child: Child,
    console: String,
}

impl Board {
    fn start(test: &str) -> Option<Self> {
        let [elf, vboard] = ["CLINO_ELF", "CLINO_VBOARD"].map(std::env::var_os);
        let (Some(elf), Some(vboard)) = (elf, vboard) else {
            skipped(
                test,
                "CLINO_ELF and CLINO_VBOARD name no image and no virtual board: run with `cargo xtask test`",
            );
            return None;
        };
        let mut child = Command::new(vboard)
            .arg("--elf")
            .arg(elf)
            .args(["--duration", "forever", "--console-pty"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let console =
            lines.find_map(|line| line.unwrap().strip_prefix("console ").map(str::to_owned)).unwrap();
        // What it says from now on is read by none; it may not block.
        std::thread::spawn(move || lines.for_each(drop));
        Some(Self { child, console })
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_configuration_is_backed_up_changed_and_brought_back() {
    let Some(board) = Board::start("a_configuration_is_backed_up_changed_and_brought_back") else { return };
    let port = format!("--port {}", board.console);
    let file =
        |name: &str| -> PathBuf { std::env::temp_dir().join(format!("clino-{name}-{}", std::process::id())) };
    let [first, other, bad] = ["first", "other", "bad"].map(file);
    let run = clino(&format!("gateway backup {} {port}", first.display()));
    assert_eq!(run.status, 0, "{run:?}");
    let text = std::fs::read_to_string(&first).unwrap();
    assert!(text.contains("slot 0 t7 1\n") && text.contains("set modbus address 1 "), "{text}");
    // What is so already is not written.
    let run = clino(&format!("gateway restore {} --yes {port}", first.display()));
    assert_eq!((run.status, run.stdout.as_str()), (0, "unchanged: writes 0\n"), "{run:?}");
    // A program has to say that it means it.
    let run = clino(&format!("gateway restore {} --json {port}", first.display()));
    assert_eq!((run.status, &run.objects()[0]["error"]["kind"]), (2, &"unconfirmed".into()), "{run:?}");
    let changed = text
        .replace("set modbus address 1 ", "set modbus address 17 ")
        .replace("slot 6 off\n", "slot 6 t7 9\nset 6 period 500\n");
    std::fs::write(&other, &changed).unwrap();
    let run = clino(&format!("gateway restore {} --yes --json {port}", other.display()));
    let objects = run.objects();
    let targets: Vec<_> = objects
        .iter()
        .filter(|object| object["what"] == "changed")
        .map(|object| object["target"].clone())
        .collect();
    assert_eq!((run.status, targets), (0, vec!["modbus".into(), "slot 6".into()]), "{run:?}");
    assert_eq!(objects[1]["from"], "slot 6 off", "{run:?}");
    let last = objects.last().unwrap();
    assert_eq!((&last["what"], &last["saved"]), (&"restored".into(), &true.into()), "{run:?}");
    let run = clino(&format!("gateway backup {port}"));
    assert_eq!((run.status, run.stdout.as_str()), (0, changed.as_str()));
    // And back.
    let run = clino(&format!("gateway restore {} --yes --no-save {port}", first.display()));
    assert!(run.status == 0 && run.stdout.ends_with("restored: parts 2, saved no\n"), "{run:?}");
    let run = clino(&format!("gateway backup --json {port}"));
    let lines: Vec<_> =
        run.objects().iter().map(|object| object["line"].as_str().unwrap().to_owned()).collect();
    assert_eq!(lines, text.lines().collect::<Vec<_>>());
    // What the gateway refuses, and what is no line of a backup.
    for (line, status, part) in
        [("slot 3 t7 200", 1, "refuses 'slot 3 t7 200'"), ("reboot --yes", 2, "line 1 is none of a backup")]
    {
        std::fs::write(&bad, format!("{line}\n")).unwrap();
        let run = clino(&format!("gateway restore {} --yes {port}", bad.display()));
        assert_eq!(run.status, status, "{run:?}");
        assert!(run.stderr.contains(part), "{run:?}");
    }
    for file in [first, other, bad] {
        std::fs::remove_file(file).unwrap();
    }
}

#[test]
fn a_port_without_a_gateway_is_an_error_with_a_next_step() {
    let server = Server::start("--t7 5 --pty");
    let run = clino(&format!("gateway backup --port {}", server.path()));
    assert_eq!((run.status, run.stdout.as_str()), (1, ""), "{run:?}");
    assert!(
        run.stderr.contains("no gateway answers\n  next: check that this is the console's port"),
        "{run:?}"
    );
    let run = clino("gateway backup --json --port /dev/there-is-no-such-port");
    assert_eq!((run.status, &run.objects()[0]["error"]["kind"]), (3, &"port_missing".into()), "{run:?}");
}

/// The object of that name which the console answers to a line.
fn console_says(console: &mut Port, line: &str, what: &str) -> String {
    console.send(format!("{line}\r").as_bytes());
    let begins = format!("{{\"what\":\"{what}\"");
    let deadline = Instant::now() + PATIENCE;
    let mut said = String::new();
    while Instant::now() < deadline {
        said += &String::from_utf8_lossy(&console.read_within(64, Duration::from_millis(20)));
        let whole = said.rfind('\n').map_or("", |end| &said[..end]);
        if let Some(found) = whole.lines().map(str::trim).find(|found| found.starts_with(&begins)) {
            return found.to_owned();
        }
    }
    panic!("{line}: {said}")
}

/// The same operation on sensors that are alike has the same JSON, letter by letter.
#[test]
fn the_json_of_an_operation_is_that_of_the_gateway() {
    let Some(board) = Board::start("the_json_of_an_operation_is_that_of_the_gateway") else { return };
    let server = Server::start("--t7 2,serial=2,angle=-90 --t7 3,serial=3,angle=0.5 --isu 1,angle=90 --pty");
    let [t7, isu] = [0, 1].map(|_| server.path());
    let mut console = Port::open(&board.console);
    console.send(b"\x03json on\r");
    for (port, line, what) in [
        (&t7, "t7 info 3", "identity"),
        (&t7, "t7 damping 3 20 --yes", "changed"),
        (&t7, "t7 damping 3 20 --yes", "unchanged"),
        (&t7, "t7 offset 3 1500 --yes", "changed"),
        (&t7, "t7 direction 3 reversed --yes", "changed"),
        (&t7, "t7 range 3 unidirectional --yes", "changed"),
        (&t7, "t7 address 3 9 --yes", "changed"),
        (&t7, "t7 info 77", "failed"),
        (&isu, "isu info 1", "identity"),
        (&isu, "isu null 1 8192 --yes", "changed"),
        (&isu, "isu address 1 4 --yes", "changed"),
        (&isu, "isu reset 4", "alive"),
        (&isu, "isu repair 4 --yes", "repaired"),
    ] {
        let gateway = console_says(&mut console, line, what);
        let run = clino(&format!("{line} --json --latency 80 --port {port}"));
        let tool = run.stdout.lines().next().unwrap_or_default();
        // The board's module moves, and each has other contents in the words that the document does not name.
        let is_alike = |text: &str| if line == "isu info 1" { without_digits(text) } else { text.to_owned() };
        assert_eq!(is_alike(tool), is_alike(&gateway), "{line}: {run:?}");
    }
}

/// Each number as one sign.
fn without_digits(text: &str) -> String {
    let mut signs: Vec<char> =
        text.chars().map(|sign| if sign.is_ascii_digit() { '#' } else { sign }).collect();
    signs.dedup_by(|later, earlier| *later == '#' && *earlier == '#');
    signs.into_iter().collect()
}

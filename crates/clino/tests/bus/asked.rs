//! A person at a terminal is asked before something is written; a program has to say `--yes`.

use std::fs::File;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use clino_pty::Terminal;
use rustix::process::{Pid, Signal, kill_process};

use super::common::CLINO;
use super::server::{PATIENCE, Server};
use super::{json, on, what};

/// Ctrl-C.
const CTRL_C: &str = "\x03";

/// Runs a command at a terminal, where this is typed when it asks: its status, its results, and what the terminal shows.
fn typed(port: &str, line: &str, answer: &str) -> (Option<i32>, String, String) {
    let mut terminal = Terminal::open(115_200).unwrap();
    let end = || File::options().read(true).write(true).open(terminal.path()).unwrap();
    let line = format!("{line} --latency 80 --port {port}");
    let [stdin, stderr] = [end(), end()];
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::from(stdin))
        .stdout(Stdio::piped())
        .stderr(Stdio::from(stderr))
        .spawn()
        .unwrap();
    let (mut shown, mut is_answered) = (String::new(), false);
    let deadline = Instant::now() + PATIENCE;
    loop {
        let mut buffer = [0; 256];
        let bytes = terminal.read(&mut buffer).unwrap();
        shown += &String::from_utf8_lossy(bytes);
        let is_over = bytes.is_empty() && child.try_wait().unwrap().is_some();
        if !is_answered && shown.ends_with("Go on? y/N ") {
            is_answered = true;
            match answer {
                // As the terminal of a person does it.
                CTRL_C => kill_process(Pid::from_child(&child), Signal::INT).unwrap(),
                answer => terminal.deliver(answer.as_bytes()).unwrap(),
            }
        }
        if is_over {
            break;
        }
        assert!(Instant::now() < deadline, "{line}: {shown}");
        thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap(), shown)
}

#[test]
fn a_no_leaves_the_sensor_as_it_is_and_a_yes_does_not() {
    let server = Server::start("--t7 5 --isu 3,angle=90 --pty");
    let [t7, isu] = [0, 1].map(|_| server.path());
    for answer in ["n\n", "\n", "yess\n", CTRL_C] {
        let (status, results, shown) = typed(&t7, "t7 damping 5 500", answer);
        assert_eq!((status, results.as_str()), (Some(4), ""), "{shown}");
        assert!(shown.contains("T7 5: damping_ms 1000, shall be 500; this writes to its memory"), "{shown}");
        assert!(shown.contains("note: nothing was written"), "{shown}");
    }
    assert_eq!(what(&json(&t7, "t7 info 5").1, "identity")["damping_ms"], 1000);
    let (status, results, shown) = typed(&t7, "t7 damping 5 500", "y\n");
    assert_eq!(
        (status, results.as_str()),
        (Some(0), "changed: damping_ms 500, from 1000, writes 1\n"),
        "{shown}"
    );
    let back = format!("clino t7 damping 5 1000 --port {t7}");
    assert!(shown.contains(&back), "{shown}");
    // The command that is printed puts it back.
    assert_eq!(on(&t7, "t7 damping 5 1000 --yes").status, 0);
    assert_eq!(what(&json(&t7, "t7 info 5").1, "identity")["damping_ms"], 1000);
    // What is so already is not asked about.
    let (status, results, shown) = typed(&t7, "t7 damping 5 1000", "");
    assert_eq!((status, results.as_str()), (Some(0), "unchanged: damping_ms 1000, writes 0\n"), "{shown}");
    for (line, part) in [
        ("isu null 3 8192", "ISU 3: its null position is 0, shall be 8192"),
        ("isu address 3 4", "ISU 3: shall have address 4"),
        ("isu zero 3", "ISU 3: its null position is 0; this writes another"),
        ("isu repair 3", "ISU 3: this writes the checksum"),
    ] {
        let (status, results, shown) = typed(&isu, line, "n\n");
        assert_eq!((status, results.as_str()), (Some(4), ""), "{line}: {shown}");
        assert!(shown.contains(part), "{line}: {shown}");
    }
}

#[test]
fn a_program_that_does_not_say_yes_is_refused_before_the_port_is_opened() {
    for line in [
        "t7 zero 5",
        "t7 offset 5 1",
        "t7 direction 5 reversed",
        "t7 damping 5 500",
        "t7 range 5 unidirectional",
        "t7 baud 5 9600",
        "t7 address 5 6",
        "isu zero 3",
        "isu null 3 1",
        "isu address 3 4",
        "isu repair 3",
        "isu auto-shutoff 3 on --bit 0",
    ] {
        let (status, objects) = json("/dev/there-is-no-such-port", line);
        assert_eq!((status, &objects[0]["error"]["kind"]), (2, &"unconfirmed".into()), "{line}: {objects:?}");
        let run = on("/dev/there-is-no-such-port", line);
        assert_eq!((run.status, run.stdout.as_str()), (2, ""), "{line}: {run:?}");
        assert!(run.stderr.contains("--yes"), "{line}: {run:?}");
    }
}

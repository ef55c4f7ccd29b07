//! The live page in a real browser, with the shipped image behind it: values change within a second, a source that goes takes
//! them away, nothing is asked of another host, axe finds nothing.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use clino_testkit::programs::{Chromium, Node, said, skipped};

use crate::program::Program;
use crate::{folder, free_port};

/// The virtual board in real time.
struct Board(Child);

impl Board {
    /// Starts one; the path of its console.
    fn start(vboard: &str, elf: &str) -> (Board, String) {
        let arguments = ["--elf", elf, "--realtime", "--console-pty", "--duration", "forever"];
        let child = Command::new(vboard)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut board = Board(child.expect("the virtual board starts"));
        let out = board.0.stdout.take().expect("it is piped");
        let mut lines = BufReader::new(out).lines().map_while(Result::ok);
        let console =
            lines.find_map(|line| line.strip_prefix("console ").map(str::to_owned)).expect("a console");
        // Its summary goes to a reader that stays.
        std::thread::spawn(move || lines.for_each(drop));
        (board, console)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_page_of_the_shipped_image_in_a_browser() {
    const TEST: &str = "fleet page in a browser";
    let variable = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
    let (Some(elf), Some(vboard)) = (variable("CLINO_ELF"), variable("CLINO_VBOARD")) else {
        return skipped(TEST, "CLINO_ELF and CLINO_VBOARD name no image and no virtual board");
    };
    let chromium = match Chromium::get(crate::programs()) {
        Ok(chromium) => chromium,
        Err(why) => return skipped(TEST, &why),
    };
    let node = match Node::with(crate::programs(), &["playwright-core@1.65.1", "axe-core@4.14.1"]) {
        Ok(node) => node,
        Err(why) => return skipped(TEST, &why),
    };
    let folder = folder("browser");
    let (board, console) = Board::start(&vboard, &elf);
    let port = free_port();
    let listen = format!("127.0.0.1:{port}");
    let mut serve =
        Program::start(&folder, &["serve", "--port", &console, "--listen", &listen, "--allow-writes"]);
    let address = serve.first_line().replace("127.0.0.1", "localhost");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fleet/browser.js");
    let mut browser = node.command();
    browser.arg(script).arg(&chromium.program).arg(&address).arg(&folder);
    // The board goes when the browser says so.
    let mut child = browser
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("node starts");
    let out = child.stdout.take().expect("it is piped");
    let mut board = Some(board);
    let mut told = Vec::new();
    for line in BufReader::new(out).lines().map_while(Result::ok) {
        if line == "unplug" {
            board = None;
        }
        told.push(line);
    }
    let output = child.wait_with_output().expect("node ends");
    assert!(output.status.success(), "{}\n{}", told.join("\n"), said(&output));
    assert!(board.is_none() && told.last().is_some_and(|last| last == "all well"), "{told:?}");
    if let Some(pictures) = variable("CLINO_PICTURES") {
        for name in ["page-light.png", "page-dark.png", "page-phone.png"] {
            std::fs::copy(folder.join(name), std::path::Path::new(&pictures).join(name))
                .expect("a folder for pictures");
        }
    }
}

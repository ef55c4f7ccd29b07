//! The live page in a real browser, with the shipped image behind it: values change within a second, a source that goes takes
//! them away, nothing is asked of another host, axe finds nothing.

use std::io::{BufRead as _, BufReader};
use std::process::Stdio;

use clino_testkit::programs::{Chromium, Node, said, skipped};

use crate::board::Board;
use crate::gateway::Gateway;
use crate::program::Program;
use crate::{folder, free_port};

/// A browser and what drives it; or a loud skip of this test.
pub fn browser(test: &str) -> Option<(Chromium, Node)> {
    let packages = ["playwright-core@1.65.1", "axe-core@4.14.1"];
    let both = Chromium::get(crate::programs())
        .and_then(|chromium| Ok((chromium, Node::with(crate::programs(), &packages)?)));
    both.map_err(|why| skipped(test, &why)).ok()
}

#[test]
fn the_page_of_the_shipped_image_in_a_browser() {
    const TEST: &str = "fleet page in a browser";
    let Some((board, console)) = Board::console(TEST) else { return };
    let Some((chromium, node)) = browser(TEST) else { return };
    let folder = folder("browser");
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
    if crate::updates() {
        for (picture, name) in [("page-light.png", "fleet-page.png"), ("page-phone.png", "fleet-phone.png")] {
            let place = crate::repository("docs").join(name);
            std::fs::copy(folder.join(picture), place).expect("the repository can be written");
        }
    }
}

/// No sensor, 48 sensors, names that are long, that are HTML, that are in other scripts.
#[test]
fn the_page_takes_any_number_of_sensors_and_any_name() {
    use std::io::Write as _;
    const TEST: &str = "fleet odd page";
    let Some((chromium, node)) = browser(TEST) else { return };
    let folder = folder("odd-page");
    let (empty, full) = (Gateway::new(), Gateway::new());
    let mut names: Vec<String> = (0..48).map(|slot| format!("sensor {slot}")).collect();
    for (slot, name) in [
        "<img src=x onerror=alert(1)>",
        "<script>alert(2)</script>",
        "</span></button><b>bold</b>",
        "&lt;i&gt; \" ' ` ${alert(3)} {{x}}",
        "https://example.org/a",
        "Türme, 塔, برج, 🗼",
    ]
    .into_iter()
    .enumerate()
    {
        names[slot] = name.to_owned();
    }
    names[46] = "long ".repeat(100).trim().to_owned();
    names[47] = "W".repeat(500);
    let port = free_port();
    let mut text = format!("[[gateway]]\nname = \"empty\"\nconsole = \"{}\"\n", empty.endpoint());
    text += &format!("[[gateway]]\nname = \"{}\"\nconsole = \"{}\"\n", "x".repeat(64), full.endpoint());
    text += "[gateway.sensors]\n";
    for (slot, name) in names.iter().enumerate() {
        // A JSON string is a TOML one.
        text += &format!("{slot} = {}\n", serde_json::to_string(name).expect("text"));
    }
    text += &format!("[serve]\nlisten = \"127.0.0.1:{port}\"\n");
    let file = folder.join("serve.toml");
    std::fs::write(&file, text).expect("a folder of this test");
    let mut serve = Program::start(&folder, &["serve", "--config", &file.display().to_string()]);
    let address = serve.first_line().replace("127.0.0.1", "localhost");
    for gateway in [&empty, &full] {
        gateway.wait_for(1);
        gateway.end_line();
    }
    let is_over = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for round in 1.. {
                if is_over.load(std::sync::atomic::Ordering::Relaxed) {
                    return;
                }
                empty.say(r#"{"summary":[],"enabled":0,"online":0,"ok":0}"#);
                for slot in 0..48 {
                    full.angle(slot, &format!("{}.000", round % 90), 1, round);
                }
                std::thread::sleep(std::time::Duration::from_millis(200));
            }
        });
        let mut child = node
            .command()
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fleet/odd.js"))
            .arg(&chromium.program)
            .arg(&address)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("node starts");
        let told = serde_json::to_vec(&names).expect("text");
        child.stdin.take().expect("it is piped").write_all(&told).expect("node reads");
        let output = child.wait_with_output();
        is_over.store(true, std::sync::atomic::Ordering::Relaxed);
        let output = output.expect("node ends");
        assert!(output.status.success(), "{}", said(&output));
    });
}

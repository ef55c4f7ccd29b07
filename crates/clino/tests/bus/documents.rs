//! The commands of `docs/pc.md` print what it shows.

use super::common::CLINO;
use super::server::Server;
use super::{ATTEMPTS, RESYNC};

/// Sensors of each session of the page, by the mark before it.
const SESSIONS: [(&str, &str); 4] = [
    ("first", "--t7 127,angle=12.345,serial=25033 --pty"),
    ("set-up", "--t7 5,angle=12.345 --pty"),
    ("isu", "--isu 3,angle=90 --pty"),
    ("sniff", "--t7 5 --pty"),
];
/// The port that the page names.
const PORT: &str = "/dev/ttyUSB0";

/// The block after a mark: its commands, each with what is shown to follow.
fn session(page: &str, name: &str) -> Vec<(String, String)> {
    let mark = format!("<!-- session: {name} -->\n```console\n");
    let (_, rest) = page.split_once(&mark).unwrap_or_else(|| panic!("{mark} in docs/pc.md"));
    let (block, _) = rest.split_once("```").expect("the end of the block");
    let commands = block.split("$ ").skip(1).map(|text| text.split_once('\n').expect("a line"));
    commands.map(|(command, shown)| (command.to_owned(), shown.to_owned())).collect()
}

#[test]
fn the_page_shows_what_the_tool_prints() {
    let page = include_str!("../../../../docs/pc.md");
    assert_eq!(page.matches("```console").count(), SESSIONS.len(), "a session without a run");
    for (name, sensors) in SESSIONS {
        let commands = session(page, name);
        assert!(!commands.is_empty(), "{name}");
        let mut wrong = String::new();
        // From the beginning, on a computer that was too busy to find a sensor.
        for _ in 0..ATTEMPTS {
            wrong = run(sensors, &commands);
            if wrong.is_empty() {
                break;
            }
            std::thread::sleep(RESYNC);
        }
        assert!(wrong.is_empty(), "docs/pc.md, {name}:\n{wrong}");
    }
}

/// Runs the commands; what they print if that is not what is shown.
fn run(sensors: &str, commands: &[(String, String)]) -> String {
    let server = Server::start(sensors);
    let port = server.path();
    let directory = std::path::Path::new(CLINO).parent().unwrap().display().to_string();
    let path = format!("{directory}:{}", std::env::var("PATH").unwrap());
    for (command, shown) in commands {
        // In one stream, as at a terminal.
        let line = format!("{} 2>&1", command.replace(PORT, &port));
        let output =
            std::process::Command::new("sh").arg("-c").arg(&line).env("PATH", &path).output().unwrap();
        let printed = String::from_utf8(output.stdout).unwrap().replace(&port, PORT);
        if printed.trim_end() != shown.trim_end() {
            return format!("$ {command}\n{printed}");
        }
    }
    String::new()
}

#[test]
fn the_lines_of_the_readme_lead_to_live_angles() {
    let readme = include_str!("../../../../README.md");
    let (_, section) = readme.split_once("## I have sensors and a PC\n").expect("the door");
    let (_, block) = section.split_once("```sh\n").expect("its lines");
    let (block, rest) = block.split_once("```").expect("their end");
    let lines: Vec<&str> = block.lines().collect();
    let [install, ports, watch] = lines[..] else { panic!("three lines, not {lines:?}") };
    let folder = install.strip_prefix("cargo install --path ").expect("the first line installs");
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    assert!(root.join(folder).join("Cargo.toml").exists(), "{folder}");
    assert_eq!(super::clino(ports.strip_prefix("clino ").unwrap()).status, 0);
    let server = Server::start("--t7 127,angle=12.345 --pty");
    let port = server.path();
    let address = "clino t7 address 127 5 --port /dev/ttyUSB0";
    assert!(rest.contains(address), "{rest}");
    let line = watch.replace(PORT, &port).replace("clino", CLINO);
    let output = std::process::Command::new("timeout")
        .args(["-s", "INT", "8"])
        .args(line.split(' '))
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.lines().any(|line| line.starts_with("t7 127") && line.contains("12.345  ok")), "{said}");
    let run =
        super::clino(&format!("{} --yes", address.replace(PORT, &port).strip_prefix("clino ").unwrap()));
    assert!(run.stdout.starts_with("changed: address 5, from 127"), "{run:?}");
}

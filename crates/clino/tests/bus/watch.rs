//! `clino watch` as a person sees it: in a terminal of `tmux`, at two sizes, resized, without colour, with a port that goes and
//! comes back; and its lines.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use clino_testkit::programs::skipped;

use super::common::CLINO;
use super::server::{PATIENCE, Server};

/// A look at the screen.
const LOOK: Duration = Duration::from_millis(200);

/// A terminal with a program in it.
struct Tmux {
    socket: String,
    /// The command line of its program.
    program: String,
}

impl Tmux {
    /// `None`, and a loud word, on a computer without tmux.
    fn start(name: &str, width: u16, height: u16, environment: &[&str], line: &str) -> Option<Self> {
        if Command::new("tmux").arg("-V").output().is_err() {
            skipped(
                name,
                "no tmux on this computer: the screen of clino watch is not tested (apt-get install tmux)",
            );
            return None;
        }
        let socket = format!("clino-{name}-{}", std::process::id());
        let tmux = Self { socket, program: format!("{CLINO} {line}") };
        let environment = environment.join(" ");
        let command = format!("env {environment} {CLINO} {line}; echo ended $?; sleep 60");
        let [width, height] = [width, height].map(|size| size.to_string());
        tmux.run(&["-f", "/dev/null", "new-session", "-d", "-x", &width, "-y", &height, &command]);
        Some(tmux)
    }

    fn run(&self, arguments: &[&str]) -> String {
        let output = Command::new("tmux")
            .args(["-L", &self.socket])
            .args(arguments)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert!(output.status.success(), "tmux {arguments:?}: {output:?}");
        String::from_utf8(output.stdout).unwrap()
    }

    fn resize(&self, width: u16, height: u16) {
        let [width, height] = [width, height].map(|size| size.to_string());
        self.run(&["resize-window", "-x", &width, "-y", &height]);
    }

    fn keys(&self, keys: &str) {
        self.run(&["send-keys", keys]);
    }

    /// The screen, when it is as it should be.
    fn shows(&self, what: &str, is_right: impl Fn(&[&str]) -> bool) -> String {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let screen = self.run(&["capture-pane", "-p"]);
            let lines: Vec<&str> = screen.lines().collect();
            if is_right(&lines) {
                return screen;
            }
            assert!(Instant::now() < deadline, "{what}:\n{screen}");
            thread::sleep(LOOK);
        }
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        let _ = Command::new("tmux").args(["-L", &self.socket, "kill-server"]).output();
        // It ends by itself, and lets go of its port for the next one.
        let begun = Instant::now();
        while runs(&self.program) && begun.elapsed() < PATIENCE {
            thread::sleep(LOOK);
        }
    }
}

fn line<'a>(lines: &[&'a str], begins: &str) -> Option<&'a str> {
    lines.iter().find(|line| line.trim_start().starts_with(begins)).copied()
}

/// Whether the table has the two sensors, one of them silent.
fn has_table(lines: &[&str]) -> bool {
    let words = |begins: &str| {
        line(lines, begins).map(|line| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    };
    let header = words("sensor").is_some_and(|words| words == ["sensor", "angle", "status", "age", "rate/s"]);
    let good = words("> t7 5")
        .is_some_and(|words| words.len() == 8 && words[3] == "12.345" && words[4] == "ok" && words[6] == "s");
    let silent = words("t7 9").is_some_and(|words| words == ["t7", "9", "-", "no_answer", "never", "0.0"]);
    header && good && silent
}

/// Whether the plot, with its frame, is that wide.
fn has_plot(lines: &[&str], sensor: &str, width: usize) -> bool {
    let title = lines.iter().find(|line| line.contains(&format!("{sensor}, degrees")));
    let axis = lines.iter().any(|line| line.contains("-3 min") && line.contains("now"));
    title.is_some_and(|title| title.chars().count() == width) && axis
}

#[test]
fn the_screen_at_two_sizes_and_resized() {
    let server = Server::start("--t7 5,angle=12.345 --t7 6,angle=sine:0:30:4s --pty");
    let port = server.path();
    let command = format!("watch t7 5 6 9 --latency 80 --port {port}");
    for (width, height, other) in [(80, 24, (120, 40)), (120, 40, (80, 24))] {
        let name = format!("the_screen_{width}");
        let Some(tmux) = Tmux::start(&name, width, height, &["LC_ALL=C.UTF-8"], &command) else { return };
        let fits = |width: u16, height: u16| {
            move |lines: &[&str]| {
                lines.len() <= usize::from(height)
                    && has_table(lines)
                    && has_plot(lines, "t7 5", usize::from(width))
                    && lines.last().is_some_and(|last| last.starts_with("q quits"))
            }
        };
        tmux.shows("at the start", fits(width, height));
        tmux.resize(other.0, other.1);
        tmux.shows("resized", fits(other.0, other.1));
        // Too small for a plot: the table stays.
        tmux.resize(60, 8);
        tmux.shows("small", |lines| {
            line(lines, "> t7 5").is_some() && !lines.iter().any(|line| line.contains("degrees"))
        });
        tmux.resize(width, height);
        tmux.keys("Down");
        tmux.shows("the next sensor", |lines| {
            line(lines, "> t7 6").is_some() && has_plot(lines, "t7 6", usize::from(width))
        });
        // A key that comes with a change of the size is not lost.
        for _ in 0..10 {
            tmux.resize(other.0, other.1);
            tmux.keys("Up");
            tmux.shows("back", |lines| line(lines, "> t7 5").is_some());
            tmux.resize(width, height);
            tmux.keys("Down");
            tmux.shows("and forth", |lines| line(lines, "> t7 6").is_some());
        }
        tmux.keys(if width == 80 { "q" } else { "C-c" });
        tmux.shows("the end", |lines| line(lines, "ended 0").is_some() && line(lines, "sensor").is_none());
    }
}

#[test]
fn without_colour_it_says_the_same_and_without_unicode_it_plots_dots() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let command = format!("watch t7 5 9 --latency 80 --port {}", server.path());
    // Foreground colours, as ECMA-48 and xterm have them.
    let has_colour = |text: &str| {
        text.contains("38;5;") || (0..8).any(|colour| text.contains(&format!("\x1b[3{colour}m")))
    };
    let cases = [
        ("colour", "LC_ALL=C.UTF-8", true),
        ("NO_COLOR=1", "LC_ALL=C.UTF-8", false),
        ("NO_COLOR=1", "LC_ALL=C", false),
    ];
    for (number, (colour, locale, expected)) in cases.into_iter().enumerate() {
        let environment = if expected { vec![locale] } else { vec![locale, colour] };
        let Some(tmux) = Tmux::start(&format!("colour_{number}"), 80, 24, &environment, &command) else {
            return;
        };
        tmux.shows("the table", has_table);
        let raw = tmux.run(&["capture-pane", "-p", "-e"]);
        assert_eq!(has_colour(&raw), expected, "{environment:?}: {raw:?}");
        let is_braille = |text: &str| text.chars().any(|sign| ('\u{2801}'..='\u{28FF}').contains(&sign));
        assert_eq!(is_braille(&raw), locale.ends_with("UTF-8"), "{environment:?}: {raw}");
    }
}

/// A name for a port that can lead to another one.
struct Link(PathBuf);

impl Link {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("clino-{name}-{}", std::process::id())))
    }

    fn lead_to(&self, port: &str) {
        let _ = std::fs::remove_file(&self.0);
        std::os::unix::fs::symlink(port, &self.0).unwrap();
    }

    fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_port_that_vanishes_is_opened_again() {
    let link = Link::new("watched");
    let server = Server::start("--t7 5,angle=12.345 --pty");
    link.lead_to(&server.path());
    let command = format!("watch t7 5 --latency 80 --port {}", link.path().display());
    let Some(tmux) = Tmux::start("vanishes", 80, 24, &["LC_ALL=C.UTF-8"], &command) else { return };
    tmux.shows("before", |lines| line(lines, "> t7 5").is_some_and(|line| line.contains("12.345")));
    drop(server);
    tmux.shows("gone", |lines| {
        let row = line(lines, "> t7 5").is_some_and(|line| line.contains(" - ") && line.contains("port_"));
        row && lines.last().is_some_and(|last| last.contains("opened again"))
    });
    let server = Server::start("--t7 5,angle=-7.5 --pty");
    link.lead_to(&server.path());
    tmux.shows("back", |lines| line(lines, "> t7 5").is_some_and(|line| line.contains("-7.500")));
}

/// Whether a process has these words in its command line.
fn runs(words: &str) -> bool {
    let processes = std::fs::read_dir("/proc").unwrap().filter_map(Result::ok);
    let lines = processes.filter_map(|process| std::fs::read(process.path().join("cmdline")).ok());
    lines.map(|line| String::from_utf8_lossy(&line).replace('\0', " ")).any(|line| line.contains(words))
}

/// A connection over SSH that breaks, a window that is closed: the program ends, and does not read the end of its terminal for
/// ever.
#[test]
fn a_terminal_that_goes_takes_the_program_with_it() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let command = format!("watch t7 5 --latency 81 --port {}", server.path());
    let Some(tmux) = Tmux::start("goes", 80, 24, &["LC_ALL=C.UTF-8"], &command) else { return };
    tmux.shows("before", |lines| line(lines, "> t7 5").is_some_and(|line| line.contains("12.345")));
    assert!(runs(&tmux.program));
    tmux.run(&["kill-server"]);
    let begun = Instant::now();
    while runs(&tmux.program) {
        assert!(begun.elapsed() < PATIENCE, "it still runs");
        thread::sleep(LOOK);
    }
}

#[test]
fn lines_for_people_and_objects_for_programs() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let port = server.path();
    let run = |flag: &str| {
        let line = format!("2.5 {CLINO} watch t7 5 9 {flag} --latency 80 --port {port}");
        let output =
            Command::new("timeout").args(["-s", "INT"]).args(line.split_whitespace()).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let plain = run("--plain");
    let rows: Vec<Vec<&str>> = plain.lines().map(|line| line.split_whitespace().collect()).collect();
    assert!(rows.iter().any(|row| row.starts_with(&["t7", "5", "12.345", "ok"])), "{plain}");
    assert!(rows.iter().any(|row| row.starts_with(&["t7", "9", "-", "no_answer", "never"])), "{plain}");
    let objects = run("--json");
    let objects: Vec<serde_json::Value> =
        objects.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of = |address: u8| {
        objects.iter().filter(move |object| object["what"] == "reading" && object["address"] == address)
    };
    assert!(of(5).count() > 5, "{objects:?}");
    assert!(
        of(5).all(|object| object["status"] != "ok" || super::plain(object["angle_deg"].clone()) == 12.345),
        "{objects:?}"
    );
    assert!(
        of(9).all(|object| object["status"] == "no_answer" && object["angle_deg"].is_null()),
        "{objects:?}"
    );
    assert!(of(9).count() > 0, "{objects:?}");
}

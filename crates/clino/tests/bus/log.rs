//! `clino log`: its rows, and what is left of them when it is killed.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use rustix::process::{Pid, Signal, kill_process};

use super::common::CLINO;
use super::server::Server;

/// How often it is killed if `CLINO_LOG_KILLS` says nothing else.
const KILLS: usize = 50;
/// Logs that run side by side.
const SIDE_BY_SIDE: usize = 5;
/// What may be lost, and what a busy computer may take for itself.
const LOST: Duration = Duration::from_millis(1_000);
const BUSY: Duration = Duration::from_millis(500);
const HEADER: &str = "time,kind,address,axis,raw,angle_deg,status,age_ms";

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("clino-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self) -> PathBuf {
        self.0.join("log.csv")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn start(line: &str) -> Log {
    let mut command = Command::new(CLINO);
    command.args(line.split_whitespace()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    Log(command.spawn().unwrap())
}

/// A log that is written: a test that fails leaves none behind, which would open its port for ever.
struct Log(Child);

impl Log {
    fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        // After `end` no process is left to kill.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// How often a file is looked at, and for how long: a busy computer takes its time.
const LOOK: Duration = Duration::from_millis(50);
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until the file says what is waited for.
fn wait_for(file: &Path, what: &str, is_there: impl Fn(&str) -> bool) {
    let began = Instant::now();
    loop {
        let text = fs::read_to_string(file).unwrap_or_default();
        if is_there(&text) {
            return;
        }
        assert!(began.elapsed() < PATIENCE, "{what} did not come: {text}");
        thread::sleep(LOOK);
    }
}

/// Asks it to end, and reads what it said.
fn end(mut log: Log) -> String {
    kill_process(Pid::from_child(&log.0), Signal::INT).unwrap();
    let mut said = String::new();
    log.0.stdout.take().unwrap().read_to_string(&mut said).unwrap();
    log.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(log.0.wait().unwrap().code(), Some(0), "{said}");
    said
}

/// The columns of a row, by their names: restated here.
struct Row {
    time: SystemTime,
    sensor: (String, u8, String),
    raw: String,
    angle: String,
    status: String,
    age: String,
}

fn row(line: &str) -> Row {
    let columns: Vec<&str> = line.split(',').collect();
    let [time, kind, address, axis, raw, angle, status, age] = columns[..] else { panic!("{line}") };
    Row {
        time: humantime_of(time),
        sensor: (kind.to_owned(), address.parse().unwrap(), axis.to_owned()),
        raw: raw.to_owned(),
        angle: angle.to_owned(),
        status: status.to_owned(),
        age: age.to_owned(),
    }
}

/// `2026-11-29T21:52:19.123456Z`, by the days of the civil calendar.
fn humantime_of(text: &str) -> SystemTime {
    let number = |range: std::ops::Range<usize>| text[range].parse::<i64>().unwrap();
    assert!(text.len() == 27 && text.ends_with('Z'), "{text}");
    let (year, month, day) = (number(0..4), number(5..7), number(8..10));
    let is_leap = |year: i64| (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
    let mut days: i64 = (1970..year).map(|year| if is_leap(year) { 366 } else { 365 }).sum();
    let lengths = [31, if is_leap(year) { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    days += lengths[..month as usize - 1].iter().sum::<i64>() + day - 1;
    let seconds = days * 86_400 + number(11..13) * 3_600 + number(14..16) * 60 + number(17..19);
    SystemTime::UNIX_EPOCH
        + Duration::from_secs(seconds as u64)
        + Duration::from_micros(number(20..26) as u64)
}

#[test]
fn rows_have_fixed_columns_and_the_time_of_the_reception() {
    let folder = Folder::new("rows");
    let server = Server::start("--t7 5,angle=-0.255 --isu 3,angle=90 --pty");
    let [t7, isu] = [0, 1].map(|_| server.path());
    let began = SystemTime::now();
    let child = start(&format!("log t7 5 9 --latency 80 --csv {} --port {t7}", folder.file().display()));
    wait_for(&folder.file(), "six values and a sensor that is not there", |text| {
        text.matches(",ok,").count() > 5 && text.contains(",no_answer,")
    });
    end(child);
    let ended = SystemTime::now();
    let text = fs::read_to_string(folder.file()).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(HEADER));
    let rows: Vec<Row> = lines.map(row).collect();
    let mut good = 0;
    for row in &rows {
        assert!((began..=ended).contains(&row.time), "{text}");
        match row.sensor.1 {
            5 if row.status == "ok" => {
                good += 1;
                assert_eq!(
                    (row.raw.as_str(), row.angle.as_str(), row.age.is_empty()),
                    ("-255", "-0.255", false),
                    "{text}"
                );
            }
            _ => assert_eq!((row.raw.as_str(), row.angle.as_str(), row.age.as_str()), ("", "", ""), "{text}"),
        }
        assert_eq!((row.sensor.0.as_str(), row.sensor.2.as_str()), ("t7", "2"));
    }
    assert!(good > 5 && rows.iter().any(|row| row.sensor.1 == 9 && row.status == "no_answer"), "{text}");
    // An ISU, as JSON, at fixed times: the age counts, and is subtracted from the time.
    let file = folder.0.join("log.jsonl");
    let child =
        start(&format!("log isu 3 --every 400 --period 1000 --jsonl {} --port {isu}", file.display()));
    let old = |text: &str| {
        let ages = text.split("\"age_ms\":").skip(1);
        ages.filter_map(|rest| rest.split([',', '}']).next()?.parse::<u64>().ok()).any(|age| age >= 300)
    };
    wait_for(&file, "five values, one of them old", |text| {
        text.matches("\"status\":\"ok\"").count() >= 5 && old(text)
    });
    end(child);
    let text = fs::read_to_string(file).unwrap();
    let objects: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let good: Vec<_> = objects.iter().filter(|object| object["status"] == "ok").collect();
    assert!(good.len() >= 5, "{text}");
    assert!(good.iter().all(|object| object["raw"] == 16_384 && object["axis"].is_null()), "{text}");
    assert!(good.iter().any(|object| object["age_ms"].as_u64().unwrap() >= 300), "{text}");
    // Rows with the same value have the same time, however old it was when they were written.
    let mut times: Vec<_> =
        good.iter().map(|object| humantime_of(object["time"].as_str().unwrap())).collect();
    times.dedup_by(|later, earlier| {
        later.duration_since(*earlier).unwrap_or_default() < Duration::from_millis(5)
    });
    assert!(times.len() < good.len(), "{text}");
}

#[test]
fn an_axis_that_a_single_axis_t7_does_not_have_is_no_zero() {
    let folder = Folder::new("axis");
    let server = Server::start("--t7 5,angle=12.345 --t7 6,model=t7-3,angle0=45 --pty");
    let (file, port) = (folder.file(), server.path());
    let child = start(&format!("log t7 5 6 -a 0 --latency 80 --csv {} --port {port}", file.display()));
    wait_for(&file, "five values of one and five refusals of the other", |text| {
        text.matches(",ok,").count() >= 5 && text.matches(",config_fault,").count() >= 5
    });
    end(child);
    let text = fs::read_to_string(file).unwrap();
    for row in text.lines().skip(1).map(row) {
        let is_ok = row.status == "ok";
        assert!(!is_ok || (row.sensor.1, row.angle.as_str()) == (6, "45.000"), "{text}");
    }
}

#[test]
fn a_port_that_vanishes_is_told_once_and_the_log_goes_on() {
    let folder = Folder::new("vanished");
    let link = folder.0.join("port");
    let lead_to = |port: &str| {
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink(port, &link).unwrap();
    };
    let server = Server::start("--t7 5,angle=1 --pty");
    lead_to(&server.path());
    let child =
        start(&format!("log t7 5 --latency 80 --csv {} --port {}", folder.file().display(), link.display()));
    wait_for(&folder.file(), "an angle", |text| text.contains(",1.000,"));
    drop(server);
    wait_for(&folder.file(), "the port's end", |text| text.contains(",port_"));
    // Long enough that it would be told again if each attempt told it.
    thread::sleep(Duration::from_millis(2_000));
    let server = Server::start("--t7 5,angle=2 --pty");
    lead_to(&server.path());
    wait_for(&folder.file(), "an angle of the port that is back", |text| text.contains(",2.000,"));
    end(child);
    let text = fs::read_to_string(folder.file()).unwrap();
    let rows: Vec<Row> = text.lines().skip(1).map(row).collect();
    let lost = rows.iter().filter(|row| row.status.starts_with("port_")).count();
    assert!((1..=2).contains(&lost), "vanished, then missing: {text}");
    let place = |angle: &str| rows.iter().position(|row| row.angle == angle);
    assert!(place("1.000").unwrap() < place("2.000").unwrap(), "{text}");
}

#[test]
fn what_cannot_be_logged_is_refused() {
    let folder = Folder::new("refused");
    let server = Server::start("--t7 5 --pty");
    let port = server.path();
    let run = |line: &str| super::clino(line);
    fs::write(folder.file(), "a letter\n").unwrap();
    let file = folder.file().display().to_string();
    for (line, status, part) in [
        (format!("log t7 5 --csv {file} --port {port}"), 3, "it is left as it is"),
        (format!("log t7 5 --csv /no/such/folder/log.csv --port {port}"), 3, "next: name another file"),
        (format!("log t7 5 --port {port}"), 2, "--csv"),
        (format!("log t7 5 --csv x --jsonl y --port {port}"), 2, "cannot be used with"),
        (format!("log t7 126 --csv {file}.new --port {port}"), 2, "1-100 or 127"),
        (format!("log isu 15 --csv {file}.new --port {port}"), 2, "1-14"),
        (format!("log isu 3 --baud 9600 --csv {file}.new --port {port}"), 2, "leave --baud out"),
        (format!("log t7 5 --rotate 5 --csv {file}.new --port {port}"), 2, "1k at least"),
        (
            format!("log t7 5 --csv {file}.new --port /dev/there-is-no-such-port"),
            3,
            "next: plug the adapter in",
        ),
    ] {
        let run = run(&line);
        assert_eq!(run.status, status, "{line}: {run:?}");
        assert!(run.stderr.contains(part), "{line}: {run:?}");
    }
    assert_eq!(fs::read_to_string(folder.file()).unwrap(), "a letter\n");
}

/// Numbers that look like chance, the same for a seed.
struct Chance(u64);

impl Chance {
    fn below(&mut self, limit: u64) -> u64 {
        // Knuth's MMIX generator; its upper bits are the good ones.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

#[test]
fn killed_at_any_instant_it_loses_a_second_at_most_and_leaves_no_torn_row() {
    let kills = std::env::var("CLINO_LOG_KILLS").map_or(KILLS, |kills| kills.parse().unwrap());
    let each = kills.div_ceil(SIDE_BY_SIDE);
    thread::scope(|scope| {
        for seed in 0..SIDE_BY_SIDE as u64 {
            scope.spawn(move || killed(seed, each));
        }
    });
}

fn killed(seed: u64, kills: usize) {
    let folder = Folder::new(&format!("killed-{seed}"));
    let server = Server::start("--t7 5,angle=12.345 --t7 6,angle=-7.5 --pty");
    let port = server.path();
    let line = format!("log t7 5 6 --period 20 --latency 80 --csv {} --port {port}", folder.file().display());
    let mut chance = Chance(seed);
    let mut rows_before = 0;
    for kill in 0..kills {
        let mut child = start(&line);
        thread::sleep(Duration::from_millis(150 + chance.below(1_200)));
        let at = SystemTime::now();
        child.kill();
        let text = fs::read_to_string(folder.file()).unwrap();
        // The last row may be torn: the next start cuts it off.
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let rows: Vec<Row> = whole.lines().skip(1).map(row).collect();
        assert!(rows.len() >= rows_before, "kill {kill} of seed {seed}: rows were lost that were there");
        if let Some(last) = rows.last().filter(|_| rows.len() > rows_before) {
            let lost = at.duration_since(last.time).unwrap_or_default();
            assert!(lost <= LOST + BUSY, "kill {kill} of seed {seed}: {lost:?} lost");
        }
        rows_before = rows.len();
    }
    assert!(rows_before > kills, "seed {seed}: {rows_before} rows");
    let child = start(&line);
    wait_for(&folder.file(), "a row after the last kill", |text| text.lines().count() > rows_before + 2);
    end(child);
    let text = fs::read_to_string(folder.file()).unwrap();
    assert!(text.ends_with('\n'));
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(HEADER));
    for line in lines {
        let row = row(line);
        assert!(
            matches!((row.status.as_str(), row.angle.as_str()), ("ok", "12.345" | "-7.500") | (_, "")),
            "{line}"
        );
    }
}

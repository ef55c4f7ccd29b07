//! How fast a stream is decoded. Run it by `checks/throughput.sh`: it means something with the tool of a release only.

mod common;

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use common::{measured, vectors};

const FRAMES: usize = 1_000_000;
/// Frames per second that a release has to reach.
const LIMIT: f64 = 100_000.0;

#[test]
#[ignore = "a measurement, for checks/throughput.sh"]
fn a_million_documented_answers() {
    let mut slow = Vec::new();
    for protocol in ["t7", "isu"] {
        let rate = measure(protocol);
        println!("throughput: {protocol} decode {rate:.0} frames/s (limit {LIMIT:.0})");
        if rate < LIMIT {
            slow.push((protocol, rate));
        }
    }
    assert!(slow.is_empty(), "too slow: {slow:?}");
}

/// Frames per second from a file to a file, start of the process included.
fn measure(protocol: &str) -> f64 {
    let answers: Vec<String> = vectors(protocol)
        .into_iter()
        .filter(|vector| vector["kind"] == "response")
        .map(|vector| vector["hex"].as_str().unwrap().to_owned())
        .collect();
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (from, to) = (directory.join(format!("{protocol}.hex")), directory.join(format!("{protocol}.jsonl")));
    let mut frames = Vec::new();
    for answer in answers.iter().cycle().take(FRAMES) {
        writeln!(frames, "{answer}").unwrap();
    }
    fs::write(&from, frames).unwrap();

    let begin = Instant::now();
    let status = Command::new(measured())
        .args([protocol, "decode", "--stdin"])
        .stdin(Stdio::from(File::open(&from).unwrap()))
        .stdout(Stdio::from(File::create(&to).unwrap()))
        .status()
        .unwrap();
    let seconds = begin.elapsed().as_secs_f64();

    assert!(status.success());
    let lines = fs::read(&to).unwrap().iter().filter(|&&byte| byte == b'\n').count();
    assert_eq!(lines, FRAMES);
    fs::remove_file(from).unwrap();
    fs::remove_file(to).unwrap();
    FRAMES as f64 / seconds
}

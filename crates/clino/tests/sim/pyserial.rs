//! A program that knows nothing of us: `tests/python/angles.py`, on a stock pyserial installed for it.

use std::path::Path;
use std::process::Command;

use clino_testkit::programs::{Python, said};

use super::server::Server;

const PYSERIAL: &str = "pyserial==3.5";
/// Half a step of an ISU's angle, in degrees.
const HALF_STEP: f64 = 180.0 / 65_536.0;

#[test]
fn a_stock_pyserial_script_reads_angles() {
    let server = Server::start("--t7 5,angle=-12.345 --t7 6,angle=99 --isu 3,angle=123.45 --isu 4 --pty");
    let [t7, isu] = [0, 1].map(|_| server.path());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/angles.py");
    let output = python().arg(script).args([&t7, "5", &isu, "3"]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let printed = String::from_utf8(output.stdout).unwrap();
    let angles: Vec<f64> = printed.lines().map(|line| line.parse().unwrap()).collect();
    let [t7, isu] = angles[..] else { panic!("two angles, not {printed:?}") };
    assert_eq!(t7, -12.345);
    assert!((isu - 123.45).abs() <= HALF_STEP, "{isu}");
}

/// A Python that has that pyserial.
fn python() -> Command {
    let python = Python::with(Path::new(env!("CARGO_TARGET_TMPDIR")), &[PYSERIAL]);
    let python = python.unwrap_or_else(|why| {
        panic!(
            "this test needs python3, with venv or pip, and a package index with {PYSERIAL}; without them \
             `clino sim` is not tested\n{why}"
        )
    });
    python.command()
}

//! The scripts in `python/`, with stock pyserial and pymodbus.

use std::path::Path;
use std::sync::OnceLock;

use clino_testkit::programs::{Python, said};

const PACKAGES: [&str; 2] = ["pymodbus==3.16.1", "pyserial==3.5"];

/// Runs a script and returns what it printed; it fails if the script does. The scripts say what they do.
pub fn run(script: &str, arguments: &[&str]) -> String {
    static PYTHON: OnceLock<Result<Python, String>> = OnceLock::new();
    let place = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let python = PYTHON.get_or_init(|| Python::with(place, &PACKAGES)).as_ref().unwrap_or_else(|why| {
        panic!(
            "this test needs python3 (3.10 or later), with venv or pip, and a package index with {PACKAGES:?}; \
             without them stock clients are not tested\n{why}"
        )
    });
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/python").join(script);
    let output = python.command().arg("-B").arg(path).args(arguments).output().expect("Python runs");
    let said = said(&output);
    assert!(output.status.success(), "{script}: {said}");
    println!("{script}: {said}");
    said
}

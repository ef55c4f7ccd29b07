//! A program that knows nothing of us: `tests/python/angles.py`, on a stock pyserial installed for it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::server::Server;

const VERSION: &str = "3.5";
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

/// A Python that has that pyserial; it is installed once, below the target directory.
fn python() -> Command {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("pyserial-{VERSION}"));
    let [venv, packages] = ["venv", "packages"].map(|name| place.join(name));
    if !has_pyserial(&mut in_venv(&venv)) && !has_pyserial(&mut with_packages(&packages)) {
        let in_venv = install_in_venv(&venv);
        let installed =
            in_venv.or_else(|venv| install(&packages).map_err(|packages| format!("{venv}{packages}")));
        if let Err(why) = installed {
            panic!(
                "this test needs python3, with venv or pip, and a package index with pyserial {VERSION}; \
                 without them `clino sim` is not tested\n{why}"
            );
        }
    }
    if has_pyserial(&mut in_venv(&venv)) { in_venv(&venv) } else { with_packages(&packages) }
}

fn in_venv(venv: &Path) -> Command {
    Command::new(venv.join("bin/python"))
}

fn with_packages(packages: &Path) -> Command {
    let mut python = Command::new("python3");
    python.env("PYTHONPATH", packages);
    python
}

fn has_pyserial(python: &mut Command) -> bool {
    let check = format!("import serial; assert serial.VERSION == '{VERSION}'");
    python.args(["-c", &check]).output().is_ok_and(|output| output.status.success())
}

fn install_in_venv(venv: &PathBuf) -> Result<(), String> {
    done(Command::new("python3").args(["-m", "venv", "--clear"]).arg(venv))?;
    done(pip(&mut in_venv(venv)))
}

fn install(packages: &PathBuf) -> Result<(), String> {
    done(pip(&mut Command::new("python3")).arg("--target").arg(packages))
}

fn pip(python: &mut Command) -> &mut Command {
    let package = format!("pyserial=={VERSION}");
    python.args(["-m", "pip", "install", "--disable-pip-version-check", &package])
}

fn done(command: &mut Command) -> Result<(), String> {
    match command.output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(format!("{command:?}: {}\n", said(&output))),
        Err(error) => Err(format!("{command:?}: {error}\n")),
    }
}

fn said(output: &Output) -> String {
    let [stdout, stderr] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{}\n{stdout}{stderr}", output.status)
}

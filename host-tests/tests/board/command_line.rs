//! `vboard`, the program behind `cargo xtask sim`, with the real image. `CLINO_VBOARD` names it.

use std::env;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Output, Stdio};

use clino_host_tests::model;

fn program(variable: &str) -> OsString {
    env::var_os(variable).unwrap_or_else(|| panic!("{variable} is set by `cargo xtask test`"))
}

fn vboard(elf: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(program("CLINO_VBOARD"));
    command
        .arg("--elf")
        .arg(elf)
        .args(["--board", model().name()])
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn an_interrupt_ends_the_run_with_the_summary() {
    let mut child = Command::new(program("CLINO_VBOARD"))
        .arg("--elf")
        .arg(program("CLINO_ELF"))
        .args(["--board", model().name()])
        .args(["--duration", "10000s"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut output = BufReader::new(child.stdout.take().expect("piped"));
    let mut line = String::new();
    for _ in 0..20 {
        line.clear();
        output.read_line(&mut line).expect("lines come");
        assert!(line.starts_with('{'), "{line}");
    }
    let interrupted =
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(interrupted.success());
    let mut rest = String::new();
    output.read_to_string(&mut rest).expect("text");
    assert!(rest.contains("Readings against the truth"), "{rest}");
    assert!(rest.contains("stop bit to DE low"), "{rest}");
    assert_eq!(child.wait().expect("it ends").code(), Some(0), "{rest}");
}

#[test]
fn a_missing_image_says_how_to_build_one() {
    let output = vboard("/nowhere/clino-firmware", &[]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("/nowhere/clino-firmware") && message.contains("cargo xtask sim"), "{message}");
}

#[test]
fn an_image_for_another_machine_is_refused() {
    // This test program is an ELF file for the PC.
    let own = env::current_exe().expect("it runs");
    let output = vboard(&own.to_string_lossy(), &[]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("ARM") || message.contains("32-bit"), "{message}");
}

#[test]
fn a_wrong_scenario_is_refused_with_file_and_line() {
    let path = env::temp_dir().join(format!("clino-wrong-{}.toml", std::process::id()));
    std::fs::write(&path, "seed = 1\nduration = \"5 parsecs\"\n").expect("the folder for temporary files");
    let elf = program("CLINO_ELF");
    let output = vboard(&elf.to_string_lossy(), &["--scenario", &path.to_string_lossy()]);
    std::fs::remove_file(&path).expect("it was written");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains(&format!("{}:2:", path.display())), "{message}");
    assert!(message.contains("expected"), "{message}");
}

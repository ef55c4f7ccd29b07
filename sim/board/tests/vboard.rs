//! The command line of `vboard`: wrong input ends with status 2 and words that help.

use std::path::PathBuf;
use std::process::{Command, Output};

fn vboard(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vboard")).args(arguments).output().unwrap()
}

/// Runs it with wrong input and returns the complaint.
fn refused(arguments: &[&str]) -> String {
    let output = vboard(arguments);
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {complaint}");
    assert!(output.stdout.is_empty());
    complaint
}

fn file(name: &str, contents: &[u8]) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, contents).unwrap();
    path
}

/// The header of a little-endian 32-bit ELF file for another processor.
fn elf_for(machine: u8) -> Vec<u8> {
    let mut header = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0];
    header.resize(16, 0);
    header.extend([2, 0, machine, 0, 1, 0, 0, 0]);
    header.resize(40, 0);
    // Sizes of the ELF header, a program header and a section header; no entries.
    header.extend([52, 0, 32, 0, 0, 0, 40, 0, 0, 0, 0, 0]);
    header
}

#[test]
fn a_wrong_command_line_shows_the_usage() {
    for (arguments, words) in [
        (&[][..], "--elf FILE is missing"),
        (&["--elf"], "--elf needs a value"),
        (&["--elf", "x", "--fast"], "unknown argument `--fast`"),
        (&["--elf", "x", "--duration", "5"], "--duration: `5` is no duration"),
        (&["--elf", "x", "--duration", "0s"], "--duration: 0 s"),
        (&["--elf", "x", "--duration", "ever"], "--duration: `ever` is no duration"),
    ] {
        let complaint = refused(arguments);
        assert!(complaint.contains(words) && complaint.contains("usage: vboard"), "{complaint}");
    }
}

#[test]
fn help_is_no_mistake() {
    let output = vboard(&["--help"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8(output.stdout).unwrap().starts_with("usage: vboard"));
}

#[test]
fn a_missing_or_foreign_image_says_how_to_build_the_right_one() {
    let text = file("text.elf", b"no ELF at all");
    let riscv = file("riscv.elf", &elf_for(0xF3));
    for (path, words) in [
        ("/nowhere/firmware", "/nowhere/firmware: no such file"),
        (text.to_str().unwrap(), "text.elf: not an image"),
        (riscv.to_str().unwrap(), "another processor (ELF machine 243"),
    ] {
        let complaint = refused(&["--elf", path]);
        assert!(complaint.contains(words), "{complaint}");
        assert!(complaint.contains("cargo xtask sim"), "{complaint}");
        let build = "cargo build --release --package clino-firmware --target thumbv7em-none-eabihf";
        assert!(complaint.contains(build), "{complaint}");
    }
}

#[test]
fn a_wrong_scenario_is_named_with_its_line() {
    let scenario = file("wrong.toml", b"seed = 1\n\n[[t7]]\nadress = 3\nmotion.constant = 0\n");
    let path = scenario.to_str().unwrap();
    let complaint = refused(&["--elf", "/nowhere/firmware", "--scenario", path]);
    assert!(
        complaint.contains(&format!("{path}:4: unknown field `adress`, expected one of `address`")),
        "{complaint}"
    );
    let complaint = refused(&["--elf", "/nowhere/firmware", "--scenario", "/nowhere/scenario.toml"]);
    assert!(complaint.contains("/nowhere/scenario.toml: "), "{complaint}");
}

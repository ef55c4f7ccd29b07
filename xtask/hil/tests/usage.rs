//! The command line; what the program does with a board is tested with the image, in `host-tests/tests/clients/hil.rs`.

use std::process::{Command, Output};

fn hil(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_clino-hil")).args(arguments).output().unwrap()
}

#[test]
fn help_names_every_port() {
    let output = hil(&["--help"]);
    assert!(output.status.success());
    let help = String::from_utf8(output.stdout).unwrap();
    for option in
        ["--virtual", "--console", "--t7", "--isu", "--modbus", "--adapter", "--analyser", "--report"]
    {
        assert!(help.contains(option), "{option}: {help}");
    }
}

#[test]
fn a_board_needs_a_console() {
    for arguments in [&[][..], &["--t7", "/dev/ttyUSB0"], &["--virtual", "--console", "/dev/ttyUSB0"]] {
        assert_eq!(hil(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_port_that_is_not_there_is_in_the_report() {
    let report = std::env::temp_dir().join(format!("clino-hil-usage-{}.md", std::process::id()));
    let path = report.to_str().unwrap();
    let output = hil(&["--console", "/dev/there-is-none", "--no-flash", "--report", path]);
    assert_eq!(output.status.code(), Some(2));
    let text = std::fs::read_to_string(&report).unwrap();
    std::fs::remove_file(&report).unwrap();
    assert!(text.contains("broken off") && text.contains("/dev/there-is-none"), "{text}");
}

//! A configuration that is wrong: file, line, key, and what was expected. The exit status is that of bad usage.

use std::process::Command;

use crate::folder;

const CLINO: &str = env!("CARGO_BIN_EXE_clino");
const GATEWAY: &str = "[[gateway]]\nname = \"a\"\nconsole = \"/dev/null\"\n";

#[test]
fn each_error_names_line_key_and_what_was_expected() {
    let folder = folder("configuration");
    let file = folder.join("bridge.toml");
    for (text, parts) in [
        (String::new(), &["[[gateway]]", "at least one"][..]),
        (format!("{GATEWAY}colour = 1"), &["line 4", "colour", "console"]),
        (format!("{GATEWAY}[mqtt]\nhost = 5"), &["line 5", "string"]),
        (format!("{GATEWAY}[mqtt]\nport = 1883"), &["host"]),
        (format!("{GATEWAY}[mqtt]\nhost = \"h\"\nport = 70000"), &["line 6", "70000"]),
        (format!("{GATEWAY}[mqtt]\nhost = \"h\"\ndialect = \"spark\""), &["line 6", "spark", "sparkplug"]),
        (format!("{GATEWAY}[mqtt]\nhost = \"h\"\npassword = \"x\""), &["line 6"]),
        (format!("{GATEWAY}{GATEWAY}"), &["two gateways", "`a`"]),
        (format!("{GATEWAY}modbus = \"tcp://h:502\""), &["only one of"]),
        (format!("{GATEWAY}unit = 3"), &["`unit`", "console"]),
        ("[[gateway]]\nname = \"a\"".into(), &["console", "modbus", "bus"]),
        ("[[gateway]]\nname = \"a/b\"\nconsole = \"/dev/null\"".into(), &["line 2", "a/b", "letters"]),
        ("[[gateway]]\nname = \"a\"\nconsole = \"tcp://host\"".into(), &["line 3", "host:port"]),
        ("[[gateway]]\nname = \"a\"\nconsole = \"http://host:1\"".into(), &["line 3", "serial port"]),
        ("[[gateway]]\nname = \"a\"\nmodbus = \"tcp://h:502\"\nunit = 248".into(), &["248", "1 to 247"]),
        (
            "[[gateway]]\nname = \"a\"\nmodbus = \"tcp://h:502\"\nevery_ms = 5".into(),
            &["`every_ms`", "10 to"],
        ),
        (
            "[[gateway]]\nname = \"a\"\nbus = \"t7\"\nport = \"/dev/null\"\naddresses = [0]".into(),
            &["addresses", "1 to 100"],
        ),
        (
            "[[gateway]]\nname = \"a\"\nbus = \"isu\"\nport = \"/dev/null\"\naddresses = [15]".into(),
            &["addresses", "1 to 14"],
        ),
        (format!("{GATEWAY}[gateway.sensors]\n48 = \"x\""), &["48", "0 to 47"]),
        (format!("{GATEWAY}[serve]\nlisten = \"localhost\""), &["line 5"]),
        (format!("{GATEWAY}[influx]\nto = \"ftp://h\""), &["line 5", "ftp://h"]),
        (format!("{GATEWAY}[prometheus]"), &["listen"]),
        (GATEWAY.to_owned(), &["nothing to feed", "[mqtt]"]),
        (format!("{GATEWAY}x ="), &["line 4"]),
        (
            format!(
                "{GATEWAY}[mqtt]\nhost = \"h\"\nuser = \"u\"\npassword = {{ env = \"CLINO_NOT_SET\" }}\n[store]\nfolder = \"{}\"",
                folder.display()
            ),
            &["CLINO_NOT_SET"],
        ),
        (
            format!(
                "{GATEWAY}[mqtt]\nhost = \"h\"\nca_file = \"/nonexistent/ca.pem\"\n[store]\nfolder = \"{}\"",
                folder.display()
            ),
            &["/nonexistent/ca.pem"],
        ),
    ] {
        std::fs::write(&file, &text).expect("a folder of this test");
        let output =
            Command::new(CLINO).args(["bridge", "--config"]).arg(&file).output().expect("the tool starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}\n{said}");
        for part in parts {
            assert!(said.contains(part), "{text}\nsays {said}\nwithout {part}");
        }
        // What is not of the file says so itself.
        let is_of_file = !parts
            .iter()
            .any(|part| ["CLINO_NOT_SET", "/nonexistent/ca.pem", "nothing to feed"].contains(part));
        assert!(!is_of_file || said.contains("bridge.toml"), "{said}");
    }
}

#[test]
fn the_example_is_a_configuration() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/bridge.example.toml");
    let text = std::fs::read_to_string(example).expect("it is there");
    if let Err(why) = clino_fleet::config::Config::parse(&text) {
        panic!("{why}");
    }
}

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

/// A file with every key that there is, one to a line.
const EVERY_KEY: &str = r#"[[gateway]]
name = "console"
console = "tcp://127.0.0.1:1"
[gateway.sensors]
0 = "Tower"
[[gateway]]
name = "modbus"
modbus = "tcp://127.0.0.1:1"
unit = 1
baud = 19200
parity = "even"
every_ms = 1000
[[gateway]]
name = "bus"
bus = "t7"
port = "/dev/clino-no-such-port"
addresses = [1, 2]
baud = 115200
[serve]
listen = "127.0.0.1:8080"
allow_writes = false
token = { env = "CLINO_TOKEN" }
[mqtt]
host = "localhost"
port = 1883
bridge = "site"
prefix = "clino"
dialect = "json"
user = "clino"
password = { file = "/etc/clino/password" }
tls = true
ca_file = "/etc/clino/ca.pem"
collect_ms = 20
group = "clino"
[mqtt.home_assistant]
prefix = "homeassistant"
every_ms = 1000
[store]
folder = "/var/lib/clino"
most_mb = 1000
[prometheus]
listen = "127.0.0.1:9184"
[influx]
to = "-"
token = { env = "CLINO_TOKEN" }
"#;

/// Keys without which a table means nothing, and what is said of their absence.
const NEEDED: [(&str, &str); 9] = [
    ("name", "`name`"),
    ("console", "`console`"),
    ("modbus", "`modbus`"),
    ("bus", "`bus`"),
    ("port", "`port`"),
    ("addresses", "`addresses`"),
    ("host", "`host`"),
    ("listen", "`listen`"),
    ("to", "`to`"),
];

/// Every line of it damaged in every way: each error has the line and the key, and no secret.
#[test]
fn every_key_that_is_wrong_is_named_with_its_line() {
    use clino_fleet::config::Config;
    if let Err(why) = Config::parse(EVERY_KEY) {
        panic!("{why}");
    }
    let lines: Vec<_> = EVERY_KEY.lines().collect();
    let with = |at: usize, line: Option<String>| {
        let mut lines: Vec<_> = lines.iter().map(|line| (*line).to_owned()).collect();
        match line {
            Some(line) => lines[at] = line,
            None => _ = lines.remove(at),
        }
        Config::parse(&lines.join("\n")).err()
    };
    let (mut renamed, mut retyped, mut absent) = (0, 0, 0);
    for (at, line) in lines.iter().enumerate() {
        let number = format!("line {}", at + 1);
        let Some((key, value)) = line.split_once(" = ") else {
            if line.starts_with("[[") {
                continue;
            }
            // A table that does not exist.
            let name = line.trim_matches(['[', ']']);
            let wrong = format!("[{name}x]");
            let why = with(at, Some(wrong)).unwrap_or_else(|| panic!("{line}: renamed, and no error"));
            // Of `[mqtt]`, its subtable is left, which lacks a key then.
            let is_explained = why.contains("expected") || why.contains("missing field");
            assert!(why.contains("line ") && is_explained, "{line} renamed: {why}");
            continue;
        };
        // A key that does not exist. One of `sensors` is a slot.
        let why = with(at, Some(format!("{key}x = {value}")))
            .unwrap_or_else(|| panic!("{key}: renamed, and no error"));
        assert!(why.contains(&format!("`{key}x`")) && why.contains("expected"), "{key} renamed: {why}");
        assert!(
            why.contains(&number) || NEEDED.iter().any(|(needed, _)| *needed == key),
            "{key} renamed: {why}"
        );
        renamed += 1;
        // A value of another type, or out of its range.
        for wrong in ["1979-05-27", "[[1]]", "-1", "99999999999", "{ hunter2 = 1 }", "\"://hunter2\"", "true"]
        {
            let is_fine = match key {
                "0" | "user" | "host" | "folder" | "ca_file" => wrong.starts_with('"'),
                "port" => wrong.starts_with('"') && value.starts_with('"'),
                "allow_writes" | "tls" => wrong == "true",
                _ => false,
            };
            let Some(why) = with(at, Some(format!("{key} = {wrong}"))) else {
                assert!(is_fine, "{key} = {wrong} is taken");
                continue;
            };
            assert!(why.contains(&number), "{key} = {wrong}: {why}");
            assert!(why.contains(&format!("`{key}`")), "{key} = {wrong}: {why}");
            let is_secret = ["password", "token"].contains(&key);
            assert!(!is_secret || !why.contains("hunter2"), "{key} = {wrong}: {why}");
            retyped += 1;
        }
        // A key that is not there: an error of its table, or its usual value.
        if let Some(why) = with(at, None) {
            let said = NEEDED.iter().find(|(needed, _)| *needed == key).map(|(_, said)| *said);
            assert!(why.contains(said.unwrap_or("?")) && why.contains("line "), "without {key}: {why}");
            absent += 1;
        }
        // A line that is cut off.
        let why =
            with(at, Some(format!("{key} ="))).unwrap_or_else(|| panic!("{key}: cut off, and no error"));
        assert!(why.contains(&number), "{key} cut off: {why}");
    }
    assert!(renamed > 30 && retyped > 200 && absent > 8, "{renamed} {retyped} {absent}");
}

#[test]
fn a_secret_that_is_written_into_the_file_is_refused_and_not_repeated() {
    let folder = folder("secret");
    let file = folder.join("bridge.toml");
    for text in [
        format!("{GATEWAY}[mqtt]\nhost = \"h\"\nuser = \"u\"\npassword = \"hunter2\"\n"),
        format!("{GATEWAY}[mqtt]\nhost = \"h\"\npassword = {{ value = \"hunter2\" }}\n"),
        format!("{GATEWAY}[mqtt]\nhost = \"h\"\npassword = \"hunter2\n"),
        format!("{GATEWAY}[influx]\nto = \"http://h\"\ntoken = \"hunter2\"\n"),
        format!("{GATEWAY}[serve]\ntoken = [\"hunter2\"]\n"),
    ] {
        std::fs::write(&file, &text).expect("a folder of this test");
        let output =
            Command::new(CLINO).args(["bridge", "--config"]).arg(&file).output().expect("the tool starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}\n{said}");
        assert!(said.contains("line ") && !said.contains("hunter2"), "{text}\nsays {said}");
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

//! The README's examples print what it says they print.
#![cfg(unix)]

mod common;

use std::path::Path;
use std::process::Command;

use common::CLINO;

/// Commands of the README's console blocks, each with what is shown to follow.
fn examples() -> Vec<(String, String)> {
    let mut examples: Vec<(String, String)> = Vec::new();
    let mut in_console = false;
    for line in include_str!("../README.md").lines() {
        match line.strip_prefix("$ ") {
            _ if line.starts_with("```") => in_console = line == "```console",
            Some(command) if in_console => examples.push((command.to_owned(), String::new())),
            _ if in_console && !line.is_empty() => {
                let (_, shown) = examples.last_mut().expect("a command comes first");
                shown.push_str(line);
                shown.push('\n');
            }
            _ => {}
        }
    }
    examples
}

#[test]
fn every_example_prints_what_is_shown() {
    let directory = Path::new(CLINO).parent().unwrap();
    let path = format!("{}:{}", directory.display(), std::env::var("PATH").unwrap());
    let examples = examples();
    assert_eq!(examples.len(), 13);
    for (command, shown) in examples {
        let output = Command::new("sh").arg("-c").arg(&command).env("PATH", &path).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stdout), shown, "{command}");
        assert!(output.stderr.is_empty(), "{command}");
    }
}

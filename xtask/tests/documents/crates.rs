//! The picture of the crates, from what cargo knows of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;

use crate::page::{root, settle};

/// What cargo prints.
fn cargo(arguments: &[&str]) -> String {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    let output = cargo.args(arguments).arg("--offline").current_dir(root()).output().expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// What each crate of the workspace depends on, tests left out.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata = cargo(&["metadata", "--format-version", "1", "--no-deps"]);
    let metadata: Value = serde_json::from_str(&metadata).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let name = |package: &Value| package["name"].as_str().expect("a name").to_owned();
    let ours: BTreeSet<String> = packages.iter().map(name).collect();
    let of = |package: &Value| {
        let all = package["dependencies"].as_array().expect("dependencies");
        let normal = all.iter().filter(|dependency| dependency["kind"].is_null());
        normal.map(name).filter(|name| ours.contains(name)).collect()
    };
    packages.iter().map(|package| (name(package), of(package))).collect()
}

/// Everything that a crate depends on, by way of others.
fn reach(of: &BTreeMap<String, BTreeSet<String>>, name: &str) -> BTreeSet<String> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&String> = of[name].iter().flat_map(|direct| &of[direct]).collect();
    while let Some(next) = open.pop() {
        if reached.insert(next.clone()) {
            open.extend(&of[next]);
        }
    }
    reached
}

/// An arrow from each crate to what it depends on; one that others imply is left out.
#[test]
fn the_picture_of_the_crates_is_true() {
    let of = dependencies();
    let mut picture = String::from("```mermaid\ngraph TD\n");
    for (name, direct) in &of {
        let short = |name: &str| name.strip_prefix("clino-").unwrap_or(name).to_owned();
        let implied = reach(&of, name);
        assert!(!implied.contains(name), "{name} depends on itself");
        if direct.is_empty() {
            writeln!(picture, "  {}", short(name)).expect("a string");
        }
        for needed in direct.difference(&implied) {
            writeln!(picture, "  {} --> {}", short(name), short(needed)).expect("a string");
        }
    }
    picture += "```\n";
    settle("architecture.md", "crates", &picture);
}

/// A mistake that both sides share would hide.
#[test]
fn the_simulation_and_the_tests_of_the_image_know_no_crate_of_the_firmware() {
    let allowed = ["sim", "segment", "board", "pty", "testkit", "inspect", "hil", "host-tests"];
    for package in ["clino-sim", "clino-segment", "clino-board", "clino-host-tests"] {
        // With the features that this package asks for, and its tests.
        let tree = cargo(&["tree", "--package", package, "--all-features", "--prefix", "none"]);
        let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
        assert!(names.contains(package), "{tree}");
        let ours = names.iter().filter_map(|name| name.strip_prefix("clino-"));
        for name in ours {
            assert!(allowed.contains(&name), "{package} needs clino-{name}");
        }
    }
}

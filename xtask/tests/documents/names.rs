//! Names of public types: a name that two crates of one user share must say which of the two it is.
//!
//! The test reads the sources: from `lib.rs` it follows `pub mod`, and takes what `pub use` names and what is declared
//! `pub struct`, `enum`, `trait` or `type`. A type that a crate passes on from another crate counts for the other one.
//! The same name in two modules of one crate (`t7::Answer`, `isu::Answer`) is Rust's custom and allowed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::page::root;

/// Crates that one user imports together.
const USERS: [(&str, &[&str]); 3] = [
    (
        "the author of a firmware with these sensors",
        &["crates/codec", "crates/bus", "crates/commissioning", "crates/drivers"],
    ),
    (
        "the gateway's firmware",
        &[
            "crates/codec",
            "crates/bus",
            "crates/commissioning",
            "crates/gateway",
            "crates/modbus",
            "crates/console",
            "crates/recovery",
            "crates/storage",
        ],
    ),
    ("a host test", &["sim/sensors", "sim/segment", "sim/board", "crates/testkit", "crates/pty"]),
];

/// Names that may occur twice, and why.
const ALLOWED: [(&str, &str); 11] = [
    ("Bench", "`rig::Bench` is the bus code on a segment; the board's is the set-up of a scenario"),
    (
        "Command",
        "of a sensor: `t7::Command`, `isu::Command`, the documents' word; of Modbus: the command register",
    ),
    ("Entry", "of the trace and of the register map; each is used under the name of its module"),
    ("Fault", "commissioning's `t7::Fault` and `isu::Fault` are the bus's `Fault` for one protocol"),
    ("Form", "of a setting and of a register; each is used under the name of its module"),
    (
        "Host",
        "what Modbus and the console need of the firmware, which implements both under their crates' names",
    ),
    ("Node", "a simulated sensor; Node.js"),
    ("Refusal", "of an order and of a Modbus write; each is used under the name of its module"),
    ("Settings", "of the gateway and of the Modbus port; `clino_modbus::Settings` is always written so"),
    ("Status", "`t7::Status` is the status byte of the T7's document"),
    ("Terminal", "of the board's scenario and of the pseudo-terminal; the crates are about to merge"),
];

/// A source without its comments.
fn code(path: &Path) -> String {
    let source = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let lines = source.lines().map(|line| line.split("//").next().unwrap_or(""));
    lines.fold(String::new(), |code, line| code + line + "\n")
}

/// Whether this is the name of a type: a capital first, and not a constant. `T7` is a type.
fn is_type(word: &str) -> bool {
    word.starts_with(|first: char| first.is_ascii_uppercase())
        && (word.contains(|letter: char| letter.is_ascii_lowercase()) || word == "T7")
}

fn word(text: &str) -> &str {
    let end = text.find(|it: char| !it.is_alphanumeric() && it != '_').unwrap_or(text.len());
    text.get(..end).unwrap_or(text)
}

/// The types that `path`, a module whose submodules are in `folder`, makes public.
fn types(path: &Path, folder: &Path, found: &mut BTreeSet<String>) {
    let code = code(path);
    for statement in code.split("\npub ").skip(1) {
        let Some((keyword, rest)) = statement.split_once(' ') else { continue };
        match keyword {
            "struct" | "enum" | "trait" | "type" | "union" => _ = found.insert(word(rest).to_owned()),
            "use" if !rest.starts_with("clino_") => {
                let names = rest.split(';').next().unwrap_or("");
                // The last name of each path; the new one of `as`.
                let paths = names.split(['{', '}', ',']).map(str::trim);
                let last = paths.map(|path| path.rsplit([':', ' ']).next().unwrap_or(path));
                found.extend(last.filter(|name| is_type(name)).map(str::to_owned));
            }
            "mod" if rest.get(word(rest).len()..).is_some_and(|rest| rest.starts_with(';')) => {
                let inside = folder.join(word(rest));
                let file = inside.with_extension("rs");
                let file = if file.exists() { file } else { inside.join("mod.rs") };
                types(&file, &inside, found);
            }
            _ => {}
        }
    }
}

/// The crates of `users` that have a type of each name, if there is more than one.
fn doubles(crates: &[&str]) -> BTreeMap<String, Vec<String>> {
    let mut owners: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for name in crates {
        let folder = root().join(name).join("src");
        let mut found = BTreeSet::new();
        types(&folder.join("lib.rs"), &folder, &mut found);
        assert!(!found.is_empty(), "no public type in {name}: does this test still read its sources?");
        found.into_iter().for_each(|found| owners.entry(found).or_default().push((*name).to_owned()));
    }
    owners.retain(|_, crates| crates.len() > 1);
    owners
}

#[test]
fn a_public_type_says_which_it_is() {
    let mut unnamed = Vec::new();
    for (user, crates) in USERS {
        for (name, owners) in doubles(crates) {
            if !ALLOWED.iter().any(|(allowed, _)| *allowed == name) {
                unnamed.push(format!("{user}: `{name}` of {}", owners.join(" and ")));
            }
        }
    }
    assert!(unnamed.is_empty(), "give them names that say which:\n{}", unnamed.join("\n"));
}

#[test]
fn no_exception_outlives_its_reason() {
    let doubles: BTreeSet<String> =
        USERS.iter().flat_map(|(_, crates)| doubles(crates).into_keys()).collect();
    for (name, reason) in ALLOWED {
        assert!(doubles.contains(name), "`{name}` ({reason}) occurs once: remove the exception");
    }
}

/// The reader of sources finds what it has to find.
#[test]
fn public_types_are_found() {
    let mut found = BTreeSet::new();
    let folder = root().join("crates/codec/src");
    types(&folder.join("lib.rs"), &folder, &mut found);
    // In a public module; passed on by one; passed on by the root; private to the crate.
    for (name, is_public) in
        [("Angle", true), ("PlannedWrite", true), ("DecodeProgress", true), ("Stream", false)]
    {
        assert_eq!(found.contains(name), is_public, "{name}");
    }
    assert!(!found.contains("MAX_FRAME"), "a constant");
}

//! The list of panics against those found, and what is left of a path.

use std::collections::BTreeMap;

use clino_inspect::annotations::Pattern;
use clino_inspect::panics::{Site, compare, listed};
use clino_inspect::source::package;

fn found(files: &[&str]) -> BTreeMap<String, Vec<Site>> {
    let site = Site { entry: "panic".to_owned(), function: "work".to_owned(), line: 7 };
    files.iter().map(|file| ((*file).to_owned(), vec![site.clone()])).collect()
}

#[test]
fn a_panic_that_is_not_listed_is_told_and_one_that_is_gone() {
    let list = listed("| in | what | why |\n|---|---|---|\n| `a.rs` | index | short |\n").expect("a list");
    assert!(compare(&found(&["a.rs"]), &list).is_empty());
    let more = compare(&found(&["a.rs", "b.rs"]), &list);
    assert_eq!(more, ["not listed: panics from b.rs\n  panic at line 7 in work"]);
    assert_eq!(compare(&found(&[]), &list), ["no panic comes from a.rs any more"]);
}

#[test]
fn a_list_needs_a_reason_in_each_line() {
    assert!(listed("| `a.rs` | index |  |\n").is_err());
    assert!(listed("| `a.rs` | index |\n").is_err());
    assert!(listed("| `a.rs` | x | y |\n| `a.rs` | x | y |\n").is_err());
}

#[test]
fn a_path_begins_with_its_package() {
    let cases = [
        ("/rustc/0123abc/library/core/src/cell.rs", "library/core/src/cell.rs"),
        ("/some/where/registry/src/index-0123/heapless-0.9.1/src/spsc.rs", "heapless/src/spsc.rs"),
        ("/some/where/crates/storage/src/pages.rs", "crates/storage/src/pages.rs"),
        ("/some/where/src/bus.rs", "src/bus.rs"),
        ("src/bus.rs", "src/bus.rs"),
    ];
    for (path, expected) in cases {
        assert_eq!(package(path), expected, "{path}");
    }
}

#[test]
fn a_star_stands_for_anything() {
    let matches = |pattern: &str, name: &str| Pattern(pattern.to_owned()).matches(name);
    assert!(matches("a::b", "a::b") && !matches("a::b", "a::bc") && !matches("a::b", "xa::b"));
    assert!(matches("a::*", "a::b::c") && matches("*::c", "a::b::c") && matches("a*c", "a::b::c"));
    assert!(!matches("a*b*c", "a::c") && !matches("aa*aa", "aaa"));
}

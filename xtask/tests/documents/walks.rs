//! The walks through the house in `docs/architecture.md`: every step is a file that is there, and none comes twice.

use std::collections::BTreeSet;
use std::fs;

use crate::page::root;

/// Most steps of a walk: it is one that a reader can keep in mind.
const WALKS: [(&str, usize); 3] = [("byte", 15), ("key", 6), ("edge", 9)];

/// The files of a walk, in its order.
fn steps(page: &str, walk: &str) -> Vec<String> {
    let (_, rest) = page.split_once(&format!("<!-- begin walk {walk} -->")).expect("the walk");
    let (list, _) = rest.split_once("<!-- end -->").expect("its end");
    let mut files = Vec::new();
    for (number, line) in
        (1..).zip(list.lines().filter(|line| line.starts_with(|it: char| it.is_ascii_digit())))
    {
        let rest =
            line.strip_prefix(&format!("{number}. `")).unwrap_or_else(|| panic!("step {number}: {line}"));
        let (file, what) = rest.split_once("`: ").unwrap_or_else(|| panic!("no file and its task: {line}"));
        assert!(what.len() > 10, "{line}");
        files.push(file.to_owned());
    }
    files
}

/// A file does one thing in a walk: it comes once.
fn twice(files: &[String]) -> Option<&String> {
    let mut seen = BTreeSet::new();
    files.iter().find(|file| !seen.insert(*file))
}

#[test]
fn walks_go_on_and_do_not_come_back() {
    let page = fs::read_to_string(root().join("docs/architecture.md")).expect("a page");
    for (walk, most) in WALKS {
        let files = steps(&page, walk);
        assert!((4..=most).contains(&files.len()), "{walk}: {} steps", files.len());
        assert_eq!(twice(&files), None, "{walk}");
        for file in &files {
            let source =
                fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
            assert!(source.starts_with("//! "), "{file} does not say what it is");
        }
    }
}

#[test]
fn a_file_that_comes_twice_is_found() {
    let files = ["a.rs", "b.rs", "a.rs"].map(str::to_owned);
    assert_eq!(twice(&files), Some(&files[2]));
    assert_eq!(twice(&files[..2]), None);
}

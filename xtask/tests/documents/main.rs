//! The documents: how long the README is, whether links lead somewhere, whether the book has every page, whether every
//! transcript comes from a run, and the parts of `docs/architecture.md` that are made from the sources.
//!
//! `UPDATE=1 cargo test -p xtask --test documents` writes the parts that are made from the sources.

mod crates;
mod files;
mod glossary;
mod language;
mod levels;
mod links;
mod names;
mod page;
mod peripherals;
mod published;
mod walks;

use std::collections::BTreeSet;
use std::fs;

use page::{docs, root};

/// `wc -w` of the README, at most.
const MOST_WORDS: usize = 700;

#[test]
fn the_readme_is_short() {
    let words = fs::read_to_string(root().join("README.md")).expect("README").split_whitespace().count();
    assert!(
        words <= MOST_WORDS,
        "README.md has {words} words, {MOST_WORDS} are allowed: move some to a page of docs/"
    );
}

/// What a newcomer types first stands alone, near the top.
#[test]
fn the_readme_begins_with_two_commands() {
    let readme = fs::read_to_string(root().join("README.md")).expect("README");
    let blocks: Vec<&str> =
        readme.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(blocks[..2], ["cargo xtask sim\n", "cargo xtask test\n"]);
    let line = readme.lines().position(|line| line == "cargo xtask test").expect("the second command");
    assert!(line < 25, "in line {line}");
}

#[test]
fn the_book_has_every_page() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("the summary");
    let in_book: BTreeSet<String> = links::targets(&summary).into_iter().collect();
    for page in docs() {
        let name = page.file_name().and_then(|name| name.to_str()).expect("a name").to_owned();
        assert!(name == "SUMMARY.md" || in_book.contains(&name), "docs/{name} is not in docs/SUMMARY.md");
    }
}

/// A block that shows a console or its stream is marked with the scenario that makes it; see
/// `host-tests/tests/board/transcripts.rs`, which compares the two.
#[test]
fn every_transcript_comes_from_a_run() {
    for path in docs().into_iter().chain([root().join("README.md")]) {
        let text = fs::read_to_string(&path).expect("a page");
        for block in page::blocks(&text) {
            let is_transcript = block.text.contains("clino> ") || block.text.trim_start().starts_with("{\"");
            let is_marked = block.before.starts_with("<!-- transcript: ");
            let (path, line) = (path.display(), block.line);
            assert!(
                is_marked || !is_transcript,
                "{path}, line {line}: no `<!-- transcript: NAME -->` before it"
            );
            assert!(is_transcript || !is_marked, "{path}, line {line}: a mark before what is no transcript");
        }
    }
}

//! The glossary: in order, without a word that the project does not use, and with every pointer at an entry.

use std::fs;
use std::path::{Path, PathBuf};

use crate::page::root;

/// Words and meanings, from the rows of the table.
fn rows(page: &str) -> Vec<(String, String)> {
    let rows = page.lines().filter(|line| line.starts_with("| ")).skip(1);
    let cells = rows.map(|row| row.trim_matches('|').split_once(" | ").expect("two cells"));
    cells.map(|(word, meaning)| (word.trim().to_owned(), meaning.trim().to_owned())).collect()
}

fn glossary() -> Vec<(String, String)> {
    let rows = rows(&fs::read_to_string(root().join("docs/glossary.md")).expect("the glossary"));
    assert!(rows.len() > 50, "{} rows: does this test still read the table?", rows.len());
    rows
}

fn texts(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let is_text = path.extension().is_some_and(|is| is == "rs" || is == "md");
        match path.is_dir() {
            true if path.ends_with("target") || path.is_symlink() => {}
            true => texts(&path, found),
            false if is_text && !path.ends_with("glossary.md") => found.push(path),
            false => {}
        }
    }
}

/// Letters and digits in lower case, anything else a blank, so that `SingleDevice`, `single_device` and "single device"
/// are the same. A line of a comment goes on in the next.
fn plain(text: &str) -> String {
    let mut plain = String::from(" ");
    let mut before = ' ';
    for letter in text.chars() {
        if letter.is_uppercase() && before.is_lowercase() && !plain.ends_with(' ') {
            plain.push(' ');
        }
        match letter.is_alphanumeric() {
            true => plain.extend(letter.to_lowercase()),
            false if !plain.ends_with(' ') => plain.push(' '),
            false => {}
        }
        before = letter;
    }
    plain.push(' ');
    plain
}

#[test]
fn the_glossary_is_in_order() {
    let words: Vec<String> = glossary().into_iter().map(|(word, _)| word.to_lowercase()).collect();
    for pair in words.windows(2) {
        assert!(pair[0] < pair[1], "`{}` stands before `{}`", pair[0], pair[1]);
    }
}

#[test]
fn every_word_of_the_glossary_is_used() {
    let mut files = Vec::new();
    for folder in ["docs", "crates", "src", "host-tests/tests"] {
        texts(&root().join(folder), &mut files);
    }
    let text: String = files.iter().map(|path| plain(&fs::read_to_string(path).expect("a text"))).collect();
    let (mut unused, mut count) = (Vec::new(), 0);
    for word in glossary().iter().flat_map(|(word, _)| word.split(", ")) {
        count += 1;
        if !text.contains(&plain(word)) {
            unused.push(word.to_owned());
        }
    }
    assert!(count > 50 && unused.is_empty(), "in the glossary, and nowhere else: {unused:?}");
}

#[test]
fn every_pointer_leads_to_an_entry() {
    let rows = glossary();
    let words: Vec<&str> = rows.iter().flat_map(|(word, _)| word.split(", ")).collect();
    for (word, meaning) in &rows {
        let prose: String = meaning.split('`').step_by(2).collect();
        for pointer in prose.split('*').skip(1).step_by(2) {
            let known =
                words.iter().any(|entry| pointer == *entry || pointer.strip_suffix('s') == Some(entry));
            assert!(known || OTHERS.contains(&pointer), "`{word}` points to `{pointer}`, which is no entry");
        }
    }
}

/// Words in italics that are not of this project.
const OTHERS: [&str; 6] = ["response", "command", "driver enable", "ok", "gateway core", "probed"];

#[test]
fn names_and_words_are_the_same() {
    assert_eq!(plain("SingleDevice"), " single device ");
    assert_eq!(plain("node_history, DE"), " node history de ");
    assert_eq!(plain("outstanding\n    /// reply"), " outstanding reply ");
}

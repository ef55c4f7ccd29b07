//! Plain sentences: words that hide who acts are counted in every text of the repository.
//!
//! "Nobody" and "somebody" are a node, a task, a user: the text says which. "So many" is a number: the text says how many
//! of what.

use std::fs;
use std::path::{Path, PathBuf};

use crate::page::root;

const WORDS: [&str; 3] = ["nobody", "somebody", "so many"];

/// Text that a person of this project writes.
const TEXT: [&str; 7] = ["rs", "md", "toml", "py", "sh", "js", "machine"];

/// Folders of what is built, and of what others have written.
const SKIPPED: [&str; 4] = ["target", "node_modules", ".git", "book"];

fn texts(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let is = |names: &[&str], part: Option<&std::ffi::OsStr>| {
            part.and_then(|part| part.to_str()).is_some_and(|part| names.contains(&part))
        };
        if path.is_symlink() {
            continue;
        }
        match path.is_dir() {
            true if is(&SKIPPED, path.file_name()) => {}
            true => texts(&path, found),
            // This file names the words.
            false if path.ends_with("documents/language.rs") => {}
            false if is(&TEXT, path.extension()) => found.push(path),
            false => {}
        }
    }
    found.sort();
}

/// How often the words occur. A sentence may go on in the next line of a comment, a word may be part of a name.
fn count(text: &str) -> usize {
    let joined = text.lines().map(|line| line.trim_start().trim_start_matches(['/', '!', '#', '*', ' ']));
    let joined: String = joined.flat_map(|line| [line, " "]).collect::<String>().to_lowercase();
    WORDS.iter().map(|word| joined.matches(word).count()).sum()
}

#[test]
fn words_that_hide_who_acts_do_not_come_back() {
    let mut files = Vec::new();
    texts(root(), &mut files);
    assert!(files.len() > 500, "{} texts: does this test still find them?", files.len());
    let mut found = Vec::new();
    for path in files {
        let count = count(&fs::read_to_string(&path).expect("a text"));
        if count > 0 {
            found.push(format!("{}: {count}", path.strip_prefix(root()).expect("below the root").display()));
        }
    }
    assert!(found.is_empty(), "{WORDS:?}, say which node, task or user:\n{}", found.join("\n"));
}

#[test]
fn words_are_counted_across_lines_and_inside_names() {
    let text =
        "/// Nobody answers, and so\n/// many bytes are lost.\nfn somebody_answers() {}\n// Nothing else.\n";
    assert_eq!(count(text), 3);
}

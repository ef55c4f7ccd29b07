//! Pages, their blocks of code, and the parts of them that are generated.

use std::fs::{self, File};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

/// The folder of the repository.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The pages below `docs`.
pub fn docs() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("docs")).expect("docs");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut pages: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|is| is == "md")).collect();
    pages.sort();
    pages
}

/// A fenced block.
pub struct Block<'a> {
    /// The line before its fence that is not empty.
    pub before: &'a str,
    /// The line of its fence, from 1 on.
    pub line: usize,
    pub text: String,
}

/// The fenced blocks of a page.
pub fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut blocks: Vec<Block<'_>> = Vec::new();
    let (mut before, mut is_code) = ("", false);
    for (line, text) in page.lines().enumerate() {
        if text.trim_start().starts_with("```") {
            is_code = !is_code;
            if is_code {
                blocks.push(Block { before, line: line + 1, text: String::new() });
            }
        } else if let (true, Some(block)) = (is_code, blocks.last_mut()) {
            block.text += text;
            block.text.push('\n');
        }
        if !text.trim().is_empty() {
            before = text;
        }
    }
    blocks
}

/// Compares what stands between `<!-- begin NAME -->` and `<!-- end -->` in a page below `docs`, or writes it.
pub fn settle(page: &str, name: &str, fresh: &str) {
    // Several tests may write one page.
    let mut file =
        File::options().read(true).write(true).open(root().join("docs").join(page)).expect("a page");
    file.lock().expect("a lock");
    let mut text = String::new();
    file.read_to_string(&mut text).expect("text");
    let begin = format!("<!-- begin {name} -->\n");
    let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("{begin} in docs/{page}"));
    let (found, after) = rest.split_once("<!-- end -->").expect("the end of it");
    if found.trim() == fresh.trim() {
        return;
    }
    let update = std::env::var_os("UPDATE").is_some();
    assert!(
        update,
        "docs/{page}, {name}: UPDATE=1 cargo test -p xtask --test documents writes it anew:\n{fresh}"
    );
    let text = format!("{before}{begin}\n{}\n\n<!-- end -->{after}", fresh.trim());
    file.rewind().and_then(|()| file.set_len(0)).expect("an empty file");
    file.write_all(text.as_bytes()).expect("it is written");
}

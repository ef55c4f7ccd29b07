//! `cargo xtask book`: the documents as a book, with mdBook.
//!
//! mdBook reads one folder, and a page links to what is in it. So the pages are copied below `target/book-source`, those of
//! the root among them, and links are made to fit: one to a page leads to its copy, one to a source file becomes its text.

use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;

use crate::command::{self, Failure, Outcome};

/// Pages beside `docs`.
const OF_THE_ROOT: [&str; 3] = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"];

/// Builds the book; installs mdBook if it is missing.
pub fn run() -> Outcome {
    if !is_there() {
        eprintln!("mdbook is not installed: installing it, once, with `cargo install mdbook --locked`");
        command::run(command::cargo(["install", "mdbook", "--locked"]))?;
    }
    build()
}

/// Builds the book if mdBook is installed.
pub fn check() -> Outcome {
    if is_there() {
        return build();
    }
    eprintln!("SKIPPED: the book is not built, mdbook is not installed; `cargo xtask book` installs it");
    Ok(())
}

fn is_there() -> bool {
    command::output_of("mdbook", &["--version"]).is_some()
}

fn build() -> Outcome {
    let (source, book) = (command::target_dir().join("book-source"), command::target_dir().join("book"));
    let failed = |error: io::Error| Failure::new(format!("{}: {error}", source.display()));
    copy(&command::root(), &source).map_err(failed)?;
    let mut mdbook = Command::new("mdbook");
    mdbook.arg("build").arg(&source).arg("--dest-dir").arg(&book);
    command::run(mdbook)?;
    println!("{}", book.join("index.html").display());
    Ok(())
}

/// Copies all pages, and what they show, below `source`.
fn copy(root: &Path, source: &Path) -> io::Result<()> {
    if source.exists() {
        fs::remove_dir_all(source)?;
    }
    let pages = source.join("src");
    fs::create_dir_all(&pages)?;
    for entry in fs::read_dir(root.join("docs"))? {
        let from = entry?.path();
        let Some(name) = from.file_name().and_then(|name| name.to_str()) else { continue };
        if name == "book.toml" {
            fs::copy(&from, source.join(name))?;
        } else if name.ends_with(".md") {
            fs::write(pages.join(name), fitted(&fs::read_to_string(&from)?, "docs/"))?;
        } else {
            fs::copy(&from, pages.join(name))?;
        }
    }
    for name in OF_THE_ROOT {
        fs::write(pages.join(name), fitted(&fs::read_to_string(root.join(name))?, ""))?;
    }
    Ok(())
}

/// A page of this folder with links that fit the book.
fn fitted(page: &str, folder: &str) -> String {
    let mut fitted = String::new();
    let mut is_code = false;
    for line in page.split_inclusive('\n') {
        is_code ^= line.trim_start().starts_with("```");
        if is_code {
            fitted += line;
        } else {
            fit_line(line, folder, &mut fitted);
        }
    }
    fitted
}

fn fit_line(line: &str, folder: &str, fitted: &mut String) {
    let mut rest = line;
    while let Some((before, behind)) = rest.split_once("](") {
        let Some((target, after)) = behind.split_once(')') else { break };
        match place(target, folder) {
            Some(place) => *fitted += &format!("{before}]({place})"),
            // The link's text, without its bracket.
            None => match before.rsplit_once('[') {
                Some((before, text)) => *fitted += &format!("{before}{text}"),
                None => *fitted += before,
            },
        }
        rest = after;
    }
    *fitted += rest;
}

/// Where a link of a page leads to in the book, if it leads anywhere.
fn place(target: &str, folder: &str) -> Option<String> {
    if target.starts_with('#') || target.contains("://") {
        return Some(target.to_owned());
    }
    // From the root of the repository on.
    let path = match target.strip_prefix("../") {
        Some(path) => path.to_owned(),
        None => format!("{folder}{target}"),
    };
    let (file, _) = path.split_once('#').unwrap_or((&path, ""));
    match path.strip_prefix("docs/") {
        // It is the book's own list of pages, and no page.
        Some("SUMMARY.md") => None,
        Some(place) => Some(place.to_owned()),
        None if OF_THE_ROOT.contains(&file) => Some(path),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_pages_of_the_book_and_nowhere_else() {
        for (folder, page, expected) in [
            ("", "see [a](docs/a.md#b) and ![b](docs/b.svg).\n", "see [a](a.md#b) and ![b](b.svg).\n"),
            ("", "[how](CONTRIBUTING.md), [law](LICENSE-MIT)", "[how](CONTRIBUTING.md), law"),
            ("", "in [this order](docs/SUMMARY.md)", "in this order"),
            (
                "docs/",
                "[a](a.md), [top](../README.md#x), [`src/b.rs`](../src/b.rs)",
                "[a](a.md), [top](README.md#x), `src/b.rs`",
            ),
            (
                "docs/",
                "[here](#x) [there](https://example.org/a)",
                "[here](#x) [there](https://example.org/a)",
            ),
            ("docs/", "```text\n[a](../b)\n```\n", "```text\n[a](../b)\n```\n"),
        ] {
            assert_eq!(fitted(page, folder), expected);
        }
    }
}

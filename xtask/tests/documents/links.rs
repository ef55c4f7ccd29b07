//! Links lead to files that are there, and to headings that are there.

use std::fs;
use std::path::Path;

use crate::page::{docs, root};

/// The targets of a page's links, code left out.
pub fn targets(page: &str) -> Vec<String> {
    let mut is_code = false;
    let mut targets = Vec::new();
    for line in page.lines() {
        is_code ^= line.trim_start().starts_with("```");
        if !is_code {
            let links = line.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
            targets.extend(links.map(|(target, _)| target.to_owned()));
        }
    }
    targets
}

/// What a heading is called in a link, as code hosts and mdBook have it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|it| it.is_alphanumeric() || matches!(it, ' ' | '-' | '_'));
    kept.map(|it| if it == ' ' { '-' } else { it.to_ascii_lowercase() }).collect()
}

fn anchors(page: &str) -> Vec<String> {
    let mut is_code = false;
    let mut anchors = Vec::new();
    for line in page.lines() {
        is_code ^= line.trim_start().starts_with("```");
        if let (false, Some(heading)) = (is_code, line.strip_prefix('#')) {
            anchors.push(anchor(heading.trim_start_matches('#')));
        }
    }
    anchors
}

/// What is wrong with a link of a page, if anything is.
fn fault(page: &Path, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, heading) = target.split_once('#').unwrap_or((target, ""));
    let path = match file {
        "" => page.to_owned(),
        file => page.parent().expect("a folder").join(file),
    };
    if !path.exists() {
        return Some("there is no such file".into());
    }
    if heading.is_empty() {
        return None;
    }
    let text = fs::read_to_string(&path).expect("a page");
    (!anchors(&text).iter().any(|anchor| anchor == heading)).then(|| "there is no such heading".into())
}

#[test]
fn every_link_leads_somewhere() {
    let of_root = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    let mut wrong = Vec::new();
    let mut links = 0;
    for page in docs().into_iter().chain(of_root) {
        for target in targets(&fs::read_to_string(&page).expect("a page")) {
            links += 1;
            let fault = fault(&page, &target);
            wrong.extend(fault.map(|fault| format!("{}: ({target}): {fault}", page.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(links > 50, "{links}");
}

/// All sources, as paths from the root on.
fn sources(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            sources(&path, found);
        } else if name.ends_with(".rs") {
            found.push(path.strip_prefix(root()).expect("below the root").display().to_string());
        }
    }
}

/// A page may leave out the beginning of a path: `board/timing.rs`, `gate.rs`. The changelog also names files of the past,
/// `panics.md` those of other people's crates; it has a check of its own.
#[test]
fn every_source_that_a_page_names_is_there() {
    let mut files = Vec::new();
    sources(root(), &mut files);
    let mut wrong = Vec::new();
    let mut named = 0;
    let pages = docs().into_iter().chain(["README.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    for page in pages.filter(|page| !page.ends_with("panics.md")) {
        let text = fs::read_to_string(&page).expect("a page");
        for name in
            text.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs") && !name.contains(' '))
        {
            named += 1;
            let is_there = files.iter().any(|file| file == name || file.ends_with(&format!("/{name}")));
            if !is_there {
                wrong.push(format!("{}: `{name}`", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(named > 50, "{named}");
}

#[test]
fn a_wrong_link_is_noticed() {
    let page = root().join("docs/console.md");
    for (target, is_wrong) in [
        ("wiring.md", false),
        ("wiring.md#pwm", false),
        ("#commands", false),
        ("../README.md", false),
        ("https://example.org/x", false),
        ("README.md", true),
        ("wiring.md#pwn", true),
        ("#comands", true),
    ] {
        assert_eq!(fault(&page, target).is_some(), is_wrong, "{target}");
    }
    assert_eq!(anchor(" The console: `[console]`, `[[typed]]`"), "the-console-console-typed");
}

//! The firmware's files use each other one way: down the tree in `docs/architecture.md`.

use std::collections::BTreeSet;
use std::fs;

use crate::page::root;

/// The files of `src/` as the tree lists them, from the top down; a file in a folder is its parent's.
fn tree() -> Vec<String> {
    let page = fs::read_to_string(root().join("docs/architecture.md")).expect("a page");
    let (_, rest) = page.split_once("\nsrc/ ").expect("the tree");
    let (tree, _) = rest.split_once("\ncrates/\n").expect("its crates");
    let mut modules: Vec<String> = Vec::new();
    for line in tree.lines().skip(1) {
        let is_child = line.starts_with("    ");
        let name = line.split_whitespace().next().expect("a file");
        let module = name.strip_suffix(".rs").unwrap_or_else(|| panic!("{name} is no source"));
        let is_in_folder = is_child
            && modules.last().is_some_and(|parent| root().join(format!("src/{parent}/{name}")).exists());
        if !is_in_folder {
            modules.push(module.to_owned());
        }
    }
    modules
}

/// The modules that a source names behind `crate::`.
fn uses(source: &str) -> BTreeSet<String> {
    let code: String =
        source.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
    let mut uses = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        let group = rest.strip_prefix('{').and_then(|rest| rest.split_once(';')).map(|(group, _)| group);
        let mut depth = 0_u32;
        let mut word = String::new();
        for letter in group.unwrap_or(rest).chars() {
            match letter {
                letter if letter.is_alphanumeric() || letter == '_' => word.push(letter),
                _ => {
                    if depth == 0 && !word.is_empty() {
                        uses.insert(std::mem::take(&mut word));
                    }
                    word.clear();
                    match letter {
                        '{' => depth += 1,
                        '}' => depth = depth.saturating_sub(1),
                        _ => {}
                    }
                    if group.is_none() {
                        break;
                    }
                }
            }
        }
    }
    uses
}

#[test]
fn files_use_those_below_them_only() {
    let tree = tree();
    let of_folder: BTreeSet<String> = fs::read_dir(root().join("src"))
        .expect("src")
        .filter_map(|entry| entry.expect("an entry").file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(".rs").map(str::to_owned))
        .collect();
    assert_eq!(tree.iter().cloned().collect::<BTreeSet<_>>(), of_folder, "the tree has every file");
    let mut arrows = 0;
    for (at, module) in tree.iter().enumerate() {
        let mut text = fs::read_to_string(root().join(format!("src/{module}.rs"))).expect("a source");
        for entry in fs::read_dir(root().join("src").join(module)).into_iter().flatten() {
            text += &fs::read_to_string(entry.expect("an entry").path()).expect("a source");
        }
        for used in uses(&text).iter().filter(|used| of_folder.contains(*used) && *used != module) {
            arrows += 1;
            assert!(
                tree[at + 1..].contains(used),
                "src/{module}.rs uses `{used}`, which docs/architecture.md lists above it"
            );
        }
    }
    assert!(arrows > 30, "{arrows}");
}

#[test]
fn what_a_source_names_is_found() {
    let source = "use crate::{a, b::{c, d}, e};\n// crate::f\nlet x = crate::g::h(); use crate::i;";
    assert_eq!(uses(source), ["a", "b", "e", "g", "i"].map(str::to_owned).into());
}

//! The README names tests that there are.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Names of the functions in all files of a folder.
fn functions(folder: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            let source = fs::read_to_string(path).unwrap();
            let names_in = source.lines().filter_map(|line| line.strip_prefix("fn ")?.split_once('('));
            names.extend(names_in.map(|(name, _)| name.to_owned()));
        }
    }
    names
}

#[test]
fn every_test_that_the_readme_names_is_there() {
    let (own, shared) = (functions("tests"), functions("../segment/tests"));
    let mut named = 0;
    for row in include_str!("../README.md").lines().filter(|line| line.starts_with('|')) {
        // The last cell lists the tests.
        let cell = row.trim_end_matches('|').rsplit('|').next().unwrap();
        let mut parts = cell.split('`');
        while let (Some(_), Some(name)) = (parts.next(), parts.next()) {
            if name.ends_with(".rs") {
                assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name).exists(), "{name}");
                continue;
            }
            let marked = cell.contains(&format!("`{name}`†"));
            assert!(if marked { &shared } else { &own }.contains(name), "{name}");
            named += 1;
        }
    }
    assert!(named > 70, "{named}");
}

//! The crates that others use: what their pages and their metadata have to have, and the programs that show them on a board.

use std::fs;
use std::path::Path;

use crate::page::{self, root};

/// Name and folder.
const PUBLISHED: [(&str, &str); 6] = [
    ("clino-codec", "crates/codec"),
    ("clino-bus", "crates/bus"),
    ("clino-commissioning", "crates/commissioning"),
    ("clino-drivers", "crates/drivers"),
    ("clino-sim", "sim/sensors"),
    ("clino-segment", "sim/segment"),
];

/// Lines of a first example, without those that only let it compile.
const MOST_LINES: usize = 25;

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn their_readmes_begin_with_cargo_add_and_an_example() {
    for (name, folder) in PUBLISHED {
        let readme = read(&root().join(folder).join("README.md"));
        let blocks = page::blocks(&readme);
        let [add, example, ..] = &blocks[..] else { panic!("{folder}: less than two blocks") };
        let dev = if folder.starts_with("sim") { "--dev " } else { "" };
        assert!(add.text.starts_with(&format!("cargo add {dev}{name}")), "{folder}: {}", add.text);
        // Until there is a public address: from a clone.
        assert!(add.text.contains(&format!("cargo add {dev}{name} --path ../clino/{folder}")), "{folder}");
        let shown = example.text.lines().filter(|line| {
            let line = line.trim_start();
            !(line.is_empty() || line.starts_with("//") || line == "#" || line.starts_with("# "))
        });
        let lines = shown.count();
        assert!((3..=MOST_LINES).contains(&lines), "{folder}: its example has {lines} lines");
    }
}

#[test]
fn they_have_what_a_registry_shows() {
    for (name, folder) in PUBLISHED {
        let manifest = read(&root().join(folder).join("Cargo.toml"));
        for key in [
            "description",
            "license.workspace",
            "readme",
            "keywords",
            "categories",
            "rust-version = \"1.88\"",
        ] {
            assert!(manifest.contains(key), "{name} has no {key}");
        }
        // There is no public address yet; docs/drivers.md says so.
        assert!(!manifest.contains("\nrepository"), "{name}");
        let changes = read(&root().join(folder).join("CHANGELOG.md"));
        assert!(changes.contains("\n## Unreleased\n") && changes.contains("\n## 0.1.0\n"), "{name}");
        if manifest.contains("\n[features]\n") {
            assert!(manifest.contains("[package.metadata.docs.rs]\nall-features = true"), "{name}");
            assert!(read(&root().join(folder).join("src/lib.rs")).contains("feature(doc_cfg)"), "{name}");
        }
    }
}

/// The last column of the table of HALs names a program, which uses this version of the HAL as the row says.
#[test]
fn every_hal_has_its_program() {
    let readme = read(&root().join("crates/drivers/README.md"));
    let table = readme.split("\n| HAL | UART |").nth(1).expect("the table");
    let mut programs = Vec::new();
    for row in table.lines().skip(2).take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [hal, _uart, adapter, release, handed_over, program] = cells[..] else { panic!("{row}") };
        let mut named = program.split('`').skip(1).step_by(2);
        let folder = named.next().expect("a program");
        // Another than the main one; what is left out instead stays.
        let other = program.contains(", its `").then(|| named.next().expect("its name"));
        let path = root().join("examples").join(folder);
        let sources: Vec<String> =
            [Some("src/main.rs".to_owned()), other.map(|name| format!("src/bin/{name}.rs"))]
                .into_iter()
                .flatten()
                .map(|file| read(&path.join(file)))
                .collect();
        let source = sources.last().expect("a source");
        programs.push(folder.to_owned());
        if hal == "Linux" {
            assert!(source.contains("handed_over_within(Duration::from_millis(16))"), "{handed_over}");
            continue;
        }
        let (hal, version) = hal.trim_start_matches('`').split_once("` ").expect("a HAL and its version");
        let manifest = read(&path.join("Cargo.toml"));
        assert!(
            manifest.contains(&format!("\n{hal} = {{ version = \"{version}\"")),
            "{folder}: {hal} {version}"
        );
        let adapter = adapter.trim_matches('`').trim_start_matches("uart::");
        assert!(source.contains(&format!("{adapter}::new(uart)")), "{folder}: {adapter}");
        match release.trim_matches('`') {
            // The default.
            "Flushed" => assert!(!source.contains("release:"), "{folder}"),
            release => assert!(source.contains(&format!("release: Release::{release},")), "{folder}"),
        }
        let eager = source.contains("eager_reads = Some(1)");
        match handed_over {
            "none" => assert!(!source.contains("handed_over_within"), "{folder}"),
            "36 characters" => assert!(eager && program.contains("without its `eager_reads`"), "{folder}"),
            "32 characters" => {
                assert!(source.contains("handed_over_within(serial.characters(32))"), "{folder}");
            }
            other => panic!("{folder}: {other}"),
        }
    }
    // And no program is in no row.
    let folders = fs::read_dir(root().join("examples")).expect("examples");
    for folder in folders {
        let name = folder.expect("a folder").file_name().into_string().expect("a name");
        assert!(programs.contains(&name), "examples/{name} is in no row of the table");
    }
}

//! The table of `DOCUMENTS.md` names tests that exist.

/// The sources of all test programs that the table may name.
const TESTS: [&str; 9] = [
    include_str!("angle.rs"),
    include_str!("ascii.rs"),
    include_str!("exhaustive.rs"),
    include_str!("isu_eeprom.rs"),
    include_str!("isu_messages.rs"),
    include_str!("isu_stream.rs"),
    include_str!("pwm.rs"),
    include_str!("t7_messages.rs"),
    concat!(include_str!("t7_stream.rs"), include_str!("vectors.rs")),
];

#[test]
fn every_row_names_a_test_that_exists() {
    let rows: Vec<&str> = include_str!("../DOCUMENTS.md")
        .lines()
        .filter(|line| line.starts_with('|') && !line.starts_with("|--") && !line.starts_with("| section"))
        .collect();
    assert!(rows.len() > 70);
    for row in rows {
        let test = row.trim_end_matches([' ', '|']).rsplit(" | ").next().unwrap().trim_matches('`');
        let definition = format!("#[test]\nfn {test}()");
        assert!(TESTS.iter().any(|source| source.contains(&definition)), "no test for: {row}");
    }
}

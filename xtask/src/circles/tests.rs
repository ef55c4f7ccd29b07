//! Small crates with and without circles, and those of the workspace.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::graph::{self, Graph};
use super::{Package, packages, resolve, source};

/// The graph of a crate with these files; the first one is its root.
fn crate_of(files: &[(&str, &str)]) -> Graph {
    let texts: BTreeMap<PathBuf, &str> =
        files.iter().map(|(path, text)| (PathBuf::from(path), *text)).collect();
    let read = |path: &Path| texts.get(path).map(|text| (*text).to_owned());
    let modules = source::modules(Path::new(files[0].0), &read).expect("a crate");
    let read: BTreeSet<&PathBuf> = modules.iter().map(|module| &module.file).collect();
    assert_eq!(read.len(), files.len(), "{read:?}");
    resolve::graph(&modules)
}

/// The circles of that crate, each as the names of its files.
fn circles(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let graph = crate_of(files);
    let name = |path: &Path| path.display().to_string();
    graph::circles(&graph).iter().map(|circle| circle.iter().map(|path| name(path)).collect()).collect()
}

/// What a file of that crate needs, parent and child left out.
fn needs(files: &[(&str, &str)], file: &str) -> Vec<String> {
    let mut needs: Vec<String> =
        crate_of(files)[Path::new(file)].keys().map(|path| path.display().to_string()).collect();
    needs.sort();
    needs
}

const NONE: Vec<Vec<String>> = Vec::new();

#[test]
fn two_files_that_need_each_other_are_a_circle() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "pub struct B; pub fn of(a: &crate::a::A) {}"),
    ];
    assert_eq!(circles(&files), [["a.rs", "b.rs"]]);
}

#[test]
fn one_way_is_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "pub struct B;"),
    ];
    assert_eq!(circles(&files), NONE);
    assert_eq!(needs(&files, "a.rs"), ["b.rs"]);
}

#[test]
fn a_long_circle_is_whole_and_what_hangs_on_it_is_no_part() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; mod above; mod below;"),
        ("a.rs", "use super::b::B; pub struct A;"),
        ("b.rs", "use super::c::C; pub struct B;"),
        ("c.rs", "use super::{a::A, below::Low}; pub struct C;"),
        ("above.rs", "use super::a::A;"),
        ("below.rs", "pub struct Low;"),
    ];
    assert_eq!(circles(&files), [["a.rs", "b.rs", "c.rs"]]);
}

#[test]
fn a_module_and_its_parent_may_name_each_other() {
    let files = [
        ("lib.rs", "mod a; pub struct Root; fn f(x: a::A) {}"),
        ("a.rs", "mod inner; use crate::Root; pub struct A(inner::I);"),
        ("a/inner.rs", "use super::A; pub struct I;"),
    ];
    assert_eq!(circles(&files), NONE);
}

#[test]
fn a_grandchild_is_no_child() {
    let files = [
        ("lib.rs", "mod a; pub struct Root(a::inner::I);"),
        ("a/mod.rs", "pub mod inner;"),
        ("a/inner.rs", "pub struct I; fn f(x: &super::super::Root) {}"),
    ];
    assert_eq!(circles(&files), [["a/inner.rs", "lib.rs"]]);
}

#[test]
fn a_reexport_is_followed_to_the_file_that_defines() {
    let files = [
        ("lib.rs", "mod a; mod b; pub use a::*; pub use b::{B as Bee};"),
        ("a.rs", "mod deep; pub use deep::Deep; use crate::Bee;"),
        ("a/deep.rs", "pub struct Deep;"),
        ("b.rs", "use crate::Deep; pub struct B;"),
    ];
    // By way of `a.rs`, which shows it, it would be one.
    assert_eq!(circles(&files), NONE);
    assert_eq!(needs(&files, "a.rs"), ["b.rs"]);
    assert_eq!(needs(&files, "b.rs"), ["a/deep.rs"]);
}

#[test]
fn a_reexport_hides_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
        ("a.rs", "use crate::B; pub struct A(B);"),
        ("b.rs", "use crate::A as Other; pub struct B;"),
    ];
    assert_eq!(circles(&files), [["a.rs", "b.rs"]]);
}

#[test]
fn a_file_that_shows_something_of_another_crate_is_needed_for_it() {
    let files =
        [("lib.rs", "mod a; mod b;"), ("a.rs", "pub use heapless::Vec;"), ("b.rs", "use crate::a::Vec;")];
    assert_eq!(needs(&files, "b.rs"), ["a.rs"]);
}

#[test]
fn nested_use_trees_are_taken_apart() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; mod d; mod e;"),
        ("a.rs", "use crate::{b::{self, x::{X, Y}}, c::C as See, d::*}; use core::fmt;"),
        ("b.rs", "pub mod x;"),
        ("b/x.rs", "pub struct X; pub struct Y;"),
        ("c.rs", "pub struct C;"),
        ("d.rs", "pub struct D;"),
        ("e.rs", ""),
    ];
    assert_eq!(needs(&files, "a.rs"), ["b.rs", "b/x.rs", "c.rs", "d.rs"]);
}

#[test]
fn names_that_a_star_brings_lead_to_their_files() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c; pub use c::C;"),
        ("a.rs", "mod inner;"),
        ("a/inner.rs", "use super::super::*; fn f(c: C) {} fn g() { b::of() }"),
        ("b.rs", "pub fn of() {}"),
        ("c.rs", "pub struct C;"),
    ];
    assert_eq!(needs(&files, "a/inner.rs"), ["b.rs", "c.rs", "lib.rs"]);
}

#[test]
fn an_imported_module_leads_on() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use crate::b; fn f() -> b::Thing { b::inner::make() }"),
        ("b.rs", "pub mod inner; mod thing; pub use thing::Thing;"),
        ("b/inner.rs", "pub fn make() {}"),
        ("b/thing.rs", "pub struct Thing;"),
    ];
    assert_eq!(needs(&files, "a.rs"), ["b.rs", "b/inner.rs", "b/thing.rs"]);
}

#[test]
fn code_for_tests_is_left_out() {
    let files = [
        ("lib.rs", "mod a; mod b; #[cfg(test)] mod missing;"),
        ("a.rs", "use crate::b::B; #[cfg(test)] mod tests { use crate::b::B; }"),
        (
            "b.rs",
            "#[cfg(test)] use crate::a::A;
             pub struct B;
             #[cfg(all(test, feature = \"x\"))] fn f(a: &crate::a::A) {}
             impl B { #[cfg(test)] fn g(a: &crate::a::A) {} }
             #[cfg(test)] mod tests { use crate::a::*; }",
        ),
    ];
    assert_eq!(circles(&files), NONE);
}

#[test]
fn code_that_is_not_for_tests_alone_counts() {
    for condition in ["not(test)", "any(test, feature = \"x\")", "feature = \"x\"", "all(unix, not(test))"] {
        let b = format!("pub struct B; #[cfg({condition})] fn f(a: &crate::a::A) {{}}");
        let files = [("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::B; pub struct A;"), ("b.rs", &b)];
        assert_eq!(circles(&files), [["a.rs", "b.rs"]], "{condition}");
    }
}

#[test]
fn macros_are_looked_into() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c;"),
        ("a.rs", "fn f(b: B) { write!(b.c, \"{}\", super::b::LIMIT + [c::of()].len()) } use crate::c;"),
        ("b.rs", "macro_rules! make { ($x:ident) => { $crate::a::f($x) } } pub const LIMIT: u8 = 1;"),
        ("c.rs", "pub fn of() {}"),
    ];
    assert_eq!(circles(&files), [["a.rs", "b.rs"]]);
    assert_eq!(needs(&files, "a.rs"), ["b.rs", "c.rs"]);
}

#[test]
fn modules_within_a_file_are_part_of_it() {
    let files = [
        ("lib.rs", "mod a; mod b { pub mod c; pub struct B; }"),
        ("a.rs", "use crate::b::c::C; pub struct A;"),
        ("b/c.rs", "mod part { use super::super::super::a::A; } use super::B; pub struct C;"),
    ];
    assert_eq!(circles(&files), [["a.rs", "b/c.rs"]]);
}

#[test]
fn other_crates_visibility_and_documentation_are_no_needs() {
    let files = [
        ("lib.rs", "mod a; mod b; pub struct Root;"),
        ("a.rs", "mod inner;"),
        ("a/inner.rs", "/// See [`crate::b::B`].\npub(crate) struct I; pub(in crate::a) fn f() { ::b::g() }"),
        ("b.rs", "use b::B; use self::c::*; mod c { } pub struct B;"),
    ];
    assert_eq!(needs(&files, "a/inner.rs"), [""; 0]);
    assert_eq!(needs(&files, "b.rs"), [""; 0]);
}

#[test]
fn a_path_attribute_says_where_a_module_is() {
    let files = [
        ("src/main.rs", "#[path = \"../elsewhere/x.rs\"] mod a; mod b;"),
        ("src/../elsewhere/x.rs", "use crate::b::B; pub struct A;"),
        ("src/b.rs", "use crate::a::A; pub struct B;"),
    ];
    assert_eq!(circles(&files).len(), 1);
}

/// A package with these files.
fn package(name: &str, files: &[(&str, &str)]) -> Package {
    Package { name: name.to_owned(), folder: "src".into(), graphs: vec![Graph::new(), crate_of(files)] }
}

#[test]
fn a_circle_is_reported_with_the_paths_that_make_it() {
    let files = [
        ("src/lib.rs", "mod a; mod b;"),
        ("src/a.rs", "use crate::b::B;"),
        ("src/b.rs", "use super::a; pub struct B;"),
    ];
    assert_eq!(
        package("new", &files).fault().expect("a circle"),
        "new has source files in a circle:\n    a.rs -> b.rs: crate::b::B\n    b.rs -> a.rs: super::a\n"
    );
}

#[test]
fn a_parent_and_its_child_are_no_circle() {
    let files =
        [("src/lib.rs", "mod a; use a::A; pub struct B;"), ("src/a.rs", "use super::B; pub struct A;")];
    assert_eq!(package("new", &files).fault(), None);
}

#[test]
fn no_package_has_a_circle() {
    let packages = packages().unwrap_or_else(|failure| panic!("{failure}"));
    let faults: Vec<String> = packages.iter().filter_map(Package::fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // All were read.
    for name in ["xtask", "clino-codec", "clino-gateway", "clino-modbus", "clino-firmware"] {
        let package = packages.iter().find(|package| package.name == name).expect(name);
        let most = package.graphs.iter().map(Graph::len).max();
        assert!(most > Some(10), "{name}: {most:?} files");
    }
}

//! Circles in a graph of files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Each file, what it needs, and a path in its code that says so.
pub type Graph = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// The groups of files each of which needs all others of its group.
pub fn circles(graph: &Graph) -> Vec<BTreeSet<&Path>> {
    let reach: BTreeMap<&Path, BTreeSet<&Path>> =
        graph.keys().map(|file| (file.as_path(), reached(graph, file))).collect();
    let mut groups = BTreeSet::new();
    for (file, needed) in &reach {
        if needed.contains(file) {
            groups.insert(needed.iter().copied().filter(|other| reach[other].contains(file)).collect());
        }
    }
    groups.into_iter().collect()
}

/// All that a file needs, by way of others.
fn reached<'g>(graph: &'g Graph, from: &Path) -> BTreeSet<&'g Path> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&Path> = graph[from].keys().map(PathBuf::as_path).collect();
    while let Some(next) = open.pop() {
        if reached.insert(next) {
            open.extend(graph[next].keys().map(PathBuf::as_path));
        }
    }
    reached
}

/// The circles in words: a line for each file that names another one of its circle. Paths are shown from `folder` on.
pub fn shown(graph: &Graph, folder: &Path) -> String {
    let mut shown = String::new();
    let short = |file: &Path| file.strip_prefix(folder).unwrap_or(file).display().to_string();
    for circle in circles(graph) {
        for file in &circle {
            for (needed, path) in graph[*file].iter().filter(|(needed, _)| circle.contains(needed.as_path()))
            {
                // Writing to a string cannot fail.
                let _ = writeln!(shown, "    {} -> {}: {path}", short(file), short(needed));
            }
        }
    }
    shown
}

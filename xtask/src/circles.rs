//! `cargo xtask circles`: no source file depends on itself by way of other files of its crate.
//!
//! A file depends on another one when its code names something that is defined there: in a `use`, a path, or a macro's
//! tokens. Re-exports are followed to the file that defines. A module and its own parent may name each other. Code for
//! tests (`#[cfg(test)]`) is left out.
//!
//! Not seen: methods called on a value, and what macros of other crates make.

mod gate;
mod graph;
mod mentions;
mod resolve;
mod source;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::command::{self, Failure, Outcome};
use graph::Graph;

/// A package of the workspace.
struct Package {
    name: String,
    folder: PathBuf,
    /// Of each library, program, test and example of it: the files, and what each needs of the others.
    graphs: Vec<Graph>,
}

/// Prints which files of each package are in circles; fails at one that is not known.
pub fn run() -> Outcome {
    let packages = packages()?;
    for package in &packages {
        let files: BTreeSet<&PathBuf> = package.graphs.iter().flat_map(Graph::keys).collect();
        print!("{}: {} files\n{}", package.name, files.len(), package.circles());
    }
    let faults: Vec<String> = packages.iter().filter_map(Package::fault).collect();
    if faults.is_empty() { Ok(()) } else { Err(Failure::new(faults.join("\n"))) }
}

impl Package {
    /// The circles of its files, line by line.
    fn circles(&self) -> String {
        let shown = |graph: &Graph| graph::shown(graph, &self.folder);
        self.graphs.iter().map(shown).collect()
    }

    /// What is wrong with it, if anything is.
    fn fault(&self) -> Option<String> {
        let (name, found) = (&self.name, self.circles());
        (!found.is_empty()).then(|| format!("{name} has source files in a circle:\n{found}"))
    }
}

/// The files of the crate that begins with this one, and what each needs of the others.
fn graph_of(root: &Path) -> Result<Graph, Failure> {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let modules = source::modules(root, &read).map_err(Failure::new)?;
    Ok(resolve::graph(&modules))
}

/// All packages of the workspace.
fn packages() -> Result<Vec<Package>, Failure> {
    let mut cargo = command::cargo(["metadata", "--format-version", "1", "--no-deps", "--offline"]);
    let output = cargo.output().map_err(|error| Failure::new(format!("cargo metadata: {error}")))?;
    if !output.status.success() {
        return Err(Failure::new(String::from_utf8_lossy(&output.stderr)));
    }
    let metadata: Metadata = serde_json::from_slice(&output.stdout)
        .map_err(|error| Failure::new(format!("cargo metadata: {error}")))?;
    let package = |Listed { name, manifest_path, targets }: Listed| {
        let graphs = targets.iter().map(|target| graph_of(&target.src_path)).collect::<Result<_, _>>()?;
        let folder = manifest_path.parent().unwrap_or(&manifest_path).to_path_buf();
        Ok(Package { name, folder, graphs })
    };
    metadata.packages.into_iter().map(package).collect()
}

/// What `cargo metadata` says.
#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Listed>,
}

#[derive(Deserialize)]
struct Listed {
    name: String,
    manifest_path: PathBuf,
    targets: Vec<Target>,
}

#[derive(Deserialize)]
struct Target {
    src_path: PathBuf,
}

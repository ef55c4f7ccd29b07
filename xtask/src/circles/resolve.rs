//! Which file defines what a path names.

use std::collections::BTreeMap;
use std::path::Path;

use super::graph::Graph;
use super::mentions::{Import, Segments};
use super::source::Module;

/// Re-exports of re-exports that are followed; a name that leads to itself ends here.
const DEEPEST: usize = 16;

/// What a path leads to.
#[derive(Clone, Copy)]
enum Found<'m> {
    Module(&'m Module),
    /// Something that this module has: defined there, or taken there from another crate.
    In(&'m Module),
}

impl<'m> Found<'m> {
    fn module(self) -> &'m Module {
        let (Found::Module(module) | Found::In(module)) = self;
        module
    }
}

/// The files of a crate, and what each needs of the others. What a file needs of its parent or child is left out.
pub fn graph(modules: &[Module]) -> Graph {
    let tree = Tree { modules: modules.iter().map(|module| (module.path.as_slice(), module)).collect() };
    let mut graph = Graph::new();
    for module in modules {
        let needs = graph.entry(module.file.clone()).or_default();
        let imports = module.mentions.imports.iter().map(Import::path);
        for path in imports.chain(&module.mentions.paths) {
            let Some(found) = tree.named(module, path, 0) else { continue };
            let file = &found.module().file;
            if *file != module.file && !tree.are_kin(&module.file, file) {
                needs.entry(file.clone()).or_insert_with(|| path.join("::"));
            }
        }
    }
    graph
}

struct Tree<'m> {
    modules: BTreeMap<&'m [String], &'m Module>,
}

impl<'m> Tree<'m> {
    /// What a path leads to, as seen from a module; `None` for another crate's.
    fn named(&self, from: &'m Module, path: &[String], depth: usize) -> Option<Found<'m>> {
        let (first, mut rest) = path.split_first()?;
        let mut at = match first.as_str() {
            "crate" => Found::Module(self.at(&[])?),
            "self" => Found::Module(from),
            "super" => Found::Module(self.parent(from)?),
            name => self.find(from, name, depth)?,
        };
        while let (Found::Module(module), Some((name, behind))) = (at, rest.split_first()) {
            at = match name.as_str() {
                "super" => Found::Module(self.parent(module)?),
                name => self.find(module, name, depth).unwrap_or(Found::In(module)),
            };
            rest = behind;
        }
        Some(at)
    }

    /// What a name means in a module.
    fn find(&self, module: &'m Module, name: &str, depth: usize) -> Option<Found<'m>> {
        if depth > DEEPEST {
            return None;
        }
        let mut child: Segments = module.path.clone();
        child.push(name.to_owned());
        if let Some(child) = self.at(&child) {
            return Some(Found::Module(child));
        }
        if module.defines.contains(name) {
            return Some(Found::In(module));
        }
        let imports = &module.mentions.imports;
        let named = imports.iter().find_map(|import| match import {
            Import::Name(known, path) if known == name => Some(path),
            _ => None,
        });
        if let Some(path) = named {
            return Some(self.named(module, path, depth + 1).unwrap_or(Found::In(module)));
        }
        imports.iter().find_map(|import| match import {
            Import::All(path) => match self.named(module, path, depth + 1)? {
                Found::Module(other) if other.path != module.path => self.find(other, name, depth + 1),
                _ => None,
            },
            Import::Name(..) => None,
        })
    }

    fn at(&self, path: &[String]) -> Option<&'m Module> {
        self.modules.get(path).copied()
    }

    fn parent(&self, of: &Module) -> Option<&'m Module> {
        let (_, path) = of.path.split_last()?;
        self.at(path)
    }

    /// Whether one of two files is the other one's parent.
    fn are_kin(&self, one: &Path, other: &Path) -> bool {
        self.parent_file(one) == Some(other) || self.parent_file(other) == Some(one)
    }

    /// The file that declares this one.
    fn parent_file(&self, file: &Path) -> Option<&'m Path> {
        // The shortest path is the file itself; others are modules in it.
        let module = self.modules.values().find(|module| module.file == file)?;
        self.parent(module).map(|parent| parent.file.as_path())
    }
}

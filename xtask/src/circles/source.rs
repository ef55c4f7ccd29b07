//! The modules of a crate, from its sources.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use syn::visit::Visit;
use syn::{Attribute, Expr, ExprLit, Item, ItemMod, Lit, Meta};

use super::gate;
use super::mentions::{Mentions, Segments};

/// The text of a file, if there is one.
pub type Read<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// A module: a file, or a part of one.
pub struct Module {
    /// Its path from the root, which has none.
    pub path: Segments,
    pub file: PathBuf,
    /// The names of its items, other modules left out.
    pub defines: BTreeSet<String>,
    pub mentions: Mentions,
}

/// All modules of the crate that begins with this file, those for tests left out.
///
/// # Errors
/// A file that is missing or is no Rust.
pub fn modules(root: &Path, read: Read<'_>) -> Result<Vec<Module>, String> {
    let mut reader = Reader { read, modules: Vec::new() };
    let folder = root.parent().unwrap_or(root).to_path_buf();
    reader.file(Vec::new(), root.to_path_buf(), folder)?;
    Ok(reader.modules)
}

struct Reader<'a> {
    read: Read<'a>,
    modules: Vec<Module>,
}

impl Reader<'_> {
    /// Reads a file; `folder` is where the files of its children are.
    fn file(&mut self, path: Segments, file: PathBuf, folder: PathBuf) -> Result<(), String> {
        let text = (self.read)(&file).ok_or_else(|| format!("{}: there is no such file", file.display()))?;
        let parsed = syn::parse_file(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        self.items(path, &file, &folder, &parsed.items)
    }

    fn items(&mut self, path: Segments, file: &Path, folder: &Path, items: &[Item]) -> Result<(), String> {
        let mut module = Module {
            path: path.clone(),
            file: file.to_path_buf(),
            defines: BTreeSet::new(),
            mentions: Mentions::default(),
        };
        for item in items.iter().filter(|item| !gate::is_for_tests(gate::of_item(item))) {
            module.defines.extend(name(item));
            module.mentions.visit_item(item);
        }
        self.modules.push(module);
        for item in items {
            if let Item::Mod(child) = item
                && !gate::is_for_tests(&child.attrs)
            {
                self.child(&path, file, folder, child)?;
            }
        }
        Ok(())
    }

    fn child(
        &mut self,
        parent: &Segments,
        file: &Path,
        folder: &Path,
        child: &ItemMod,
    ) -> Result<(), String> {
        let name = child.ident.to_string();
        let mut path = parent.clone();
        path.push(name.clone());
        let below = folder.join(&name);
        if let Some((_, items)) = &child.content {
            return self.items(path, file, &below, items);
        }
        if let Some(elsewhere) = child.attrs.iter().find_map(elsewhere) {
            let elsewhere = file.parent().unwrap_or(file).join(elsewhere);
            let folder = elsewhere.parent().unwrap_or(folder).to_path_buf();
            return self.file(path, elsewhere, folder);
        }
        let beside = folder.join(format!("{name}.rs"));
        let is_beside = (self.read)(&beside).is_some();
        self.file(path, if is_beside { beside } else { below.join("mod.rs") }, below)
    }
}

/// Where `#[path = "…"]` says that a module is.
fn elsewhere(attribute: &Attribute) -> Option<String> {
    match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("path") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    }
}

/// The name that an item has, if it has one and is no module.
fn name(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::TraitAlias(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

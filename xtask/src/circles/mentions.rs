//! What a piece of code names: its imports, and every path in it.

use std::collections::BTreeSet;

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, ImplItem, Item, ItemMod, ItemUse, Macro, Path, UseTree, Visibility};

use super::gate;

/// A path, segment by segment.
pub type Segments = Vec<String>;

/// What a `use` brings into scope.
#[derive(Debug, PartialEq, Eq)]
pub enum Import {
    /// This name, for what the path leads to.
    Name(String, Segments),
    /// All names of what the path leads to.
    All(Segments),
}

impl Import {
    /// Where it leads to.
    pub fn path(&self) -> &Segments {
        let (Import::Name(_, path) | Import::All(path)) = self;
        path
    }
}

/// What a piece of code names.
#[derive(Default)]
pub struct Mentions {
    pub imports: Vec<Import>,
    pub paths: BTreeSet<Segments>,
}

impl<'ast> Visit<'ast> for Mentions {
    /// Documentation and derives are no code of ours.
    fn visit_attribute(&mut self, _: &'ast Attribute) {}

    /// Who may see something is not what it needs.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_item(&mut self, item: &'ast Item) {
        if !gate::is_for_tests(gate::of_item(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        if !gate::is_for_tests(gate::of_impl_item(item)) {
            visit::visit_impl_item(self, item);
        }
    }

    /// A module of its own.
    fn visit_item_mod(&mut self, _: &'ast ItemMod) {}

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        // With `::` before it, it is another crate's.
        if item.leading_colon.is_none() {
            self.import(&mut Vec::new(), &item.tree);
        }
    }

    fn visit_path(&mut self, path: &'ast Path) {
        if path.leading_colon.is_none() {
            self.paths.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        visit::visit_macro(self, call);
        self.tokens(call.tokens.clone());
    }
}

impl Mentions {
    /// Takes a `use` apart; `before` is the path so far.
    fn import(&mut self, before: &mut Segments, tree: &UseTree) {
        let joined = |name: String| {
            let mut path = before.clone();
            // `{self}` is what stands before it.
            path.extend((name != "self" || before.is_empty()).then_some(name));
            path
        };
        match tree {
            UseTree::Path(tree) => {
                before.push(tree.ident.to_string());
                self.import(before, &tree.tree);
                before.pop();
            }
            UseTree::Name(tree) => {
                let path = joined(tree.ident.to_string());
                self.imports.extend(path.last().cloned().map(|name| Import::Name(name, path)));
            }
            UseTree::Rename(tree) => {
                let path = joined(tree.ident.to_string());
                self.imports.push(Import::Name(tree.rename.to_string(), path));
            }
            UseTree::Glob(_) => self.imports.push(Import::All(before.clone())),
            UseTree::Group(tree) => tree.items.iter().for_each(|tree| self.import(before, tree)),
        }
    }

    /// Paths in the tokens of a macro, which may be anything.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path = Segments::new();
        // Colons since the last segment, and whether a field or method follows.
        let (mut colons, mut is_member) = (0, false);
        for token in tokens {
            match token {
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.end(&mut path);
                    }
                    if !is_member {
                        path.push(ident.to_string());
                    }
                    (colons, is_member) = (0, false);
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                token => {
                    self.end(&mut path);
                    colons = 0;
                    is_member = matches!(&token, TokenTree::Punct(punct) if punct.as_char() == '.');
                    if let TokenTree::Group(group) = token {
                        self.tokens(group.stream());
                    }
                }
            }
        }
        self.end(&mut path);
    }

    fn end(&mut self, path: &mut Segments) {
        if !path.is_empty() {
            self.paths.insert(std::mem::take(path));
        }
    }
}

//! What no analysis of an image can know, from a table that is checked in: `stack.toml`, which says what its lines mean.
//!
//! Names are those of the source, without the compiler's hash; `*` stands for anything.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::Error;

/// The table.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Annotations {
    /// The main program.
    pub main: Pattern,
    /// Functions that run before the main program and may take another stack, to go on there for ever.
    #[serde(default)]
    pub before_main: Vec<Pattern>,
    /// Lists of names that several lines need; `@name` stands for one.
    #[serde(default)]
    pub groups: BTreeMap<String, Vec<Pattern>>,
    /// Levels that interrupt each other, lowest first.
    #[serde(default, rename = "level")]
    pub levels: Vec<Level>,
    /// What holds them off.
    #[serde(default, rename = "ceiling")]
    pub ceilings: Vec<Ceiling>,
    /// Whom indirect calls reach.
    #[serde(default)]
    pub indirect: Vec<Indirect>,
    /// Functions whose address is taken, but which are not called by it.
    #[serde(default)]
    pub uncalled: Vec<Uncalled>,
    /// Functions that may be active more than once at a time.
    #[serde(default)]
    pub recursion: Vec<Recursion>,
}

/// Interrupts of one priority: only one of them is active at a time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// What it is called.
    pub name: String,
    /// Its handlers.
    pub handlers: Vec<Pattern>,
    /// Bytes of the stack of its own, if it takes one.
    pub own_stack_bytes: Option<u32>,
}

/// A priority ceiling.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceiling {
    /// While one of these is active, called from below that level,
    pub functions: Vec<Pattern>,
    /// this level and those below it cannot begin.
    pub level: String,
    /// How it is known.
    pub why: String,
}

/// The indirect calls in some functions.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Indirect {
    /// In these functions.
    pub callers: Vec<Pattern>,
    /// One of these is called.
    pub callees: Vec<Pattern>,
    /// How it is known.
    pub why: String,
}

/// See [`Annotations::uncalled`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uncalled {
    /// These.
    pub functions: Vec<Pattern>,
    /// How it is known.
    pub why: String,
}

/// See [`Annotations::recursion`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recursion {
    /// This one.
    pub function: Pattern,
    /// Times at once.
    pub at_most: u8,
    /// How it is known.
    pub why: String,
}

/// A name, or several: `*` stands for anything.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub struct Pattern(pub String);

impl Pattern {
    /// Whether it is this name.
    pub fn matches(&self, name: &str) -> bool {
        let mut parts = self.0.split('*');
        let Some(mut rest) = name.strip_prefix(parts.next().unwrap_or_default()) else { return false };
        let mut parts: Vec<&str> = parts.collect();
        let Some(last) = parts.pop() else { return rest.is_empty() };
        for part in parts {
            let Some((_, behind)) = rest.split_once(part) else { return false };
            rest = behind;
        }
        rest.ends_with(last)
    }

    /// Whether it is one of these names.
    pub fn matches_any(&self, names: &[String]) -> bool {
        names.iter().any(|name| self.matches(name))
    }
}

impl Annotations {
    /// Reads the table.
    pub fn parse(text: &str) -> Result<Annotations, Error> {
        let mut table: Annotations = toml::from_str(text)?;
        for line in &mut table.indirect {
            let names = std::mem::take(&mut line.callees);
            for name in names {
                match name.0.strip_prefix('@') {
                    None => line.callees.push(name),
                    Some(group) => {
                        let group = table.groups.get(group);
                        let group =
                            group.ok_or_else(|| Error::new(format!("there is no group `{}`", name.0)))?;
                        line.callees.extend(group.iter().cloned());
                    }
                }
            }
        }
        Ok(table)
    }
}

//! The panics left in an image: who calls what does not come back but ends in the panic handler.
//!
//! A panic is an *entry* (a function of the standard library, such as `core::panicking::panic_fmt`) that is called at a
//! *site*, somewhere else. The list of what is expected is a Markdown table with a reason for each file of the source.
//! Neither lines nor entries are in it: the former change with every edit, and the compiler makes one of several entries
//! that do the same. A further panic in a file that is listed is therefore not noticed.

use std::collections::{BTreeMap, BTreeSet};

use crate::Error;
use crate::elf::Image;
use crate::frames::{Frame, Target};
use crate::source::Lines;

/// Where the panics of the language end.
const HANDLER: &str = "__rustc::rust_begin_unwind";

/// One of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Site {
    /// What is called.
    pub entry: String,
    /// The function that calls.
    pub function: String,
    /// The line of the file; 0 if calls of several lines were merged.
    pub line: u32,
}

/// The panics of an image, by the file in which the source of the call is; of the standard library's own calls, by the
/// function.
pub fn find(
    image: &Image,
    frames: &BTreeMap<u32, Frame>,
    lines: &Lines,
) -> Result<BTreeMap<String, Vec<Site>>, Error> {
    let entries = entries(image, frames);
    let mut panics: BTreeMap<String, Vec<Site>> = BTreeMap::new();
    for (&address, frame) in frames.iter().filter(|(address, _)| !entries.contains(address)) {
        for call in &frame.calls {
            let Target::Function(to) = call.target else { continue };
            if !entries.contains(&to) {
                continue;
            }
            let place = lines.place(call.at)?;
            let function = image.name_of(address);
            let unknown = place.file.is_empty() || place.file.starts_with("library/");
            let file = if unknown { function.clone() } else { place.file };
            let site = Site { entry: image.name_of(to), function, line: place.line };
            panics.entry(file).or_default().push(site);
        }
    }
    Ok(panics)
}

/// Whether a function of the standard library takes a part of a slice or array. Where the compiler has not inlined one, its
/// panic is still that of whoever calls it.
fn is_index(name: &str) -> bool {
    let is_core = name.starts_with("core::") || name.starts_with("<core::");
    is_core && (name.ends_with("::index") || name.ends_with("::index_mut"))
}

/// What ends in the panic handler and is of the standard library.
fn entries(image: &Image, frames: &BTreeMap<u32, Frame>) -> BTreeSet<u32> {
    let is = |address: &u32, wanted: fn(&str) -> bool| {
        image.functions.get(address).is_some_and(|function| function.names.iter().any(|name| wanted(name)))
    };
    let mut entries: BTreeSet<u32> =
        frames.keys().filter(|address| is(address, |name| name == HANDLER)).copied().collect();
    loop {
        let more = frames.iter().filter(|(address, frame)| {
            let calls_entry = frame
                .calls
                .iter()
                .any(|call| matches!(call.target, Target::Function(to) if entries.contains(&to)));
            let is_entry =
                is(address, is_index) || !frame.returns && is(address, |name| name.starts_with("core::"));
            calls_entry && is_entry && !entries.contains(address)
        });
        let more: Vec<u32> = more.map(|(&address, _)| address).collect();
        if more.is_empty() {
            return entries;
        }
        entries.extend(more);
    }
}

/// The files in a list: lines `| file | what | why |` of a Markdown table.
pub fn listed(text: &str) -> Result<BTreeSet<String>, Error> {
    let mut files = BTreeSet::new();
    for line in text.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.split(" | ").map(|cell| cell.trim_matches(['|', ' ', '`'])).collect();
        let &[file, what, why] = &cells[..] else {
            return Err(Error::new(format!("not `| file | what | why |`: {line}")));
        };
        if what.is_empty() || why.is_empty() {
            return Err(Error::new(format!("no reason is given: {line}")));
        }
        if !files.insert(file.to_owned()) {
            return Err(Error::new(format!("listed twice: {line}")));
        }
    }
    Ok(files)
}

/// What is in the image and not in the list, and the other way round.
pub fn compare(found: &BTreeMap<String, Vec<Site>>, listed: &BTreeSet<String>) -> Vec<String> {
    let mut differences = Vec::new();
    for (file, sites) in found.iter().filter(|(file, _)| !listed.contains(*file)) {
        let site = |site: &Site| format!("\n  {} at line {} in {}", site.entry, site.line, site.function);
        let sites: Vec<String> = sites.iter().map(site).collect();
        differences.push(format!("not listed: panics from {file}{}", sites.concat()));
    }
    for file in listed.iter().filter(|file| !found.contains_key(*file)) {
        differences.push(format!("no panic comes from {file} any more"));
    }
    differences
}

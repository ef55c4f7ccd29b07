//! Where in the source an instruction comes from (DWARF 4 section 6.2), without what is particular to a machine.

use std::sync::Arc;

use addr2line::Context;
use gimli::{Dwarf, EndianArcSlice, LittleEndian};
use object::{Object, ObjectSection};

use crate::Error;

type Reader = EndianArcSlice<LittleEndian>;

/// Lines by address.
pub struct Lines {
    context: Context<Reader>,
}

/// A place in the source.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The file, beginning with its package, or within the workspace.
    pub file: String,
    /// The line.
    pub line: u32,
}

impl Lines {
    /// Reads the notes of an image.
    pub fn parse(elf: &[u8]) -> Result<Lines, Error> {
        let file = object::File::parse(elf)?;
        let load = |id: gimli::SectionId| -> Result<Reader, Error> {
            let section = file.section_by_name(id.name());
            let data = section.map_or(Ok(&[][..]), |section| section.data())?;
            Ok(EndianArcSlice::new(Arc::from(data), LittleEndian))
        };
        Ok(Lines { context: Context::from_dwarf(Dwarf::load(load)?)? })
    }

    /// The innermost place of an instruction that is not in the standard library.
    pub fn place(&self, address: u32) -> Result<Place, Error> {
        let mut frames = self.context.find_frames(u64::from(address)).skip_all_loads()?;
        let mut place = Place::default();
        while let Some(frame) = frames.next()? {
            let Some(location) = frame.location else { continue };
            let file = package(location.file.unwrap_or_default());
            place = Place { line: location.line.unwrap_or(0), file };
            if !place.file.starts_with("library/") {
                break;
            }
        }
        Ok(place)
    }
}

/// A path from its package on, without its version; in the workspace, from its root on.
pub fn package(path: &str) -> String {
    if let Some((_, rest)) = path.split_once("/library/") {
        return format!("library/{rest}");
    }
    if let Some((_, rest)) = path.split_once("/registry/src/") {
        let (package, file) =
            rest.split_once('/').unwrap_or(("", rest)).1.split_once('/').unwrap_or((rest, ""));
        let name = package.rsplit_once('-').map_or(package, |(name, _)| name);
        return format!("{name}/{file}");
    }
    ["/crates/", "/src/"]
        .iter()
        .find_map(|folder| path.find(folder).and_then(|at| path.get(at + 1..)))
        .unwrap_or(path)
        .to_owned()
}

//! The compiler's own notes on the stack, `.debug_frame`, against what the instructions say.
//!
//! The compiler notes where the frame begins, relative to the stack pointer or, behind the prologue, to the frame pointer
//! (DWARF 4 section 6.4). Wherever a note begins at an instruction that can be reached, it has to agree. Where local
//! variables are it does not note; that is why the instructions are followed. It makes no notes for assembly, and none for
//! epilogues.

use std::collections::BTreeMap;

use gimli::{
    BaseAddresses, CfaRule, CieOrFde, DebugFrame, LittleEndian, Register, UnwindContext, UnwindSection,
};
use object::{Object, ObjectSection};

use crate::Error;
use crate::elf::Image;
use crate::frames::Frame;

/// DWARF's number of the frame pointer in Thumb code.
const R7: Register = Register(7);
/// And of the stack pointer.
const SP: Register = Register(13);

/// Compares; returns how many notes agree.
pub fn compare(elf: &[u8], image: &Image, frames: &BTreeMap<u32, Frame>) -> Result<usize, Error> {
    let file = object::File::parse(elf)?;
    let section = file.section_by_name(".debug_frame");
    let data = section.map_or(Ok(&[][..]), |section| section.data())?;
    let notes = DebugFrame::new(data, LittleEndian);
    let bases = BaseAddresses::default();
    let mut context = UnwindContext::new();
    let mut agreeing = 0;
    let mut entries = notes.entries(&bases);
    while let Some(entry) = entries.next()? {
        let CieOrFde::Fde(partial) = entry else { continue };
        let note = partial.parse(DebugFrame::cie_from_offset)?;
        let Some(frame) = frames.get(&(note.initial_address() as u32)) else { continue };
        let mut rows = note.rows(&notes, &bases, &mut context)?;
        while let Some(row) = rows.next_row()? {
            let at = row.start_address() as u32;
            let CfaRule::RegisterAndOffset { register, offset } = *row.cfa() else {
                return Err(Error::new(format!(
                    "{}: a rule for the frame that is not known",
                    image.name_of(at)
                )));
            };
            let Some(&depth) = frame.depths.get(&at) else { continue };
            let seen = match register {
                SP => Some(depth),
                R7 => frame.frame_pointer,
                _ => None,
            };
            if seen.map(i64::from) != Some(offset) {
                let name = image.name_of(note.initial_address() as u32);
                let what = format!("{name}: {seen:?} bytes at {at:#010x}, but the compiler says {offset}");
                return Err(Error::new(what));
            }
            agreeing += 1;
        }
    }
    Ok(agreeing)
}

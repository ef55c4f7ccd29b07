//! `cargo xtask image`: the firmware image as an Intel HEX file, for the drive that the ST-LINK of a Nucleo shows.
//!
//! The file has records for the image and none for anything else: neither the sectors of the configuration nor that of the
//! tally are in it. A raw `.bin` would fill the gap between the vectors and the code, where the configuration is.

use std::fs;
use std::path::Path;

use ihex::Record;
use object::Endianness;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};

use crate::boards::Board;
use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, Variant};
use crate::steps::Steps;

/// Bytes of a record.
const RECORD: usize = 16;

/// Builds the image and writes the file.
pub fn run(board: Board) -> Outcome {
    let variant = Variant::of(board);
    firmware::build_all(&mut Steps::new("image"), &[variant])?;
    let elf = variant.elf();
    let failed =
        |path: &Path, why: &dyn std::fmt::Display| Failure::new(format!("{}: {why}", path.display()));
    let bytes = fs::read(&elf).map_err(|error| failed(&elf, &error))?;
    let text = of(&bytes).map_err(|why| failed(&elf, &why))?;
    let path = command::target_dir().join(format!("clino-{}.hex", board.name));
    fs::write(&path, text).map_err(|error| failed(&path, &error))?;
    println!("{}", path.display());
    Ok(())
}

/// What of an ELF file goes into flash, as Intel HEX.
fn of(elf: &[u8]) -> Result<String, String> {
    let file = ElfFile32::<Endianness>::parse(elf).map_err(|error| error.to_string())?;
    let endian = file.endian();
    let mut records = Vec::new();
    let mut upper = None;
    for header in file.elf_program_headers() {
        if header.p_type(endian) != PT_LOAD || header.p_filesz(endian) == 0 {
            continue;
        }
        let data = header.data(endian, elf).map_err(|()| "a segment lies outside the file")?;
        let mut at = header.p_paddr(endian);
        let mut rest = data;
        while !rest.is_empty() {
            // A record ends where the upper half of the address changes.
            let (offset, page) = (at as u16, (at >> 16) as u16);
            let room = (1usize << 16) - usize::from(offset);
            let (value, behind) = rest.split_at(RECORD.min(room).min(rest.len()));
            if upper.replace(page) != Some(page) {
                records.push(Record::ExtendedLinearAddress(page));
            }
            records.push(Record::Data { offset, value: value.to_vec() });
            at += value.len() as u32;
            rest = behind;
        }
    }
    records.push(Record::EndOfFile);
    ihex::create_object_file_representation(&records).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ELF file for ARM of these segments: load address and contents.
    fn elf(segments: &[(u32, Vec<u8>)]) -> Vec<u8> {
        let mut file = b"\x7fELF\x01\x01\x01".to_vec();
        file.resize(16, 0);
        let count = segments.len() as u16;
        file.extend([2u16, 40].iter().flat_map(|half| half.to_le_bytes()));
        file.extend([1u32, 0, 52, 0, 0].iter().flat_map(|word| word.to_le_bytes()));
        file.extend([52u16, 32, count, 40, 0, 0].iter().flat_map(|half| half.to_le_bytes()));
        let mut at = 52 + 32 * u32::from(count);
        for (address, data) in segments {
            let length = data.len() as u32;
            let header = [1, at, 0x2000_0000, *address, length, length, 5, 4];
            file.extend(header.iter().flat_map(|word| word.to_le_bytes()));
            at += length;
        }
        segments.iter().for_each(|(_, data)| file.extend(data));
        file
    }

    #[test]
    fn only_what_is_in_the_image_is_in_the_file() {
        let vectors: Vec<u8> = (0..40).collect();
        // Across the border of 64 KiB, from the middle of a record on.
        let code: Vec<u8> = (0..100).rev().collect();
        let text = of(&elf(&[(0x0800_0000, vectors.clone()), (0x0801_ffe4, code.clone())])).expect("a file");
        let (mut upper, mut found) = (0u32, Vec::new());
        for record in ihex::Reader::new(&text) {
            match record.expect("a record") {
                Record::ExtendedLinearAddress(page) => upper = u32::from(page) << 16,
                Record::Data { offset, value } => {
                    assert!(usize::from(offset) + value.len() <= 1 << 16);
                    found.extend((upper + u32::from(offset)..).zip(value));
                }
                other => assert_eq!(other, Record::EndOfFile),
            }
        }
        let expected: Vec<(u32, u8)> =
            (0x0800_0000..).zip(vectors).chain((0x0801_ffe4..).zip(code)).collect();
        assert_eq!(found, expected);
        assert!(text.trim_end().ends_with(":00000001FF"), "{text}");
    }
}

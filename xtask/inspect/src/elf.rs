//! What an image consists of: functions by address, instructions, and the data in which addresses of functions lie.
//!
//! Format: ELF32 for ARM (IHI 0044): bit 0 of a function's value says Thumb, the mapping symbols `$t` and `$d` say where
//! instructions end and constants begin. An image without its symbols cannot be read.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use object::elf::{SHF_ALLOC, SHF_EXECINSTR};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};

use crate::Error;

/// Bit of an address that says "Thumb".
pub const THUMB: u32 = 1;

/// A function of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its names as in the source, without the compiler's hash. Several if the linker gave one address to several.
    pub names: Vec<String>,
    /// Where its instructions are.
    pub body: Range<u32>,
}

impl Function {
    /// The first of its names.
    pub fn name(&self) -> &str {
        self.names.first().map_or("?", String::as_str)
    }
}

/// A stretch of bytes at an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bytes {
    /// Of the first one.
    pub address: u32,
    /// As stored.
    pub bytes: Vec<u8>,
}

impl Bytes {
    /// What is at this address, of this length; `None` if it is not in here.
    pub fn at(&self, address: u32, length: usize) -> Option<&[u8]> {
        let from = usize::try_from(address.checked_sub(self.address)?).ok()?;
        self.bytes.get(from..from.checked_add(length)?)
    }

    /// The words in it, at addresses that are multiples of four, each with its address.
    pub fn words(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let skipped = self.address.wrapping_neg() & 3;
        let words = self.bytes.get(skipped as usize..).unwrap_or_default().chunks_exact(4);
        let address = self.address + skipped;
        words.zip((address..).step_by(4)).map(|(word, address)| (address, u32_of(word)))
    }
}

fn u32_of(word: &[u8]) -> u32 {
    word.iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte))
}

/// The image.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// By address.
    pub functions: BTreeMap<u32, Function>,
    /// Stretches of instructions.
    pub code: Vec<Bytes>,
    /// Stretches of constants: between instructions, and in sections of their own.
    pub data: Vec<Bytes>,
    /// The vectors: address of the initial stack pointer, reset, exceptions, interrupts.
    pub vectors: Vec<u32>,
}

impl Image {
    /// Reads an image.
    pub fn parse(elf: &[u8]) -> Result<Image, Error> {
        let file = object::File::parse(elf)?;
        let mut image = Image::default();
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags, .. } = section.flags() else { continue };
            if !sh_flags.contains(SHF_ALLOC) {
                continue;
            }
            let whole = Bytes { address: section.address() as u32, bytes: section.data()?.to_vec() };
            if sh_flags.contains(SHF_EXECINSTR) {
                image.split(&whole, &maps(&file));
                image.name(&file, &whole);
            } else if section.name() == Ok(".vector_table") {
                image.vectors = whole.words().map(|(_, word)| word).collect();
            } else if !whole.bytes.is_empty() {
                image.data.push(whole);
            }
        }
        if image.functions.is_empty() {
            return Err(Error::new("there is no symbol of a function in it"));
        }
        Ok(image)
    }

    /// The function that has this address in it.
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        function.body.contains(&address).then_some(function)
    }

    /// The name of the function that begins here, or the number.
    pub fn name_of(&self, address: u32) -> String {
        let function = self.functions.get(&address);
        function.map_or_else(|| format!("{address:#010x}"), |function| function.name().to_owned())
    }

    /// A byte or halfword of constants between instructions.
    pub fn constant(&self, address: u32, length: usize) -> Option<u32> {
        self.data.iter().find_map(|bytes| bytes.at(address, length)).map(u32_of)
    }

    /// Divides a section into instructions and constants.
    fn split(&mut self, section: &Bytes, maps: &BTreeMap<u32, bool>) {
        let end = section.address + section.bytes.len() as u32;
        let inside: Vec<(u32, bool)> =
            maps.range(section.address..end).map(|(&at, &code)| (at, code)).collect();
        for (number, &(from, is_code)) in inside.iter().enumerate() {
            let to = inside.get(number + 1).map_or(end, |&(next, _)| next);
            let Some(bytes) = section.at(from, (to - from) as usize) else { continue };
            let stretch = Bytes { address: from, bytes: bytes.to_vec() };
            if is_code { &mut self.code } else { &mut self.data }.push(stretch);
        }
    }

    /// Takes the names of the functions in a section, and says where each ends: where its symbol says, or, for those
    /// written in assembly that do not say, where the next one begins.
    fn name(&mut self, file: &object::File<'_>, section: &Bytes) {
        let end = section.address + section.bytes.len() as u32;
        let mut sizes: BTreeMap<u32, u32> = BTreeMap::new();
        let mut names: BTreeMap<u32, BTreeSet<String>> = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
            let address = symbol.address() as u32 & !THUMB;
            let Ok(name) = symbol.name() else { continue };
            if !(section.address..end).contains(&address) || is_map(name) {
                continue;
            }
            names.entry(address).or_default().insert(format!("{:#}", rustc_demangle::demangle(name)));
            let size = sizes.entry(address).or_default();
            *size = (*size).max(symbol.size() as u32);
        }
        let starts: Vec<u32> = sizes.keys().copied().collect();
        for (&address, &size) in &sizes {
            let next = starts.iter().find(|&&start| start > address).copied().unwrap_or(end);
            let body = address..if size == 0 { next } else { address + size };
            let names = names.remove(&address).unwrap_or_default().into_iter().collect();
            self.functions.insert(address, Function { names, body });
        }
    }
}

/// Where instructions (true) and constants (false) begin.
fn maps(file: &object::File<'_>) -> BTreeMap<u32, bool> {
    let maps = file.symbols().filter_map(|symbol| {
        let name = symbol.name().ok().filter(|name| is_map(name))?;
        Some((symbol.address() as u32, name.starts_with("$t")))
    });
    maps.collect()
}

/// `$t`, `$d`, `$a`, also with something behind a dot (IHI 0044 section 4.5.6).
fn is_map(name: &str) -> bool {
    ["$t", "$d", "$a"]
        .iter()
        .any(|map| name.strip_prefix(map).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
}

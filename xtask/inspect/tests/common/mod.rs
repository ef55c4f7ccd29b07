//! Images of a few hand-assembled functions (ARM DDI 0403 chapter A7), and what the analysis says of them.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::collections::BTreeMap;

use clino_inspect::annotations::Annotations;
use clino_inspect::elf::{Bytes, Function, Image, THUMB};
use clino_inspect::frames::Frame;
use clino_inspect::instruction::Instruction;
use clino_inspect::stack::{self, Worst};
use clino_inspect::{Error, calls, frames, instruction};

pub const PUSH_R7_LR: u16 = 0xB580;
pub const POP_R7_PC: u16 = 0xBD80;
pub const SUB_SP_16: u16 = 0xB084;
pub const ADD_SP_16: u16 = 0xB004;
pub const BX_LR: u16 = 0x4770;
pub const BLX_R3: u16 = 0x4798;
pub const BX_R3: u16 = 0x4718;
pub const CMP_R0_0: u16 = 0x2800;
pub const IT_NE: u16 = 0xBF18;
pub const MOV_SP_R1: u16 = 0x468D;
/// sub.w sp, sp, r4
pub const SUB_SP_R4: [u16; 2] = [0xEBAD, 0x0D04];
/// tbb [pc, r0]
pub const TBB_R0: [u16; 2] = [0xE8DF, 0xF000];

/// Bytes from one function to the next.
const EACH: u32 = 0x100;
const START: u32 = 0x0801_0000;

/// Where the function of this number is.
pub fn address(number: usize) -> u32 {
    START + EACH * number as u32
}

/// `bl`, as the instruction of this index of one function, to another.
pub fn bl(from: (usize, u32), to: usize) -> [u16; 2] {
    let offset = address(to).wrapping_sub(address(from.0) + 2 * from.1 + 4) as i32;
    let sign = (offset < 0) as u16;
    // J1 and J2 repeat the sign for what is this near.
    [0xF000 | sign << 10 | (offset >> 12 & 0x3FF) as u16, 0xF800 | 0x2800 | (offset >> 1 & 0x7FF) as u16]
}

/// An image of functions, with addresses taken of some.
pub fn image(functions: &[(&str, &[u16])], taken: &[usize], vectors: &[usize]) -> Image {
    let mut image = Image::default();
    for (number, (name, body)) in functions.iter().enumerate() {
        let bytes: Vec<u8> = body.iter().flat_map(|half| half.to_le_bytes()).collect();
        let address = address(number);
        let body = address..address + bytes.len() as u32;
        image.functions.insert(address, Function { names: vec![(*name).to_owned()], body });
        image.code.push(Bytes { address, bytes });
    }
    let words = taken.iter().flat_map(|&number| (address(number) | THUMB).to_le_bytes());
    image.data.push(Bytes { address: 0x0803_0000, bytes: words.collect() });
    image.vectors = [0, 0].into_iter().chain(vectors.iter().map(|&number| address(number) | THUMB)).collect();
    image
}

/// Instructions and frames, by address.
pub type Followed = (BTreeMap<u32, Instruction>, BTreeMap<u32, Frame>);

pub fn frames(image: &Image) -> Result<Followed, Error> {
    let code = instruction::decode(image)?;
    let frames = frames::all(image, &code)?;
    Ok((code, frames))
}

/// The worst case, with a table whose line about the main program is added here.
pub fn worst(image: &Image, table: &str) -> Result<Vec<Worst>, Error> {
    let table = format!("main = \"main\"\n{table}");
    let annotations = Annotations::parse(&table)?;
    let (code, frames) = frames(image)?;
    let graph = calls::graph(image, &code, &frames, &annotations)?;
    stack::worst(image, &frames, &graph, &annotations)
}

pub fn bytes(image: &Image, table: &str) -> u32 {
    stack::total(&worst(image, table).expect("an image that can be analysed"))
}

pub fn refused(image: &Image, table: &str) -> String {
    worst(image, table).expect_err("something is wrong with it").to_string()
}

//! The payload of a fault: the instruction of the image that causes it, and the constants that it needs.

use std::fmt;

use super::What;
use crate::elf::{FLASH_BASE, Image};
use crate::incident::ResetCause;

/// Reserved, between flash and core-coupled memory (RM0090 section 2.3): code could be executed there, but nothing
/// answers.
const NOWHERE: u32 = 0x0a00_0000;

/// Thumb instructions (ARM DDI 0403 A7.7).
const BRANCH_TO_SELF: u16 = 0xe7fe;
/// `udf`, without its 8-bit immediate.
const UNDEFINED: u16 = 0xde00;
/// `ldr r0, [r0]`, without both register numbers: 3 bits each from bit 0 and bit 3.
const LOAD: u16 = 0x6800;
/// `push`, of low registers and LR: the first instruction of most functions.
const PUSH_LR: u16 = 0xb500;

/// End of the stack's memory, as the runtime's linker script calls it.
const STACK_END: &str = "_stack_end";
/// Panic functions of `core`, as part of their mangled names. Message or numbers go into R0 and R1, the location into
/// R2; the last has it in R1.
const PANICS: [&str; 2] = ["4core9panicking5panic", "4core9panicking18panic_bounds_check"];

/// What the registers are set to for a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Payload {
    /// Program counter.
    pub pc: u32,
    /// General registers: number and value.
    pub registers: [Option<(u8, u32)>; 3],
    /// Stack pointer.
    pub sp: Option<u32>,
    /// PRIMASK is set.
    pub masked: bool,
    /// Nothing but a reset of the chip from outside.
    pub reset: Option<ResetCause>,
    /// Only this byte of memory is changed: its address, and the bits that turn.
    pub flips: Option<(u32, u8)>,
}

/// The image lacks what a fault takes: a board with it cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoPayload {
    /// The fault.
    pub what: What,
    /// What was looked for.
    pub lacks: &'static str,
}

impl Payload {
    /// Finds in `image` what `what` takes.
    ///
    /// # Errors
    ///
    /// [`NoPayload`] if it is not there.
    pub fn find(image: &Image, what: What) -> Result<Payload, NoPayload> {
        let lacks = |lacks| move || NoPayload { what, lacks };
        let at = |pc| Payload { pc, registers: [None; 3], sp: None, masked: false, reset: None, flips: None };
        let code = |mask: u16, pattern: u16| instruction(image, mask, pattern);
        Ok(match what {
            What::Hang | What::MaskedHang => {
                let (pc, _) = code(u16::MAX, BRANCH_TO_SELF).ok_or_else(lacks("a branch to itself"))?;
                Payload { masked: what == What::MaskedHang, ..at(pc) }
            }
            What::BusFault => at(NOWHERE),
            What::BrownOut => Payload { reset: Some(ResetCause::BrownOut), ..at(0) },
            What::PinReset => Payload { reset: Some(ResetCause::Pin), ..at(0) },
            What::Flip { address, bit } => Payload { flips: Some((address, 1_u8.rotate_left(bit))), ..at(0) },
            What::DataFault => {
                let (pc, load) = code(0xffc0, LOAD).ok_or_else(lacks("a load without an offset"))?;
                let base = (load >> 3 & 7) as u8;
                Payload { registers: [Some((base, NOWHERE)), None, None], ..at(pc) }
            }
            What::UsageFault => at(code(0xff00, UNDEFINED).ok_or_else(lacks("an undefined instruction"))?.0),
            What::StackOverflow => {
                let (pc, _) = code(0xff00, PUSH_LR).ok_or_else(lacks("a push"))?;
                let end = image.symbol(STACK_END).ok_or_else(lacks("the symbol _stack_end"))?;
                Payload { sp: Some(end.next_multiple_of(8)), ..at(pc) }
            }
            What::Panic => {
                let pc = PANICS.iter().find_map(|name| function(image, name));
                let pc = pc.ok_or_else(lacks("a panic function of core"))?;
                let location = location(image).ok_or_else(lacks("the location of a panic"))?;
                // It takes a message (two registers) and the location; the optimiser leaves out what the image's handler does
                // not look at, and the others move up. So there is no message, and the location is in all of them.
                Payload { registers: [0, 1, 2].map(|register| Some((register, location))), ..at(pc) }
            }
        })
    }
}

/// Address and contents of the first halfword in flash that is `pattern` where `mask` is set.
fn instruction(image: &Image, mask: u16, pattern: u16) -> Option<(u32, u16)> {
    let (halfwords, _) = image.flash().as_chunks();
    let mut halfwords = halfwords.iter().map(|half| u16::from_le_bytes(*half)).zip((FLASH_BASE..).step_by(2));
    // The vector table is no code.
    halfwords
        .find(|(half, at)| half & mask == pattern && *at >= FLASH_BASE + VECTORS)
        .map(|(half, at)| (at, half))
}

/// Bytes of the vector table: 16 exceptions and 82 interrupts.
const VECTORS: u32 = 4 * (16 + 82);

/// Address of the function of this (partly) mangled name, whatever its hash.
fn function(image: &Image, name: &str) -> Option<u32> {
    let is_it = |symbol: &str| {
        symbol.split_once(name).is_some_and(|(_, rest)| rest.is_empty() || rest.starts_with("17h"))
    };
    image.symbols().find(|(symbol, _)| is_it(symbol)).map(|(_, address)| address & !1)
}

/// Address of some `core::panic::Location` in the image: pointer to and length of a file's name, line and column.
fn location(image: &Image) -> Option<u32> {
    const EXTENSION: &[u8] = b".rs";
    const LONGEST: u32 = 256;
    let end = FLASH_BASE + image.flash().len() as u32;
    (FLASH_BASE..end.saturating_sub(16)).step_by(4).find(|at| {
        let word = |n: u32| image.word(at + 4 * n).unwrap_or(0);
        let [name, length, line, column] = [word(0), word(1), word(2), word(3)];
        let plausible =
            (4..LONGEST).contains(&length) && (1..100_000).contains(&line) && (1..1_000).contains(&column);
        plausible
            && image.bytes(name, length).is_some_and(|name| name.ends_with(EXTENSION) && name.is_ascii())
    })
}

impl fmt::Display for NoPayload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot be planted: the image does not contain {}", self.what, self.lacks)
    }
}

impl std::error::Error for NoPayload {}

//! The memories of both cores.
//!
//! | where | what |
//! |---|---|
//! | `TABLE` | vectors, and the handlers that they lead to; where the part has its system memory |
//! | `FLASH` | the code under test: a sequence, or the whole image |
//! | `RAM` | data and stack |
//! | `CCM` | the image's stack |

/// A stretch of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Its address.
    pub base: u32,
    /// Bytes.
    pub length: u32,
    /// It is RAM; else it is flash, and cannot be written.
    pub is_ram: bool,
}

/// Vectors and handlers.
pub const TABLE: Region = Region { base: 0x1FFF_0000, length: 0x1000, is_ram: false };
/// Flash for a sequence.
pub const SHORT_FLASH: Region = Region { base: 0x0800_0000, length: 0x1000, is_ram: false };
/// Flash of the part.
pub const FLASH: Region = Region { base: 0x0800_0000, length: 0x10_0000, is_ram: false };
/// RAM for a sequence.
pub const SHORT_RAM: Region = Region { base: 0x2000_0000, length: 0x2000, is_ram: true };
/// RAM of the part.
pub const RAM: Region = Region { base: 0x2000_0000, length: 0x2_0000, is_ram: true };
/// Core-coupled memory of the part.
pub const CCM: Region = Region { base: 0x1000_0000, length: 0x1_0000, is_ram: true };

/// Memories for a sequence.
pub const SHORT: [Region; 3] = [TABLE, SHORT_FLASH, SHORT_RAM];
/// Memories for the image.
pub const WHOLE: [Region; 4] = [TABLE, CCM, FLASH, RAM];

/// Vectors in the table.
const VECTORS: u32 = 16 + 16;
/// Where every exception but the interrupt leads, and where a function returns to: a branch to itself.
pub const STOP: u32 = TABLE.base + 0x400;
/// Where the interrupt leads.
pub const HANDLER: u32 = TABLE.base + 0x500;
/// The interrupt.
pub const INTERRUPT: u16 = 9;
/// Its number among the exceptions.
pub const INTERRUPT_EXCEPTION: u32 = 16 + INTERRUPT as u32;

/// A branch to itself.
const BRANCH_TO_ITSELF: u16 = 0xE7FE;
/// Uses an IT block, also to return from one: the emulators have to keep the state of the interrupted one apart.
const HANDLER_CODE: [u16; 6] = [
    0xB510, // push {r4, lr}
    0x2C00, // cmp r4, #0
    0xBF14, // ite ne
    0x2400, // movne r4, #0
    0x2401, // moveq r4, #1
    0xBF00, // nop
];
const RETURN_CODE: [u16; 4] = [
    0xE8BD, 0x4010, // pop.w {r4, lr}
    0xBF08, // it eq (the flags of the comparison)
    0x4770, // bxeq lr
];
/// Where the comparison was not equal.
const RETURN_OTHERWISE: u16 = 0x4770;

/// The contents of [`TABLE`].
pub fn table() -> Vec<u8> {
    let mut table = vec![0; TABLE.length as usize];
    for vector in 0..VECTORS {
        let entry = match vector {
            0 => SHORT_RAM.base + SHORT_RAM.length,
            INTERRUPT_EXCEPTION => HANDLER | 1,
            _ => STOP | 1,
        };
        put(&mut table, 4 * vector, &entry.to_le_bytes());
    }
    put(&mut table, STOP - TABLE.base, &BRANCH_TO_ITSELF.to_le_bytes());
    let code = HANDLER_CODE.iter().chain(&RETURN_CODE).chain([&RETURN_OTHERWISE]);
    for (offset, half) in (0..).step_by(2).zip(code) {
        put(&mut table, HANDLER - TABLE.base + offset, &half.to_le_bytes());
    }
    table
}

fn put(table: &mut [u8], at: u32, bytes: &[u8]) {
    table[at as usize..][..bytes.len()].copy_from_slice(bytes);
}

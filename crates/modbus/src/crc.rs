//! The checksum of an RTU frame: CRC-16 with the reflected polynomial 0xA001, beginning with 0xFFFF, low byte sent first.
//!
//! Source: MODBUS over Serial Line V1.02, section 2.5.1.2 and appendix B. Half a byte at a time: a table of 32 bytes, and
//! a quarter of the time that single bits take.

/// The checksum of no bytes.
pub const EMPTY: u16 = 0xFFFF;

/// The checksum over a frame and its own checksum.
pub const RESIDUE: u16 = 0;

const POLYNOMIAL: u16 = 0xA001;

/// What four bits that fall out of the register put back into it.
static NIBBLES: [u16; 16] = nibbles();

/// The checksum with one more byte.
pub fn with(crc: u16, byte: u8) -> u16 {
    let crc = crc ^ u16::from(byte);
    half(half(crc))
}

/// The checksum over these bytes.
pub fn over(bytes: &[u8]) -> u16 {
    bytes.iter().fold(EMPTY, |crc, &byte| with(crc, byte))
}

fn half(crc: u16) -> u16 {
    let out = usize::from(crc & 0xF);
    (crc >> 4) ^ NIBBLES.get(out).copied().unwrap_or(0)
}

#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
const fn nibbles() -> [u16; 16] {
    let mut table = [0; 16];
    let mut index = 0;
    while index < table.len() {
        let mut crc = index as u16;
        let mut bit = 0;
        while bit < 4 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ POLYNOMIAL } else { crc >> 1 };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}

//! The ISU's EEPROM: 256 words, four of which matter to users, spread over 32.
//!
//! Source: AN #201 §6 (tables 4 and 5) and §7.
//!
//! A data word is kept two bits at a time in the low ends of eight consecutive EEPROM words; the 14 bits
//! above belong to the manufacturer and must never change:
//!
//! ```text
//! EEPROM word      +0      +1      +2      +3      +4      +5      +6      +7
//! bits 1…0 hold   b7 b6   b5 b4   b3 b2   b1 b0  b15 b14 b13 b12 b11 b10  b9 b8
//! ```
//!
//! | start | data word |
//! |---|---|
//! | 48 | module address in b7…b4, the rest reserved |
//! | 50 | auto-shutoff in one bit, the rest reserved |
//! | 78 | checksum |
//! | D0 | null position, in 360/65536° |
//!
//! Table 4 is lost in the available copy. The order above follows from the surviving list under "Setting the
//! Module Address" and from its remark that words 48 and 49 hold the whole address.
//!
//! A module whose checksum is wrong after a reset is in its Hard Error state and useless until repaired.
//! Hence [`Plan`]: from a complete image and a wish to exactly the words to write, or a refusal.

mod image;
mod packing;
mod plan;

pub use image::{Audit, ChecksumReading, DataWord, Image};
pub use packing::{WORDS_PER_DATA_WORD, pack, unpack};
pub use plan::{Change, Plan, PlanError, PlannedWrite, ShutoffBit};

/// Runs of words that users may change, first and last: address and auto-shutoff, checksum, null position.
const DOCUMENTED: [(u8, u8); 3] = [(0x48, 0x57), (0x78, 0x7F), (0xD0, 0xD7)];

/// Whether the document names all of these words as changeable by the user.
pub(super) fn is_documented(start: u8, count: usize) -> bool {
    let end = usize::from(start).saturating_add(count);
    DOCUMENTED.iter().any(|&(first, last)| start >= first && end <= usize::from(last).saturating_add(1))
}

//! Where instructions begin. A trial ends where a jump leads elsewhere: what data or the second half of an instruction means is
//! often UNPREDICTABLE, and shows nothing of either core.

use std::collections::HashSet;

use super::layout::{STOP, TABLE};

/// The first of the upper five bits of a halfword that begins an instruction of two (ARM DDI 0403 A5.1).
const OF_TWO: u16 = 0x1D;

/// The instructions under test; the handlers are code, too.
pub struct Code(HashSet<u32>);

impl Code {
    /// Instructions one behind the other, in stretches: where each begins, and its halfwords.
    pub fn new(stretches: impl IntoIterator<Item = (u32, Vec<u16>)>) -> Code {
        let mut begins = HashSet::new();
        for (start, halves) in stretches {
            let mut halves = (start..).step_by(2).zip(halves);
            while let Some((address, half)) = halves.next() {
                begins.insert(address);
                if half >> 11 >= OF_TWO {
                    halves.next();
                }
            }
        }
        Code(begins)
    }

    /// Whether an instruction begins there.
    pub fn has(&self, address: u32) -> bool {
        (STOP..TABLE.base + TABLE.length).contains(&address) || self.0.contains(&address)
    }
}

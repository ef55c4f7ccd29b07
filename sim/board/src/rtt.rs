//! Reads the firmware's log through RTT: up-buffer 0 of the control block in target RAM.
//!
//! | Offset | Field of the control block |
//! |---|---|
//! | 0 | identifier "SEGGER RTT", zero padded to 16 bytes |
//! | 16 | number of up-buffers, number of down-buffers |
//! | 24 | up-buffer 0: name, buffer address, size, write offset, read offset, flags |
//!
//! The reader works like a debug probe: it takes the bytes between read and write offset and moves the read
//! offset up, so that firmware finds room again. It does so every millisecond, and before a reset.

use crate::timeline::{Actor, lock};
use clino_sim::node::Ns;
use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;
use std::sync::{Arc, Mutex};

/// Symbol of the control block.
pub(crate) const SYMBOL: &str = "_SEGGER_RTT";

const IDENTIFIER: &[u8; 10] = b"SEGGER RTT";
const UP_BUFFERS: u64 = 16;
const UP_0_ADDRESS: u64 = 24 + 4;
const UP_0_SIZE: u64 = 24 + 8;
const UP_0_WRITE: u64 = 24 + 12;
const UP_0_READ: u64 = 24 + 16;

/// Time between two looks at the ring.
const PERIOD: Ns = 1_000_000;

/// The host's end of up-buffer 0.
pub(crate) struct Reader {
    space: Arc<AddressSpace>,
    block: u64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    next_look: Ns,
    taken: Vec<u8>,
}

impl Reader {
    /// A reader of the control block at `block`.
    pub fn new(space: Arc<AddressSpace>, block: u32) -> Reader {
        Reader { space, block: u64::from(block), state: Mutex::default() }
    }

    /// The bytes taken over so far, leaving none.
    pub fn take(&self) -> Vec<u8> {
        std::mem::take(&mut lock(&self.state).taken)
    }

    /// Takes over what firmware has written since the last call.
    fn drain(&self) {
        let Some((address, size, write, read)) = self.ring() else { return };
        let mut state = lock(&self.state);
        let mut take = |from: u64, to: u64| {
            let mut bytes = vec![0; (to - from) as usize];
            if self.space.read_bytes(address + from, &mut bytes, MemAttrs::DEBUG).is_ok() {
                state.taken.extend(bytes);
            }
        };
        if read > write {
            take(read, size);
            take(0, write);
        } else {
            take(read, write);
        }
        // RAM takes the write; were it lost, the same bytes would come again and the frames would not decode.
        let _ = self.space.write(self.block + UP_0_READ, Width::U32, write, MemAttrs::DEBUG);
    }

    /// Address, size, write offset and read offset of the ring, once firmware has set it up and if there is
    /// something in it.
    fn ring(&self) -> Option<(u64, u64, u64, u64)> {
        let word = |offset| self.space.read(self.block + offset, Width::U32, MemAttrs::DEBUG).ok();
        let mut identifier = [0; IDENTIFIER.len()];
        self.space.read_bytes(self.block, &mut identifier, MemAttrs::DEBUG).ok()?;
        if &identifier != IDENTIFIER || word(UP_BUFFERS)? == 0 {
            return None;
        }
        let (address, size) = (word(UP_0_ADDRESS)?, word(UP_0_SIZE)?);
        let (write, read) = (word(UP_0_WRITE)?, word(UP_0_READ)?);
        (write < size && read < size && write != read).then_some((address, size, write, read))
    }
}

impl Actor for Reader {
    fn next_event(&self) -> Option<Ns> {
        Some(lock(&self.state).next_look)
    }

    fn act(&self, now: Ns) {
        lock(&self.state).next_look = now + PERIOD;
        self.drain();
    }

    fn resetting(&self) {
        self.drain();
    }
}

//! The independent watchdog as in the manual (RM0090 section 21), in front of the emulator's own.
//!
//! | What firmware does | The stock watchdog | The chip |
//! |---|---|---|
//! | accesses a register 16 bits wide | faults | takes it |
//! | starts it | counts from RLR | counts from 0xFFF |
//! | writes PR or RLR while the last write is being taken over (PVU, RVU) | takes it | ignores it |
//! | feeds it meanwhile | loads the new RLR | loads the old one |
//!
//! Taking over lasts five cycles of its oscillator. A new divider counts at once: that is up to 0.3 ms too soon.

use std::sync::{Arc, Mutex};

use rsemu::core::Result;
use rsemu::core::error::BusError;
use rsemu::core::space::{AccessConstraints, MemAttrs, MemOps, MemResult};
use rsemu::core::value::{Endian, Width};
use rsemu::machine::Instance;

use crate::timeline::lock;
use crate::wrapped::{Front, Wrapped};

/// The stock class that is wrapped.
pub(crate) const STOCK: &str = "st.iwdg";

/// Byte offsets.
mod offset {
    pub const KR: u64 = 0x0;
    pub const PR: u64 = 0x4;
    pub const RLR: u64 = 0x8;
    pub const SR: u64 = 0xc;
}

/// What is written to KR.
mod key {
    pub const FEED: u32 = 0xaaaa;
    pub const UNLOCK: u32 = 0x5555;
    pub const START: u32 = 0xcccc;
    /// Any other: locks.
    pub const LOCK: u32 = 0;
}

/// A write to PR, to RLR is being taken over.
const PVU: u32 = 1 << 0;
const RVU: u32 = 1 << 1;
/// RLR at reset, and where a watchdog that is started counts from.
const LONGEST: u32 = 0xfff;

/// The stock watchdog behind these rules.
///
/// # Errors
///
/// The watchdog has no registers.
pub(crate) fn ruled(stock: Arc<dyn Instance>) -> Result<Wrapped<Watchdog>> {
    Wrapped::new(stock, |registers| Watchdog { registers, reload: Mutex::new(Reload::default()) })
}

/// Registers in front of the stock watchdog's.
pub(crate) struct Watchdog {
    registers: Arc<dyn MemOps>,
    reload: Mutex<Reload>,
}

/// What firmware has made of RLR.
#[derive(Debug)]
struct Reload {
    started: bool,
    written: u32,
    /// What it was before that.
    before: u32,
}

impl Default for Reload {
    fn default() -> Reload {
        Reload { started: false, written: LONGEST, before: LONGEST }
    }
}

impl Watchdog {
    fn get(&self, offset: u64, attrs: MemAttrs) -> core::result::Result<u32, BusError> {
        let mut word = [0; 4];
        self.registers.read(offset, &mut word, attrs)?;
        Ok(u32::from_le_bytes(word))
    }

    fn set(&self, offset: u64, value: u32, attrs: MemAttrs) -> MemResult {
        self.registers.write(offset, &value.to_le_bytes(), attrs)
    }

    /// Writes a key that loads the counter, with this to be loaded.
    fn load(&self, key: u32, counter: u32, reload: &Reload, attrs: MemAttrs) -> MemResult {
        if counter == reload.written {
            return self.set(offset::KR, key, attrs);
        }
        for (offset, value) in [
            (offset::KR, key::UNLOCK),
            (offset::RLR, counter),
            (offset::KR, key),
            (offset::KR, key::UNLOCK),
            (offset::RLR, reload.written),
            (offset::KR, key::LOCK),
        ] {
            self.set(offset, value, attrs)?;
        }
        Ok(())
    }
}

impl std::fmt::Debug for Watchdog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watchdog").field("reload", &*lock(&self.reload)).finish_non_exhaustive()
    }
}

impl Front for Watchdog {
    fn reset(&self) {
        *lock(&self.reload) = Reload::default();
    }
}

impl MemOps for Watchdog {
    fn read(&self, offset: u64, dst: &mut [u8], attrs: MemAttrs) -> MemResult {
        let word = self.get(offset & !3, attrs)?.to_le_bytes();
        let bytes = word.get((offset & 3) as usize..).ok_or(BusError::BadAccess)?;
        for (dst, byte) in dst.iter_mut().zip(bytes) {
            *dst = *byte;
        }
        Ok(())
    }

    fn write(&self, offset: u64, src: &[u8], attrs: MemAttrs) -> MemResult {
        if offset & 3 != 0 {
            return Err(BusError::BadAccess);
        }
        let mut word = [0; 4];
        for (byte, src) in word.iter_mut().zip(src) {
            *byte = *src;
        }
        let value = u32::from_le_bytes(word);
        let busy = self.get(offset::SR, attrs)?;
        let mut reload = lock(&self.reload);
        match (offset, value) {
            (offset::PR, _) if busy & PVU != 0 => Ok(()),
            (offset::RLR, _) if busy & RVU != 0 => Ok(()),
            (offset::RLR, _) => {
                self.set(offset, value, attrs)?;
                // Firmware that had not unlocked it has changed nothing.
                let now = self.get(offset::RLR, attrs)?;
                if self.get(offset::SR, attrs)? & RVU != 0 {
                    *reload = Reload { written: now, before: reload.written, ..*reload };
                }
                Ok(())
            }
            (offset::KR, key::START) if !reload.started => {
                reload.started = true;
                self.load(key::START, LONGEST, &reload, attrs)
            }
            (offset::KR, key::FEED) => {
                let counter = if busy & RVU != 0 { reload.before } else { reload.written };
                self.load(key::FEED, counter, &reload, attrs)
            }
            _ => self.set(offset, value, attrs),
        }
    }

    fn constraints(&self) -> AccessConstraints {
        AccessConstraints::word(Width::U32, Endian::Little).with_widths(Width::U16, Width::U32)
    }
}

#[cfg(test)]
mod tests;

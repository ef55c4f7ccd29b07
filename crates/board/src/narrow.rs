//! Lets firmware use a stock peripheral's 32-bit registers as the 16-bit ones they are declared to be.
//!
//! The chip's bus widens an 8 or 16-bit access; the stock watchdog takes 32 bits only and would fault. Its front
//! here widens the accesses (RM0090 §21.4: "accessed by half-words (16 bits) or words").

use std::sync::Arc;

use rsemu::core::Result;
use rsemu::core::error::BusError;
use rsemu::core::space::{AccessConstraints, MemAttrs, MemOps, MemResult};
use rsemu::core::value::{Endian, Width};
use rsemu::machine::Instance;

use crate::wrapped::{Front, Wrapped};

/// The stock class that is wrapped: the independent watchdog.
pub(crate) const STOCK: &str = "st.iwdg";

/// The stock watchdog with registers that take 16-bit accesses.
///
/// # Errors
///
/// The watchdog has no registers.
pub(crate) fn widened(stock: Arc<dyn Instance>) -> Result<Wrapped<Widened>> {
    Wrapped::new(stock, Widened)
}

/// 32-bit registers that take 16-bit accesses.
#[derive(Debug)]
pub(crate) struct Widened(Arc<dyn MemOps>);

impl Front for Widened {}

impl MemOps for Widened {
    fn read(&self, offset: u64, dst: &mut [u8], attrs: MemAttrs) -> MemResult {
        let mut word = [0; 4];
        self.0.read(offset & !3, &mut word, attrs)?;
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
        self.0.write(offset, &word, attrs)
    }

    fn constraints(&self) -> AccessConstraints {
        AccessConstraints::word(Width::U32, Endian::Little).with_widths(Width::U16, Width::U32)
    }
}

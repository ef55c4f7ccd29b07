//! The level of a line over time, as a logic analyser records it: every change with its instant.
//!
//! It is recorded only on request ([`crate::Segment::trace`]): a busy line changes ten thousand times a
//! second. Instants are whole nanoseconds; two changes within one of them are both kept.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clino_sim::node::Ns;

use crate::wire::Sent;

/// A line that idles high, and each change of its level since power-up.
#[derive(Clone, Debug, Default)]
pub struct Trace(Arc<Mutex<Vec<(Ns, bool)>>>);

impl Trace {
    /// The changes so far, in order: the instant and the level from then on.
    pub fn changes(&self) -> Vec<(Ns, bool)> {
        self.lock().clone()
    }

    /// The level from `at` on, which is not before the last one noted.
    pub fn note(&self, at: Ns, high: bool) {
        let mut changes = self.lock();
        if changes.last().is_none_or(|&(_, last)| last != high) {
            changes.push((at, high));
        }
    }

    /// A whole character on a line without a driver enable, from the start bit to the stop bit.
    pub fn note_character(&self, sent: &Sent) {
        let at = |bit: u64| sent.start + bit * sent.format.bit_ps / 1_000;
        self.note(sent.start, false);
        for bit in 0..sent.format.data_bits {
            self.note(at(1 + u64::from(bit)), sent.word >> bit & 1 == 1);
        }
        self.note(at(1 + u64::from(sent.format.data_bits)), true);
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(Ns, bool)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Format;

    #[test]
    fn a_character_is_its_edges() {
        let trace = Trace::default();
        let format = Format { bit_ps: 1_000_000, data_bits: 8, stop_halves: 2 };
        trace.note_character(&Sent { start: 5_000, word: 0b1100_0001, format });
        // Start bit low, bit 0 high, bits 1 to 5 low, bits 6, 7 and the stop bit high.
        assert_eq!(trace.changes(), [(5_000, false), (6_000, true), (7_000, false), (12_000, true)]);
    }
}

//! Pauses within the bytes of a far end: a USB adapter forwards its data in pieces, once in a frame of its bus (1 ms).

use clino_sim::node::Ns;

/// A pause of the sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Index of the byte that comes after it, counted from 0 within what is sent at once.
    pub before: usize,
    /// From the end of the byte before.
    pub length: Ns,
}

/// A byte that waits to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Waiting {
    /// Its earliest start bit,
    pub at: Ns,
    /// which is this long after the end of the byte before, at least.
    pub gap: Ns,
    /// The byte.
    pub byte: u8,
}

impl Waiting {
    /// Its start bit, given that the line is free from `free_from` on.
    pub fn start(self, free_from: Ns) -> Ns {
        self.at.max(free_from.saturating_add(self.gap))
    }
}

/// These bytes from `at` on, with these pauses between them.
pub(crate) fn waiting(at: Ns, bytes: &[u8], gaps: &[Gap]) -> impl Iterator<Item = Waiting> {
    let gap = |index| gaps.iter().filter(|gap| gap.before == index).map(|gap| gap.length).sum();
    bytes.iter().enumerate().map(move |(index, &byte)| Waiting { at, gap: gap(index), byte })
}

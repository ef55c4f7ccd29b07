//! A character as the port hands it to the console: the byte, and everything the port knows against it.

use clino_codec::character::LineErrors;

/// Ctrl-C.
pub const INTERRUPT: u8 = 0x03;

/// A received character.
///
/// A port that loses characters (its queue is full, the receiver overruns) tells so with the next one it delivers, so that
/// the loss keeps its place in the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The data bits as sampled.
    pub byte: u8,
    /// What the receiver reported while it sampled them.
    pub errors: LineErrors,
    /// Characters lost between the previous one and this one; 255 stands for more, too.
    pub lost: u8,
}

impl Received {
    /// A character received without error, and none lost before it.
    pub const fn clean(byte: u8) -> Received {
        Received { byte, errors: LineErrors::NONE, lost: 0 }
    }

    /// Whether it is Ctrl-C.
    pub const fn is_interrupt(&self) -> bool {
        self.byte == INTERRUPT && self.errors.is_none()
    }
}

//! A character as the port hands it to the console: the byte, and what the port knows against it.

/// Ctrl-C.
pub const INTERRUPT: u8 = 0x03;

/// A received character. 2 bytes: a port keeps many of them.
///
/// A port that loses characters (its queue is full, the receiver overruns) tells so with the next one it delivers, so that
/// the loss keeps its place in the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The data bits as sampled.
    pub byte: u8,
    /// Bit 7: [`Received::is_flawed`]; below it [`Received::lost`].
    against: u8,
}

/// The receiver has reported an error.
const FLAWED: u8 = 1 << 7;

impl Received {
    /// The most characters that count as lost.
    pub const MOST_LOST: u8 = FLAWED - 1;

    /// A character. `is_flawed`: the receiver has reported an error while it sampled it. `lost`: characters lost between the
    /// previous one and this one; [`Received::MOST_LOST`] stands for more, too.
    pub const fn new(byte: u8, is_flawed: bool, lost: u8) -> Received {
        let lost = if lost < Received::MOST_LOST { lost } else { Received::MOST_LOST };
        Received { byte, against: lost | if is_flawed { FLAWED } else { 0 } }
    }

    /// A character received without error, and none lost before it.
    pub const fn clean(byte: u8) -> Received {
        Received { byte, against: 0 }
    }

    /// Whether the receiver has reported an error. Which one makes no difference to the console.
    pub const fn is_flawed(self) -> bool {
        self.against & FLAWED != 0
    }

    /// Characters lost before it.
    pub const fn lost(self) -> u8 {
        self.against & !FLAWED
    }

    /// Whether it is Ctrl-C.
    pub const fn is_interrupt(self) -> bool {
        self.byte == INTERRUPT && !self.is_flawed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_against_a_character_is_kept() {
        for (byte, is_flawed) in
            [(b'a', false), (b'a', true), (INTERRUPT, false), (INTERRUPT, true), (0xFF, true)]
        {
            for lost in 0..=u8::MAX {
                let received = Received::new(byte, is_flawed, lost);
                assert_eq!((received.byte, received.is_flawed()), (byte, is_flawed));
                assert_eq!(received.lost(), lost.min(127));
                assert_eq!(received.is_interrupt(), byte == 3 && !is_flawed);
                assert_eq!(received == Received::clean(byte), !is_flawed && lost == 0);
            }
        }
        assert_eq!(size_of::<Received>(), 2);
    }
}

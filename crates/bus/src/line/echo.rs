//! The echo: our own characters, received again.
//!
//! Time decides what is an echo, not the value, so that no answer is removed: while a frame goes out, and until half
//! a character after its last stop bit, no node can have sent a whole character in answer to it. Only in that time is
//! a character counted as echo, and never more of them than were sent; a later character is heard, even if it looks
//! exactly like the end of our frame.
//!
//! In that time, where an echo is known to be there, the n-th character heard has to be the n-th one sent, without a
//! receiver error; any other character comes from another transmitter. Where it is not known, characters that fit are
//! counted as echo, and others are heard.

use clino_codec::character::Character;

use super::EchoMode;

/// The source of a character heard while the echo is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EchoVerdict {
    /// Ours.
    Own,
    /// Ours, damaged: another node transmits.
    Contention,
    /// From another node.
    Foreign,
}

/// Follows the echo of one frame after another.
#[derive(Debug)]
pub struct EchoTracker {
    mode: EchoMode,
    /// Whether our characters come back, as far as is known.
    present: Option<bool>,
    /// A frame is out or on its way, and not all of it has come back.
    open: bool,
    /// Characters of it that came back.
    returned: usize,
    /// Everything heard since it began was ours.
    intact: bool,
}

impl EchoTracker {
    /// What is known of a line that is set like this.
    pub const fn new(mode: EchoMode) -> EchoTracker {
        let present = match mode {
            EchoMode::Off => Some(false),
            EchoMode::Expected => Some(true),
            EchoMode::Detect => None,
        };
        EchoTracker { mode, present, open: false, returned: 0, intact: true }
    }

    /// What is known about the echo of this line.
    pub fn present(&self) -> Option<bool> {
        self.present
    }

    /// A frame begins.
    pub fn begin(&mut self) {
        self.open = self.mode != EchoMode::Off;
        self.returned = 0;
        self.intact = true;
    }

    /// Whether some of the frame has come back, and not yet all.
    pub fn is_coming_back(&self) -> bool {
        self.open && self.returned != 0
    }

    /// Whether characters of an echo that is known to be there are missing.
    pub fn is_missed(&self) -> bool {
        self.open && self.present == Some(true)
    }

    /// Judges a character heard in the echo's time. Of `frame`, the first `sent` characters are out or on their way.
    pub fn judge(&mut self, character: Character, frame: &[u8], sent: usize) -> EchoVerdict {
        let sent = frame.get(..sent).unwrap_or(frame);
        let Some(&expected) = sent.get(self.returned).filter(|_| self.open) else {
            return EchoVerdict::Foreign;
        };
        let fits = character.byte == expected && character.errors.is_none();
        let known = self.present == Some(true);
        self.intact &= fits;
        if fits || known {
            self.returned = self.returned.saturating_add(1);
            self.open = self.returned < frame.len();
            if !self.open && self.intact {
                self.present = Some(true);
            }
        }
        match (fits, known) {
            (true, _) => EchoVerdict::Own,
            (false, true) => EchoVerdict::Contention,
            (false, false) => EchoVerdict::Foreign,
        }
    }

    /// The echo's time is over: whether a part of it that should have come is missing.
    pub fn end(&mut self) -> bool {
        if !core::mem::replace(&mut self.open, false) {
            return false;
        }
        let nothing = self.returned == 0 && self.intact;
        if self.mode == EchoMode::Detect && nothing {
            self.present = Some(false);
            return false;
        }
        self.present == Some(true)
    }
}

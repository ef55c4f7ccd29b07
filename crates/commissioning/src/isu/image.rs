//! Reading the whole EEPROM, and what a setting is in it.

use clino_codec::isu::eeprom::{Change, DataWord, Image};
use clino_codec::isu::{Request, Words};

/// Words in the EEPROM.
const WORDS: u16 = 256;

/// Words in one exchange: its 36-character answer is well below the longest that the bus layer waits for (68), and
/// short enough that one damaged character costs little.
const CHUNK: u8 = 16;

/// Reads the EEPROM in order.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    pub image: Image,
    /// First word not yet read.
    next: u16,
}

impl Reader {
    /// Exchanges that it takes.
    pub const EXCHANGES: u16 = WORDS / CHUNK as u16;

    // It is large: inlined, with what holds it, it is made where it stays, and takes no stack on its way there.
    #[inline(always)]
    pub const fn new() -> Reader {
        Reader { image: Image::new([0; WORDS as usize]), next: 0 }
    }

    /// Begins anew.
    pub fn restart(&mut self) {
        self.next = 0;
    }

    /// What to ask next; `None` when all is read.
    pub fn request(&self) -> Option<Request> {
        // Below 256 it fits a byte.
        u8::try_from(self.next).ok().map(|start| Request::ReadEeprom { start, count: CHUNK })
    }

    /// Takes the answer to [`request`](Self::request).
    pub fn take(&mut self, start: u8, words: &Words) {
        if u16::from(start) == self.next {
            self.image.fill(start, words.iter());
            self.next = self.next.saturating_add(u16::from(CHUNK));
        }
    }

    /// Exchanges done.
    pub fn done(&self) -> u16 {
        self.next.checked_div(u16::from(CHUNK)).unwrap_or(0)
    }
}

/// The setting that `change` is about, as it is in the image.
pub(super) fn present(image: &Image, change: Change) -> Change {
    match change {
        Change::ModuleAddress(_) => Change::ModuleAddress(image.module_address()),
        Change::NullPosition(_) => Change::NullPosition(image.data(DataWord::NullPosition)),
        Change::AutoShutoff { bit, .. } => {
            let data = image.data(DataWord::AutoShutoff);
            Change::AutoShutoff { bit, enabled: data >> (bit as u8) & 1 == 1 }
        }
    }
}

/// Where it is kept.
pub(super) const fn place(change: Change) -> DataWord {
    match change {
        Change::ModuleAddress(_) => DataWord::ModuleAddress,
        Change::NullPosition(_) => DataWord::NullPosition,
        Change::AutoShutoff { .. } => DataWord::AutoShutoff,
    }
}

//! Numbers into bytes and back, and the checksum of a record.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};

use clino_gateway::order::Refusal;

use super::{CRC, Reject};

/// The polynomial of IEEE 802.3. It is not that which `sequential-storage` guards its items with (Castagnoli): what one of
/// them cannot see, the other can. It finds every error of up to three bits in a record, and every burst of up to 32.
/// Bit by bit: a record is checked once a boot, a table would be larger than it.
pub(crate) static CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Takes a record byte by byte.
pub(crate) trait Sink {
    /// The next byte.
    fn put(&mut self, byte: u8);
}

/// Puts a record into a buffer.
pub(crate) struct Fill<'a> {
    free: core::slice::IterMut<'a, u8>,
    fits: bool,
}

impl<'a> Fill<'a> {
    pub fn new(buffer: &'a mut [u8]) -> Fill<'a> {
        Fill { free: buffer.iter_mut(), fits: true }
    }

    /// Bytes that are left, if all fitted.
    pub fn left(&self) -> Option<usize> {
        self.fits.then_some(self.free.len())
    }
}

impl Sink for Fill<'_> {
    fn put(&mut self, byte: u8) {
        match self.free.next() {
            Some(place) => *place = byte,
            None => self.fits = false,
        }
    }
}

/// Compares a record with a stored one.
pub(crate) struct Compare<'a> {
    stored: core::slice::Iter<'a, u8>,
    same: bool,
}

impl<'a> Compare<'a> {
    pub fn new(stored: &'a [u8]) -> Compare<'a> {
        Compare { stored: stored.iter(), same: true }
    }

    /// Whether it is the same, to the last byte.
    pub fn same(&self) -> bool {
        self.same && self.stored.len() == 0
    }
}

impl Sink for Compare<'_> {
    fn put(&mut self, byte: u8) {
        self.same &= self.stored.next() == Some(&byte);
    }
}

/// Writes numbers, and the checksum of all of them.
pub(crate) struct Writer<'a> {
    sink: &'a mut dyn Sink,
    crc: Digest<'static, u32, NoTable>,
}

impl<'a> Writer<'a> {
    pub fn new(sink: &'a mut dyn Sink) -> Writer<'a> {
        Writer { sink, crc: CHECKSUM.digest() }
    }

    /// Once in the image, and not at each of its calls: the checksum is a loop.
    #[inline(never)]
    pub fn byte(&mut self, byte: u8) {
        self.crc.update(&[byte]);
        self.sink.put(byte);
    }

    #[inline(never)]
    pub fn wide(&mut self, mut value: u64) {
        while value > 0x7F {
            self.byte(value as u8 | 0x80);
            value >>= 7;
        }
        self.byte(value as u8);
    }

    pub fn finish(self) {
        self.crc.finalize().to_le_bytes().iter().for_each(|byte| self.sink.put(*byte));
    }
}

/// Reads numbers. Once something is wrong it says why, and every reader of parts returns `None`: an error is larger than
/// what it is passed through.
pub(crate) struct Reader<'a> {
    left: core::slice::Iter<'a, u8>,
    reject: Option<Reject>,
}

/// Bytes of the longest number of 32 bits.
const LONGEST_NUMBER: usize = 5;
/// Bytes of the longest number of 64 bits.
pub(crate) const LONGEST_WIDE: usize = 10;
const _: () = assert!(CRC == size_of::<u32>());

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Reader<'a> {
        Reader { left: bytes.iter(), reject: None }
    }

    /// What is wrong.
    pub fn reject(&self) -> Reject {
        self.reject.unwrap_or(Reject::Short)
    }

    /// This is wrong.
    #[inline(never)]
    pub fn refuse<T>(&mut self, reject: Reject) -> Option<T> {
        self.reject = Some(reject);
        None
    }

    /// Goes on if the gateway accepts it.
    #[inline(never)]
    pub fn accepted(&mut self, checked: Result<(), Refusal>) -> Option<()> {
        match checked {
            Ok(()) => Some(()),
            Err(refusal) => self.refuse(Reject::Refused(refusal)),
        }
    }

    pub fn byte(&mut self) -> Option<u8> {
        // That it ends is what is wrong if nothing else is.
        self.left.next().copied()
    }

    /// A number of 64 bits.
    pub fn wide(&mut self, what: &'static str) -> Option<u64> {
        self.leb128(LONGEST_WIDE, what)
    }

    /// A number of 32 bits.
    pub fn number(&mut self, what: &'static str) -> Option<u32> {
        self.at_most(u32::MAX, what)
    }

    /// A number of 16 bits.
    pub fn short(&mut self, what: &'static str) -> Option<u16> {
        self.at_most(u16::MAX.into(), what).map(|number| number as u16)
    }

    /// A number of 32 bits, zigzag.
    pub fn signed(&mut self, what: &'static str) -> Option<i32> {
        let value = self.number(what)?;
        Some((value >> 1) as i32 ^ ((value & 1) as i32).wrapping_neg())
    }

    #[inline(never)]
    fn at_most(&mut self, most: u32, what: &'static str) -> Option<u32> {
        let value = self.leb128(LONGEST_NUMBER, what)?;
        match u32::try_from(value) {
            Ok(value) if value <= most => Some(value),
            _ => self.refuse(Reject::Number { what }),
        }
    }

    #[inline(never)]
    fn leb128(&mut self, longest: usize, what: &'static str) -> Option<u64> {
        let mut value = 0_u64;
        for place in 0..longest as u32 {
            let byte = self.byte()?;
            let (bits, at) = (u64::from(byte & 0x7F), place.saturating_mul(7));
            let placed = bits.wrapping_shl(at);
            if placed >> at != bits {
                break;
            }
            value |= placed;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        self.refuse(Reject::Number { what })
    }

    /// Nothing may be left.
    pub fn end(&mut self) -> Option<()> {
        match self.left.len() {
            0 => Some(()),
            left => self.refuse(Reject::Surplus(u16::try_from(left).unwrap_or(u16::MAX))),
        }
    }
}

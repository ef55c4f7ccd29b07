//! Big-endian fields in and out of a message, without an index that could miss.
//!
//! Messages have fixed layouts whose length is checked once, before the first field is read. Past the end zeros are read,
//! because a codec must not be able to panic: a message is read as one of a longer kind, and what it does not have is not used.

/// Reads fields from the front.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// A field of bytes.
    pub(crate) fn array<const N: usize>(&mut self) -> [u8; N] {
        let Some((field, rest)) = self.0.split_first_chunk() else { return [0; N] };
        self.0 = rest;
        *field
    }

    pub(crate) fn u8(&mut self) -> u8 {
        self.number(1) as u8
    }

    pub(crate) fn u16(&mut self) -> u16 {
        self.number(2) as u16
    }

    pub(crate) fn i16(&mut self) -> i16 {
        self.number(2) as i16
    }

    pub(crate) fn u32(&mut self) -> u32 {
        self.number(4)
    }

    pub(crate) fn i32(&mut self) -> i32 {
        self.number(4) as i32
    }

    /// A field of at most four bytes. One function for all of them: what is read all day does not come this way.
    #[inline(never)]
    fn number(&mut self, width: usize) -> u32 {
        let Some((field, rest)) = self.0.split_at_checked(width) else { return 0 };
        self.0 = rest;
        field.iter().fold(0, |number, &byte| number << u8::BITS | u32::from(byte))
    }
}

/// Puts fields at the front.
pub(crate) struct Writer<'a>(&'a mut [u8]);

impl<'a> Writer<'a> {
    pub(crate) const fn new(bytes: &'a mut [u8]) -> Self {
        Self(bytes)
    }

    #[inline(always)]
    pub(crate) fn put<const N: usize>(&mut self, field: [u8; N]) {
        if let Some((place, rest)) = core::mem::take(&mut self.0).split_first_chunk_mut() {
            *place = field;
            self.0 = rest;
        }
    }
}

/// A message under construction; `N` is the longest there is, so that it never overflows.
#[derive(Clone, Copy)]
pub(crate) struct Buffer<const N: usize> {
    bytes: [u8; N],
    length: usize,
}

impl<const N: usize> Buffer<N> {
    pub(crate) const fn new() -> Self {
        Self { bytes: [0; N], length: 0 }
    }

    /// As many of these bytes as fit.
    pub(crate) fn first(field: &[u8]) -> Self {
        let bytes = core::array::from_fn(|index| field.get(index).copied().unwrap_or(0));
        Self { bytes, length: field.len().min(N) }
    }

    pub(crate) fn push(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length = self.length.wrapping_add(1);
        }
    }

    pub(crate) fn extend(&mut self, field: &[u8]) {
        field.iter().for_each(|&byte| self.push(byte));
    }

    pub(crate) fn as_slice(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&[])
    }
}

/// Puts a value in its place, if there is one.
#[inline]
pub(crate) fn put<T>(items: &mut [T], index: usize, value: T) {
    if let Some(slot) = items.get_mut(index) {
        *slot = value;
    }
}

/// Low byte of the plain sum.
pub(crate) fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, &byte| sum.wrapping_add(byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_big_endian_and_zero_past_the_end() {
        let mut reader = Reader::new(&[0x01, 0xFF, 0xFE, 0x80, 0, 0, 0, 0x12, 0x34]);
        assert_eq!(reader.u8(), 1);
        assert_eq!(reader.i16(), -2);
        assert_eq!(reader.i32(), i32::MIN);
        assert_eq!(reader.u16(), 0x1234);
        assert_eq!(reader.u32(), 0);
        assert_eq!(reader.u8(), 0);
    }

    #[test]
    fn the_sum_is_that_of_single_bytes() {
        let bytes: std::vec::Vec<u8> =
            (0..=255).map(|index: u8| index.wrapping_mul(37).wrapping_add(211)).collect();
        for start in 0..9 {
            for end in start..bytes.len() {
                let slow: u32 = bytes[start..end].iter().map(|&byte| u32::from(byte)).sum();
                assert_eq!(u32::from(sum(&bytes[start..end])), slow % 256);
            }
        }
        assert_eq!(sum(&[0xFF; 2_048]), 0);
    }

    #[test]
    fn what_has_no_place_is_not_put() {
        let mut items = [1, 2];
        put(&mut items, 1, 3);
        put(&mut items, 2, 4);
        assert_eq!(items, [1, 3]);
    }

    #[test]
    fn a_full_buffer_stays_as_it_is() {
        let mut buffer = Buffer::<2>::new();
        buffer.extend(&[1, 2, 3]);
        assert_eq!(buffer.as_slice(), [1, 2]);
    }
}

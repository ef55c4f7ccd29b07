//! Memory that the second emulator's core reaches by pointer.
#![expect(unsafe_code, reason = "the core keeps pointers into it, as its documentation asks")]

use std::ptr;

/// The emulator's pages.
const PAGE: usize = 4096;

#[derive(Clone)]
#[repr(C, align(4096))]
struct Page([u8; PAGE]);

/// Whole pages at a place that does not move.
///
/// Only this module touches the bytes, by copies, and never while the core runs: the core is called through `&mut`, and
/// so is everything here.
pub struct Pages {
    first: *mut Page,
    count: usize,
}

impl Pages {
    /// Pages for `length` bytes of zeros.
    pub fn new(length: usize) -> Pages {
        let count = length.div_ceil(PAGE);
        let pages = vec![Page([0; PAGE]); count].into_boxed_slice();
        Pages { first: Box::into_raw(pages).cast(), count }
    }

    /// Bytes in it.
    pub fn len(&self) -> usize {
        self.count * PAGE
    }

    /// For the core.
    pub fn pointer(&self) -> *mut u8 {
        self.first.cast()
    }

    /// Copies `bytes` to `at`.
    pub fn write(&mut self, at: usize, bytes: &[u8]) {
        assert!(at + bytes.len() <= self.len());
        // SAFETY: inside the pages, which `bytes` cannot overlap: nothing hands out a reference to them.
        unsafe { ptr::copy_nonoverlapping(bytes.as_ptr(), self.pointer().add(at), bytes.len()) };
    }

    /// Copies out what begins at `at`.
    pub fn read(&self, at: usize, into: &mut [u8]) {
        assert!(at + into.len() <= self.len());
        // SAFETY: as in `write`.
        unsafe { ptr::copy_nonoverlapping(self.pointer().add(at), into.as_mut_ptr(), into.len()) };
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: made by `Box::into_raw` of a slice of this length, and freed once.
        drop(unsafe { Box::from_raw(ptr::slice_from_raw_parts_mut(self.first, self.count)) });
    }
}

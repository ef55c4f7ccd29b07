//! A value that several levels share, without holding off the levels above.
//!
//! Whoever wants it masks the interrupts of all levels that share it, and no others: the core's BASEPRI register holds off
//! everything of that priority and below (PM0214 section 2.1.3), while characters and edges go on. This is the priority
//! ceiling protocol: no deadlock, and a level waits for at most one look of a lower one.
//!
//! Limits: what is done with the value has to be short, for the bus level waits for it.

use core::cell::{Cell, UnsafeCell};
use core::mem::MaybeUninit;
use core::ptr;
use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::register::{basepri, basepri_max};

/// A value shared by levels of at most this priority, as the part's registers hold it.
pub struct Ceiling<T, const PRIORITY: u8> {
    /// Somebody has it.
    taken: Cell<bool>,
    /// The value is there. Beside it, not around it, so that nothing of it is stored in flash to begin with.
    full: Cell<bool>,
    value: UnsafeCell<MaybeUninit<T>>,
}

// SAFETY: the value is only reached through `with`, which keeps everybody else who may call it off meanwhile; `T` goes from
// level to level, so it has to be `Send`.
unsafe impl<T: Send, const PRIORITY: u8> Sync for Ceiling<T, PRIORITY> {}

impl<T, const PRIORITY: u8> Ceiling<T, PRIORITY> {
    /// Nothing yet.
    pub const fn new() -> Self {
        Ceiling {
            taken: Cell::new(false),
            full: Cell::new(false),
            value: UnsafeCell::new(MaybeUninit::uninit()),
        }
    }

    /// Has the value written into its place, once. By whoever makes it: what a function returns would be on the stack first.
    /// What it hands back is the proof that it has.
    #[inline(always)]
    pub fn fill(&self, make: impl FnOnce(&mut MaybeUninit<T>) -> &mut T) {
        self.hold(|place| {
            if !self.full.get() {
                let there = place.as_ptr();
                let made = ptr::from_mut(make(place)).cast_const();
                self.full.set(ptr::eq(made, there));
            }
        });
    }

    /// Lends the value; `None` before it is there. A level above the ceiling gets nothing, nor does who has it already.
    pub fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> Option<R> {
        self.hold(|place| {
            // SAFETY: `full` says that the value was written.
            self.full.get().then(|| work(unsafe { place.assume_init_mut() }))
        })
        .flatten()
    }

    fn hold<R>(&self, work: impl FnOnce(&mut MaybeUninit<T>) -> R) -> Option<R> {
        let before = basepri::read();
        basepri_max::write(PRIORITY);
        // Nothing that is done with the value may be done earlier, or later than the mask is lifted.
        compiler_fence(Ordering::SeqCst);
        // A level above the ceiling is not held off by it, and may have interrupted somebody who has the value.
        let free = !self.taken.replace(true);
        let result = free.then(|| {
            // SAFETY: `taken` was false, so nobody has the value, and with it true nobody else gets here until it is false.
            let result = work(unsafe { &mut *self.value.get() });
            self.taken.set(false);
            result
        });
        compiler_fence(Ordering::SeqCst);
        // SAFETY: what was there before is put back; it is the mask of the same level.
        unsafe { basepri::write(before) };
        result
    }
}

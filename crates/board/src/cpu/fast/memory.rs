//! The memories that an instruction may touch without anybody noticing: RAM, and flash for reading.
//!
//! They are the emulator's own stores, found in its address map; whatever else is at an address is left to it.

use std::sync::Arc;

use rsemu::core::space::{AddressSpace, FlatEntry, FlatTarget, RamStore};
use rsemu::core::value::{Endian, Width};

/// A stretch of addresses that one store answers.
struct Window {
    start: u32,
    length: u32,
    /// Where in the store it begins.
    offset: u32,
    store: Arc<RamStore>,
}

impl Window {
    /// The window of an entry of the address map, if plain memory answers reads there.
    fn of(entry: &FlatEntry) -> Option<Window> {
        let leaf = entry.leaf().filter(|leaf| !leaf.is_rebasable() && leaf.period().is_none())?;
        let FlatTarget::Ram(store) = leaf.target() else { return None };
        if leaf.constraints().endian != Endian::Little {
            return None;
        }
        let start = u32::try_from(entry.start()).ok()?;
        let length = u32::try_from(entry.len()).ok()?;
        let offset = u32::try_from(leaf.offset()).ok()?;
        Some(Window { start, length, offset, store: Arc::clone(store) })
    }

    /// Where in the store `bytes` bytes at `address` are.
    #[inline]
    fn at(&self, address: u32, bytes: u32) -> Option<u64> {
        let inside = address.wrapping_sub(self.start);
        (inside < self.length && self.length - inside >= bytes).then(|| u64::from(self.offset + inside))
    }
}

/// The memories of the board.
#[derive(Default)]
pub struct Memory {
    /// The emulator's count of changes to its address map.
    generation: Option<u64>,
    /// Read and written; none is longer than a sixteenth of the address space.
    ram: Vec<Window>,
    /// Read, and executed from.
    flash: Option<Window>,
}

impl Memory {
    /// Follows the address map of `space`; returns whether it has changed.
    #[inline]
    pub fn follow(&mut self, space: &AddressSpace) -> bool {
        if self.generation == Some(space.generation()) {
            return false;
        }
        self.generation = Some(space.generation());
        let view = space.view();
        let entries = view.flat_view().entries();
        let ram = |entry: &&FlatEntry| entry.is_direct_ram();
        self.ram = entries.iter().filter(ram).filter_map(Window::of).collect();
        // Flash is the one that answers a write otherwise than a read. (And what is mapped at 0 is a device.)
        self.flash = entries.iter().filter(|entry| !entry.is_direct_ram()).find_map(Window::of);
        true
    }

    /// The value at `address`, which is a multiple of its length.
    #[inline]
    pub fn read(&self, address: u32, width: Width) -> Option<u32> {
        let bytes = width.bytes() as u32;
        let windows = self.ram.iter().chain(&self.flash);
        let (window, at) =
            windows.into_iter().find_map(|window| Some((window, window.at(address, bytes)?)))?;
        window.store.read_value(at, width, Endian::Little).ok().map(|value| value as u32)
    }

    /// Puts `value` at `address`, which is a multiple of its length; returns whether that is RAM.
    #[inline]
    pub fn write(&self, address: u32, width: Width, value: u32) -> bool {
        let bytes = width.bytes() as u32;
        let window = self.ram.iter().find_map(|window| Some((window, window.at(address, bytes)?)));
        window.is_some_and(|(window, at)| {
            window.store.write_value(at, width, u64::from(value), Endian::Little).is_ok()
        })
    }

    /// Whether all of `bytes` bytes at `address` are in one memory, RAM if they are to be written.
    #[inline]
    pub fn has(&self, address: u32, bytes: u32, written: bool) -> bool {
        self.ram.iter().any(|window| window.at(address, bytes).is_some())
            || !written && self.flash.iter().any(|window| window.at(address, bytes).is_some())
    }

    /// The two halfwords at `address`, if it is in flash.
    #[inline]
    pub fn code(&self, address: u32) -> Option<(u16, u16)> {
        let flash = self.flash.as_ref()?;
        let half = |at| flash.store.read_value(at, Width::U16, Endian::Little).ok().map(|half| half as u16);
        let at = flash.at(address, 4)?;
        Some((half(at)?, half(at + 2)?))
    }

    /// Where flash begins, and its length.
    pub fn flash(&self) -> (u32, u32) {
        self.flash.as_ref().map_or((0, 0), |flash| (flash.start, flash.length))
    }

    /// Whether flash was written to since the last call.
    #[inline]
    pub fn flash_has_changed(&self) -> bool {
        let Some(flash) = &self.flash else { return false };
        // The emulator keeps the marks and makes no use of them.
        let mut changed = false;
        flash.store.for_each_dirty_page(|_| changed = true);
        if changed {
            flash.store.clear_dirty();
        }
        changed
    }
}

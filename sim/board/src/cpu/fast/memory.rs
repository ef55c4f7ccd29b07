//! The memories in which an access has no side effect: RAM, and flash for reading.
//!
//! They are the emulator's own stores, found in its address map. Accesses to all other addresses go through the emulator.

use std::sync::Arc;

use rsemu::core::space::{AddressSpace, FlatEntry, FlatTarget, Perms, RamStore};
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
        if leaf.constraints().endian != Endian::Little || !leaf.perms().contains(Perms::READ) {
            return None;
        }
        let start = u32::try_from(entry.start()).ok()?;
        let length = u32::try_from(entry.len()).ok()?;
        let offset = u32::try_from(leaf.offset()).ok()?;
        Some(Window { start, length, offset, store: Arc::clone(store) })
    }

    /// Where in the store `bytes` bytes at `address` are.
    #[inline(always)]
    fn at(&self, address: u32, bytes: u32) -> Option<u64> {
        let inside = address.wrapping_sub(self.start);
        (inside < self.length && self.length - inside >= bytes).then(|| u64::from(self.offset + inside))
    }
}

/// The upper bits of an address: which sixteenth of the address space.
const REGION_AT: u32 = 28;

/// The memories of the board.
#[derive(Default)]
pub struct Memory {
    /// The emulator's count of changes to its address map.
    generation: Option<u64>,
    /// Flash is the first, if there is any; what comes after it is RAM.
    windows: Vec<Window>,
    has_flash: bool,
    /// For each sixteenth of the address space, its first window.
    first: [u8; 16],
}

impl Memory {
    /// Follows the address map of `space`; returns whether it has changed.
    #[inline]
    pub fn follow(&mut self, space: &AddressSpace) -> bool {
        let changed = self.generation != Some(space.generation());
        if changed {
            self.map(space);
        }
        changed
    }

    #[cold]
    fn map(&mut self, space: &AddressSpace) {
        self.generation = Some(space.generation());
        let view = space.view();
        let entries = view.flat_view().entries();
        // Flash answers a write otherwise than a read. (What is mapped at 0 is a device.)
        let flash = entries.iter().filter(|entry| !entry.is_direct_ram()).find_map(Window::of);
        let ram = entries.iter().filter(|entry| entry.is_direct_ram()).filter_map(Window::of);
        self.has_flash = flash.is_some();
        self.windows = flash.into_iter().chain(ram).collect();
        let first = |region| self.windows.iter().position(|window| window.start >> REGION_AT == region);
        self.first = std::array::from_fn(|region| first(region as u32).unwrap_or(usize::MAX).min(0xff) as u8);
    }

    /// The window that has all of `bytes` bytes at `address`, its number, and where in its store they are.
    #[inline(always)]
    fn find(&self, address: u32, bytes: u32) -> Option<(usize, &RamStore, u64)> {
        let mut number = usize::from(self.first[(address >> REGION_AT) as usize]);
        while let Some(window) = self.windows.get(number) {
            if let Some(at) = window.at(address, bytes) {
                return Some((number, &window.store, at));
            }
            number += 1;
        }
        None
    }

    /// The value at `address`, which is a multiple of its length.
    #[inline(always)]
    pub fn read(&self, address: u32, width: Width) -> Option<u32> {
        let (_, store, at) = self.find(address, width.bytes() as u32)?;
        store.read_value(at, width, Endian::Little).ok().map(|value| value as u32)
    }

    /// Puts `value` at `address`, which is a multiple of its length; returns whether that is RAM.
    #[inline(always)]
    pub fn write(&self, address: u32, width: Width, value: u32) -> bool {
        self.find(address, width.bytes() as u32).is_some_and(|(number, store, at)| {
            let is_flash = number == 0 && self.has_flash;
            !is_flash && store.write_value(at, width, u64::from(value), Endian::Little).is_ok()
        })
    }

    /// Whether all of `bytes` bytes at `address` are in one memory, RAM if they are to be written.
    #[inline]
    pub fn has(&self, address: u32, bytes: u32, written: bool) -> bool {
        let found = self.find(address, bytes);
        found.is_some_and(|(number, ..)| !written || number != 0 || !self.has_flash)
    }

    /// The two halfwords at `address`, if it is in flash.
    pub fn code(&self, address: u32) -> Option<(u16, u16)> {
        let flash = self.flash_window()?;
        let half = |at| flash.store.read_value(at, Width::U16, Endian::Little).ok().map(|half| half as u16);
        let at = flash.at(address, 4)?;
        Some((half(at)?, half(at + 2)?))
    }

    /// Where flash begins, and its length.
    pub fn flash(&self) -> (u32, u32) {
        self.flash_window().map_or((0, 0), |flash| (flash.start, flash.length))
    }

    /// Whether flash was written to since the last call.
    #[inline]
    pub fn flash_has_changed(&self) -> bool {
        let Some(flash) = self.flash_window() else { return false };
        // The emulator sets these marks at each write, and does not read them itself.
        let mut changed = false;
        flash.store.for_each_dirty_page(|_| changed = true);
        if changed {
            flash.store.clear_dirty();
        }
        changed
    }

    fn flash_window(&self) -> Option<&Window> {
        self.windows.first().filter(|_| self.has_flash)
    }
}

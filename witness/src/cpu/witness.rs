//! The second emulator's core, without a part around it.

use std::num::{NonZeroU32, NonZeroU64};

use rigless::cpu::armv7m;
use rigless::device::Level;
use rigless::emulator::{Access, AccessKind, CoreBus, Exit, InterruptLine, Processor, Queued};
use rigless::machine::armv7m::{Config, Core as Described, Variant};
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;

use super::layout::{INTERRUPT, Region, TABLE};
use super::memory::Pages;
use super::state::{Condition, State};

/// Registers of the system block (ARM DDI 0403 B3.2).
const CPACR: u64 = 0xE000_ED88;
const CFSR: u64 = 0xE000_ED28;
const HFSR: u64 = 0xE000_ED2C;
const BFAR: u64 = 0xE000_ED38;
const VTOR: u64 = 0xE000_ED08;
/// `NVIC_ISER0`, `NVIC_IPR`.
const ISER: u64 = 0xE000_E100;
const IPR: u64 = 0xE000_E400;
/// Both halves of the floating-point unit.
const FPU_ON: u64 = 0xF << 20;
/// `CFSR`: `BFAR` is valid.
const BFARVALID: u32 = 1 << 15;
/// The processor's number of `BASEPRI` for a debugger.
const GDB_BASEPRI: usize = 37;

/// The core and its memories.
pub struct Core {
    // Before the memories, which it points into.
    processor: Box<dyn Processor>,
    memories: Vec<(Region, Pages)>,
    bus: Bus,
    /// What it saves beside its registers, as after a reset.
    rest: Vec<u8>,
    locked_up: bool,
}

/// What memory does not answer: a write to flash is lost, every other access fails.
#[derive(Default)]
struct Bus {
    flash: Vec<Region>,
    queued: Vec<Queued>,
}

impl CoreBus for Bus {
    fn access(&mut self, access: Access, _: bool) -> Option<u64> {
        let is_in =
            |region: &Region| access.address.wrapping_sub(u64::from(region.base)) < u64::from(region.length);
        (access.kind == AccessKind::Write && self.flash.iter().any(is_in)).then_some(access.value)
    }

    fn time(&self, instructions: u64) -> VirtualNanos {
        VirtualNanos(instructions)
    }

    fn queued(&mut self) -> Vec<Queued> {
        std::mem::take(&mut self.queued)
    }

    fn carry_on(&mut self, _: u64, _: Option<VirtualNanos>) -> Option<u32> {
        None
    }
}

/// As many registers as the processor saves first, each a number of variable length.
mod saved {
    pub const CORE: usize = 16;
    /// N, Z, C, V, Q, GE, IT, T, the exception, PRIMASK, FAULTMASK, CONTROL, the other stack pointer.
    pub const STATUS: usize = 13;
    pub const FLOATS: usize = 32;
    /// FPSCR, locked up, asleep, exclusive, event.
    pub const LAST: usize = 5;
    pub const ALL: usize = CORE + STATUS + FLOATS + LAST;
}

impl Core {
    /// A core with these memories.
    pub fn new(regions: &[Region]) -> Core {
        let described = Described {
            variant: Variant::M4,
            clock_hz: NonZeroU64::new(168_000_000).expect("not 0"),
            interrupt_lines: NonZeroU32::new(82).expect("not 0"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("not 0"),
            instructions_per_second: NonZeroU64::new(1_000_000_000).expect("not 0"),
            boot: "flash",
        };
        let made = armv7m::processor(&Config::new(described, &[]), Endian::Little);
        let mut processor = made.unwrap_or_else(|error| panic!("{error}"));
        let mut memories = Vec::new();
        for region in regions {
            let pages = Pages::new(region.length as usize);
            #[expect(unsafe_code, reason = "the processor keeps a pointer into the pages")]
            // SAFETY: the pages do not move, outlive the processor, and are touched between its calls only.
            unsafe {
                processor.map(u64::from(region.base), pages.len() as u64, pages.pointer(), region.is_ram);
            }
            memories.push((*region, pages));
        }
        let flash = regions.iter().filter(|region| !region.is_ram).copied().collect();
        let bus = Bus { flash, queued: Vec::new() };
        let mut core = Core { processor, memories, bus, rest: Vec::new(), locked_up: false };
        core.system(VTOR, Some(u64::from(TABLE.base)), Width::W32);
        core.system(CPACR, Some(FPU_ON), Width::W32);
        core.system(ISER, Some(1 << INTERRUPT), Width::W32);
        core.system(IPR + u64::from(INTERRUPT), Some(0x80), Width::W8);
        let all = core.processor.save();
        let mut rest = all.as_slice();
        for _ in 0..saved::ALL {
            take(&mut rest);
        }
        core.rest = rest.to_vec();
        core
    }

    fn system(&mut self, address: u64, write: Option<u64>, width: Width) -> u32 {
        let answer = self.processor.debugger_access(write, address, width, VirtualNanos(0));
        answer.unwrap_or_else(|| panic!("{address:#x} is the core's own")) as u32
    }

    /// Writes memory, as a programmer does.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        let found =
            self.memories.iter_mut().find(|(region, _)| address.wrapping_sub(region.base) < region.length);
        let (region, pages) = found.expect("an address of a memory");
        pages.write((address - region.base) as usize, bytes);
        self.processor.ask(Queued::Invalidate(u64::from(address), u64::from(address) + bytes.len() as u64));
    }

    /// Reads memory.
    pub fn read(&self, address: u32, into: &mut [u8]) {
        let found =
            self.memories.iter().find(|(region, _)| address.wrapping_sub(region.base) < region.length);
        let (region, pages) = found.expect("an address of a memory");
        pages.read((address - region.base) as usize, into);
    }

    /// After a reset, in thread mode, with these registers.
    pub fn arrange(&mut self, state: &State) {
        assert_eq!((state.basepri, state.exception()), (0, 0), "not among what is saved first");
        let bit = |at: u32| state.xpsr >> at & 1;
        let it = state.xpsr >> 25 & 3 | state.xpsr >> 8 & 0xfc;
        let status = [
            bit(31),
            bit(30),
            bit(29),
            bit(28),
            bit(27),
            state.xpsr >> 16 & 0xf,
            it,
            bit(24),
            0,
            state.primask,
            state.faultmask,
            state.control,
            state.other_sp,
        ];
        let last = [state.fpscr, 0, 0, 0, 0];
        let numbers = state.r.iter().chain(&status).chain(&state.s).chain(&last);
        let mut all = Vec::with_capacity(512);
        for number in numbers {
            put(&mut all, *number);
        }
        all.extend_from_slice(&self.rest);
        self.processor.load(&all).unwrap_or_else(|error| panic!("{error}: {state:x?}"));
        self.locked_up = false;
    }

    /// Its registers.
    pub fn state(&mut self) -> State {
        let cfsr = self.system(CFSR, None, Width::W32);
        let hfsr = self.system(HFSR, None, Width::W32);
        let bfar = self.system(BFAR, None, Width::W32);
        let basepri = self.processor.gdb_register(GDB_BASEPRI).map_or(0, |bytes| u32::from(bytes[0]));
        let all = self.processor.save();
        let mut rest = all.as_slice();
        let mut next = || take(&mut rest);
        let r: [u32; saved::CORE] = std::array::from_fn(|_| next());
        let [n, z, c, v, q, ge, it, t, exception, primask, faultmask, control, other_sp]: [u32;
            saved::STATUS] = std::array::from_fn(|_| next());
        let s: [u32; saved::FLOATS] = std::array::from_fn(|_| next());
        let [fpscr, locked_up, ..]: [u32; saved::LAST] = std::array::from_fn(|_| next());
        State {
            r,
            xpsr: n << 31
                | z << 30
                | c << 29
                | v << 28
                | q << 27
                | (it & 3) << 25
                | t << 24
                | ge << 16
                | (it & 0xfc) << 8
                | exception,
            primask,
            faultmask,
            basepri,
            control,
            other_sp,
            s,
            fpscr,
            cfsr,
            hfsr,
            bfar: if cfsr & BFARVALID != 0 { bfar } else { 0 },
            condition: if locked_up != 0 { Condition::LockedUp } else { Condition::Runs },
        }
    }

    /// The interrupt becomes pending.
    pub fn interrupt(&mut self) {
        let line = InterruptLine::new(INTERRUPT).expect("a line of the core");
        self.processor.ask(Queued::Line(line, Level::High));
        self.processor.ask(Queued::Line(line, Level::Low));
    }

    /// Executes `count` instructions, or up to the handler of a fault.
    pub fn run(&mut self, count: u64) {
        let mut left = count;
        while left > 0 && !self.locked_up {
            let (exit, ran) = self.processor.run(left as u32, &mut self.bus);
            left = left.saturating_sub(ran);
            match exit {
                Exit::Budget => return,
                // A branch to itself, which it takes for a wait.
                Exit::Waiting => return,
                Exit::Lockup => self.locked_up = true,
                Exit::Returned => {}
                // Only with a debugger.
                _ => return,
            }
        }
    }
}

/// Takes a number of variable length, seven bits a byte, the lowest first (`postcard`).
fn take(from: &mut &[u8]) -> u32 {
    let mut number = 0;
    for place in (0..).step_by(7) {
        let (byte, rest) = from.split_first().expect("a whole number");
        *from = rest;
        number |= u32::from(byte & 0x7f) << place;
        if byte & 0x80 == 0 {
            break;
        }
    }
    number
}

/// Puts a number of variable length.
fn put(to: &mut Vec<u8>, mut number: u32) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

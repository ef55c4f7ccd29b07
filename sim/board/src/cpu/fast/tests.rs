//! The fast path against the emulator, instruction by instruction: two cores that are alike, one with each.
//!
//! Instructions, registers, flags, masks, pending exceptions and SysTick are chosen by chance, with a liking for what
//! firmware does: pointers into memory, also to its ends and to odd addresses.

use std::collections::BTreeMap;

use rsemu::core::device::{DeviceClass, RealizeCtx, ResetKind};
use rsemu::core::space::{Mapping, Perms, RamStore, Region};
use rsemu::core::value::{Endian, Width};
use rsemu::cpu::arm::v7m::Config;
use rsemu::cpu::arm::v7m::isa::decode;

use super::*;
use crate::cpu::step::step;

const FLASH: u32 = 0x0800_0000;
const FLASH_LENGTH: u32 = 0x1000;
const RAM: u32 = 0x2000_0000;
/// Two stores, one after the other.
const RAM_LENGTHS: [u32; 2] = [0x1000, 0x400];
/// Where the handlers begin; the vectors come before.
const HANDLERS: u32 = FLASH + 0x400;
/// An interrupt that is wired, one that is pended by hand.
const WIRED: u16 = 3;
const BY_HAND: u16 = 9;

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB) >> 32) as u32
    }

    fn below(&mut self, limit: u32) -> u32 {
        self.next() % limit
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u32) as usize]
    }
}

/// A core with its memories.
struct Bench {
    core: ArmV7m,
    flash: Arc<RamStore>,
    ram: [Arc<RamStore>; 2],
}

impl Bench {
    fn new() -> Bench {
        let flash = Arc::new(RamStore::new(u64::from(FLASH_LENGTH)));
        let ram = RAM_LENGTHS.map(|length| Arc::new(RamStore::new(u64::from(length))));
        let space = AddressSpace::new("mem", 32);
        {
            let length = u64::from(FLASH_LENGTH);
            // As the emulator's flash: read from a store, written through something else.
            let read = Mapping::new(Region::ram("array", Arc::clone(&flash)), 0).with_perms(Perms::RX);
            let other = Arc::new(RamStore::new(length));
            let written = Mapping::new(Region::ram("program", other), 0).with_perms(Perms::WRITE);
            let mut topology = space.topology();
            topology.map(Region::container("flash", length, vec![read, written]), u64::from(FLASH)).unwrap();
            topology.map(Region::ram("ram1", Arc::clone(&ram[0])), u64::from(RAM)).unwrap();
            topology.map(Region::ram("ram2", Arc::clone(&ram[1])), u64::from(RAM + RAM_LENGTHS[0])).unwrap();
        }
        let core = ArmV7m::new(Config::CORTEX_M4F.with_reset_vtor(FLASH));
        core.attach_space(Arc::new(space));
        Bench { core, flash, ram }
    }

    fn memory(&self) -> Vec<u8> {
        let stores = [&self.flash, &self.ram[0], &self.ram[1]];
        let bytes = |store: &&Arc<RamStore>| {
            let mut bytes = vec![0; store.len() as usize];
            store.read_at(0, &mut bytes).unwrap();
            bytes
        };
        stores.iter().flat_map(bytes).collect()
    }

    /// Vectors that lead to handlers, and instructions.
    fn fill(&self, seed: u64) {
        let mut chance = Chance(seed);
        let words = (0..0x100).map(|vector: u32| {
            let entry = (HANDLERS + 4 * vector) | 1;
            if vector == 0 { RAM + RAM_LENGTHS[0] } else { entry }
        });
        let code: Vec<u8> = words
            .flat_map(u32::to_le_bytes)
            .chain((0..(FLASH_LENGTH - 0x400) / 4).flat_map(|_| instruction(&mut chance)))
            .collect();
        self.flash.write_at(0, &code).unwrap();
        for ram in &self.ram {
            let bytes: Vec<u8> = (0..ram.len()).map(|_| chance.next() as u8).collect();
            ram.write_at(0, &bytes).unwrap();
        }
    }

    /// Registers, masks and the system block, by chance; the core is not in a handler.
    fn arrange(&self, seed: u64) {
        let mut chance = Chance(seed);
        let c = &mut chance;
        let mut regs = Regs::new();
        for register in &mut regs.r {
            let ends = [
                RAM,
                RAM + RAM_LENGTHS[0],
                RAM + RAM_LENGTHS[0] + RAM_LENGTHS[1],
                FLASH,
                FLASH + FLASH_LENGTH,
            ];
            *register = match c.below(8) {
                0..=2 => RAM + 4 * c.below(0x4ff),
                3 => RAM + c.below(0x1500),
                4 => c.of(&ends).wrapping_add(c.below(64)).wrapping_sub(32),
                5 => (HANDLERS + c.below(0xa00)) | 1,
                6 => c.below(64),
                _ => c.next() & c.of(&[u32::MAX, 0x8000_ffff, 0xff]),
            };
        }
        regs.msp = RAM + 4 * c.below(0x4ff);
        regs.psp = RAM + 4 * c.below(0x4ff);
        regs.r[13] = regs.msp;
        regs.r[15] = HANDLERS + 2 * c.below(0x5f0);
        regs.xpsr = xpsr::T | c.next() & (xpsr::FLAGS | xpsr::GE);
        if c.below(4) == 0 {
            let state = (c.below(14) << 4) | (1 + c.below(15));
            regs.xpsr |= (state >> 2) << 10 | (state & 3) << 25;
        }
        regs.primask = c.below(4) == 0;
        regs.basepri = c.of(&[0, 0, 0, 0x40, 0x80]);
        regs.control = c.of(&[0, 0, 0, 0, 0, 0, 1, 2]);
        self.core.set_irq(WIRED, c.below(16) == 0);
        let (mut enabled, mut pended) = ([c.below(2) == 0; 2], [c.below(8) == 0; 2]);
        self.core.with_sys(|sys| {
            sys.active = [0; Exception::COUNT / 32];
            sys.pending = [0; Exception::COUNT / 32];
            for (line, (enabled, pended)) in
                [WIRED, BY_HAND].into_iter().zip(enabled.iter_mut().zip(&mut pended))
            {
                let exception = Exception(Exception::IRQ0.0 + line);
                sys.set_enable(exception, *enabled);
                sys.set_pending(exception, *pended);
                sys.priority[usize::from(exception.0)] = c.of(&[0x10, 0x60, 0xa0]);
            }
            (sys.demcr, sys.dwt_ctrl) = (1 << 24, 1);
            sys.syst_csr = c.of(&[0, 5, 7]);
            sys.syst_rvr = 100;
            sys.syst_cvr = c.below(12);
            (sys.cfsr, sys.hfsr) = (0, 0);
            sys.ccr = c.of(&[0x200, 0x200, 0x200, 0x208, 0x210]);
        });
        self.core.set_regs(regs);
    }

    /// What an instruction may change, but for memory.
    fn state(&self) -> impl PartialEq + std::fmt::Debug + use<> {
        let system = self.core.with_sys(|sys| {
            let faults = (sys.cfsr, sys.hfsr, sys.bfar, sys.mmfar);
            (sys.pending, sys.active, faults, sys.syst_csr, sys.syst_cvr, sys.dwt_cyccnt)
        });
        (self.core.regs(), self.core.is_asleep(), self.core.is_locked_up(), system)
    }
}

/// Four bytes of instructions.
fn instruction(chance: &mut Chance) -> [u8; 4] {
    let r = |chance: &mut Chance| chance.below(15);
    let wide = [
        // MRS and MSR of the masks, DMB, UDIV and SDIV, CLZ, TBB and TBH, UBFX, BFI, UXTB, UMLAL, LDRD, STRD.
        0xf3ef_8000 | r(chance) << 8 | (16 + chance.below(3)),
        0xf380_8800 | r(chance) << 16 | (16 + chance.below(3)),
        0xf3bf_8f5f,
        0xfbb0_f0f0 | r(chance) << 16 | r(chance) << 8 | r(chance),
        0xfb90_f0f0 | r(chance) << 16 | r(chance) << 8 | r(chance),
        0xfab0_f080 | r(chance) << 8 | (chance.below(15) * 0x1_0001),
        0xe8d0_f000 | r(chance) << 16 | chance.below(2) << 4 | r(chance),
        0xf3c0_0000 | r(chance) << 16 | r(chance) << 8 | chance.next() & 0x70df,
        0xf360_0000 | r(chance) << 16 | r(chance) << 8 | chance.next() & 0x70df,
        0xfa5f_f080 | r(chance) << 8 | r(chance),
        0xfbe0_0000 | r(chance) << 16 | chance.next() & 0xff0f,
        0xe950_0000 | chance.next() & 0x00ff_ffff,
        0xe940_0000 | chance.next() & 0x00ff_ffff,
        // MOVW and MOVT.
        0xf240_0000 | chance.below(2) << 23 | chance.next() & 0x0400_7fff | r(chance) << 8,
        // Data processing with a constant, with a register; a load or store; a block of them; a branch.
        0xf000_0000 | chance.next() & 0x05ff_7fff,
        0xea00_0000 | chance.next() & 0x01ff_7fff,
        0xf800_0000 | chance.next() & 0x01ff_ffff,
        0xe880_0000 | chance.next() & 0x013f_ffff,
        0xf000_9000 | chance.next() & 0x07ff_6fff,
        // Anything.
        0xe800_0000 | chance.next() & 0x1fff_ffff,
    ];
    let narrow = |chance: &mut Chance| match chance.below(16) {
        0 => chance.of(&[0xb662, 0xb672, 0xbf00, 0xbf30]),
        1 => 0x4700 | chance.below(256),
        _ => chance.below(0xe800),
    };
    let (first, second) = match chance.below(2) {
        0 => (narrow(chance), narrow(chance)),
        _ => {
            let word = chance.of(&wide);
            (word >> 16, word & 0xffff)
        }
    };
    let [a, b] = (first as u16).to_le_bytes();
    let [c, d] = (second as u16).to_le_bytes();
    [a, b, c, d]
}

/// Devices that stand still.
#[derive(Debug)]
struct Still;

impl Device for Still {
    fn class(&self) -> &'static DeviceClass {
        crate::cpu::class()
    }

    fn realize(&self, _: &mut RealizeCtx<'_>) -> rsemu::core::Result<()> {
        Ok(())
    }

    fn reset(&self, _: ResetKind) {}
}

/// Executes one step of both at each of `rounds` × 1000 places; returns how often the fast path took an instruction of each
/// name.
fn compare(rounds: u64) -> BTreeMap<String, u32> {
    let mut taken = BTreeMap::new();
    let (emulator, other) = (Bench::new(), Bench::new());
    let mut fast = Fast { wired: vec![WIRED], ..Fast::default() };
    let cursor = TickCursor::new();
    for round in 0..rounds {
        for bench in [&emulator, &other] {
            bench.core.reset(ResetKind::Cold);
            bench.core.step();
            bench.fill(round);
        }
        for place in 0..1_000 {
            let seed = round << 32 | place;
            emulator.arrange(seed);
            other.arrange(seed);
            let pc = other.core.pc();
            let cycles = step(&emulator.core);
            let course = Course { cursor: &cursor, at: 0, limit: 1, devices: &Still };
            let run = fast.run(&other.core, &course, |_, _| true);
            let half = |at: u32| {
                let half = other.flash.read_value(u64::from(at - FLASH), Width::U16, Endian::Little);
                half.unwrap_or_default() as u16
            };
            let instruction = decode(half(pc), half(pc + 2));
            let same = match run.instructions {
                0 => step(&other.core) == cycles,
                _ => run.instructions == 1 && run.cycles == cycles,
            };
            let (left, right) = (emulator.state(), other.state());
            if !same || left != right {
                emulator.arrange(seed);
                panic!(
                    "seed {seed:#x}: {instruction:?} at {pc:#x} in {cycles} or {} cycles:\n{:?}\n{left:?}\n{right:?}",
                    run.cycles,
                    emulator.state()
                );
            }
            if run.instructions > 0 {
                let text = format!("{instruction:?}");
                let name = text.split([' ', '(']).next().unwrap_or_default();
                *taken.entry(name.to_owned()).or_insert(0) += 1;
            }
            if emulator.core.is_locked_up() {
                break;
            }
        }
        assert!(emulator.memory() == other.memory(), "memory differs in round {round}");
    }
    taken
}

#[test]
fn it_does_what_the_emulator_does() {
    let taken = compare(300);
    let names = [
        "DataProc",
        "ShiftReg",
        "Adr",
        "MovImm16",
        "Branch",
        "BranchLink",
        "Bx",
        "Blx",
        "Cbz",
        "TableBranch",
        "It",
        "LoadStore",
        "LoadLiteral",
        "LoadStoreDual",
        "LoadStoreMultiple",
        "Mul",
        "MulLong",
        "Div",
        "Extend",
        "Misc",
        "Bitfield",
        "Mrs",
        "Msr",
        "Cps",
        "Barrier",
        "Hint",
    ];
    for name in names {
        assert!(taken.get(name).is_some_and(|times| *times >= 20), "{name}: {taken:?}");
    }
}

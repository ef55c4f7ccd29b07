//! What the part has and QEMU's machine does not, as far as the image needs it.

use std::path::Path;

use object::read::elf::{ElfFile32, ProgramHeader as _};
use object::{Endianness, Object as _, ObjectSymbol as _};

use super::guest::{Guest, LR, PC, SP, XPSR};
use super::tester::Tester;

/// `RCC_CR`, `CFGR` (RM0090 section 7.3) of a board that runs on its crystal and PLL: everything ready, PLL selected.
const RCC: [(u32, u32); 2] = [(0x4002_3800, 0x0303_0083), (0x4002_3808, 0x0000_0008)];
/// `RCC_CSR`: power-on, brown-out and pin; software and pin.
const RCC_CSR: u32 = 0x4002_3874;
const AFTER_POWER_UP: u32 = 0x0E00_0000;
const AFTER_RESET: u32 = 0x1400_0000;
/// `TIM4`, the image's clock (`docs/architecture.md`): counter and prescaler.
const CLOCK_CNT: u32 = 0x4000_0824;
const CLOCK_PSC: u32 = 0x4000_0828;
/// What the image sets: microseconds from 84 MHz.
const PSC_OF_PART: u32 = 83;
/// Microseconds from the 1 GHz of QEMU's timers.
const PSC_OF_QEMU: u32 = 999;
/// `NVIC_ISPR0`, and the interrupts of the two levels that wait for alarms: EXTI0, EXTI1 (RM0090 table 62).
const NVIC_ISPR0: u32 = 0xE000_E200;
const LEVELS: u32 = 1 << 6 | 1 << 7;
/// How often both are woken, in microseconds of the machine: on a busy computer these are long, and the main loop needs some.
const WAKE_US: u32 = 500;
/// `CFSR`, `HFSR`, `BFAR`: fault status, cleared by ones (ARM DDI 0403 B3.2).
const CFSR: u32 = 0xE000_ED28;
const HFSR: u32 = 0xE000_ED2C;
const BFAR: u32 = 0xE000_ED38;
/// `CFSR`: `BFAR` is that of this fault.
const BFARVALID: u32 = 1 << 15;
/// System memory with the part's number.
const SYSTEM_MEMORY: std::ops::Range<u32> = 0x1FFF_7A00..0x1FFF_7B00;
/// What is read there.
const UID: u32 = 0x0051_454D;
/// `BX LR`, `LDR Rt, [Rn, #imm]` (ARM DDI 0403 A7.7).
const BX_LR: [u8; 2] = [0x70, 0x47];
const LDR: u32 = 0b01101;
/// `xPSR`: the exception that is being handled.
const EXCEPTION: u32 = 0x1FF;
/// The program counter in an exception's frame.
const FRAMED_PC: u32 = 24;

/// The machine, and what is made up for.
pub struct Part {
    guest: Guest,
    tester: Tester,
    /// Addresses in the image: its check of the chip, its handler of faults, an instruction that returns.
    check: u32,
    fault: u32,
    returns: u32,
    /// Why it starts next.
    cause: u32,
    /// When the levels were woken last.
    woken_at: u32,
}

impl Part {
    /// Lets the machine with this image start.
    ///
    /// # Errors
    /// The image or QEMU's.
    pub fn new(elf: &Path, mut guest: Guest, tester: Tester) -> Result<Part, String> {
        let named = |why: String| format!("{}: {why}", elf.display());
        let bytes = std::fs::read(elf).map_err(|why| named(why.to_string()))?;
        let file = ElfFile32::<Endianness>::parse(bytes.as_slice()).map_err(|why| named(why.to_string()))?;
        let symbol = |name: &str| {
            let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
            found.map(|symbol| symbol.address() as u32 & !1).ok_or_else(|| named(format!("no {name}")))
        };
        let returns = file.elf_program_headers().iter().find_map(|header| {
            let endian = Endianness::Little;
            let is_code = header.p_flags(endian).0 & object::elf::PF_X.0 != 0;
            let data = header.data(endian, bytes.as_slice()).ok().filter(|_| is_code)?;
            let at = data.as_chunks::<2>().0.iter().position(|half| *half == BX_LR)?;
            Some(header.p_paddr(endian) + 2 * at as u32)
        });
        let (check, fault) = (symbol("__pre_init")?, symbol("HardFault")?);
        let returns = returns.ok_or_else(|| named("no BX LR".to_owned()))?;
        guest.break_at(check)?;
        guest.break_at(fault)?;
        guest.go()?;
        Ok(Part { guest, tester, check, fault, returns, cause: AFTER_POWER_UP, woken_at: 0 })
    }

    /// Makes up for what is lacking now.
    ///
    /// # Errors
    /// QEMU has ended, or the image has come to where it should not.
    pub fn make_up(&mut self) -> Result<(), String> {
        if self.guest.has_stopped()? {
            match self.guest.register(PC)? {
                at if at == self.check => self.started()?,
                at if at == self.fault => self.faulted()?,
                at => return Err(format!("QEMU has stopped at {at:#010x}")),
            }
            self.guest.go()?;
        }
        if self.tester.read(CLOCK_PSC)? == PSC_OF_PART {
            self.tester.write(CLOCK_PSC, PSC_OF_QEMU)?;
        }
        // It goes on beyond its end, but the ends of its rounds are right. To set it would delay the next one.
        let now = self.tester.read(CLOCK_CNT)?;
        if now.wrapping_sub(self.woken_at) >= WAKE_US {
            self.woken_at = now;
            self.tester.write(NVIC_ISPR0, LEVELS)?;
        }
        Ok(())
    }

    /// Sets registers, if the main loop executes; whether it did.
    ///
    /// # Errors
    /// QEMU has ended.
    pub fn plant(&mut self, registers: &[(u8, u32)]) -> Result<bool, String> {
        self.guest.halt()?;
        let at = self.guest.register(PC)?;
        let is_main_loop = self.guest.register(XPSR)? & EXCEPTION == 0 && at != self.check;
        if is_main_loop {
            for (number, value) in registers {
                self.guest.set_register(*number, *value)?;
            }
        }
        // At one of the breakpoints it is met again.
        self.guest.go()?;
        Ok(is_main_loop)
    }

    /// After every reset: the check of the chip returns.
    fn started(&mut self) -> Result<(), String> {
        for (address, word) in RCC {
            self.tester.write(address, word)?;
        }
        self.tester.write(RCC_CSR, self.cause)?;
        self.cause = AFTER_RESET;
        let back = self.guest.register(LR)?;
        self.guest.set_register(PC, back & !1)
    }

    /// A read of system memory is answered; any other fault is the image's.
    fn faulted(&mut self) -> Result<(), String> {
        let is_valid = self.tester.read(CFSR)? & BFARVALID != 0;
        if !is_valid || !SYSTEM_MEMORY.contains(&self.tester.read(BFAR)?) {
            return self.guest.step_over(self.fault);
        }
        let frame = self.guest.register(SP)?;
        let at = self.guest.word(frame + FRAMED_PC)?;
        let instruction = self.guest.word(at)? & 0xFFFF;
        if instruction >> 11 != LDR {
            return Err(format!(
                "system memory is read by {instruction:#06x} at {at:#010x}, which is not known here"
            ));
        }
        let target = instruction & 7;
        match target {
            0..=3 => self.guest.set_word(frame + 4 * target, UID)?,
            _ => self.guest.set_register(target as u8, UID)?,
        }
        self.guest.set_word(frame + FRAMED_PC, at + 2)?;
        self.tester.write(CFSR, u32::MAX)?;
        self.tester.write(HFSR, u32::MAX)?;
        self.guest.set_register(PC, self.returns)
    }
}

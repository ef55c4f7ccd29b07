//! Watchdog and software reset, and the causes they leave.

use stm32f4xx_hal::pac;

use crate::{DONE, echo, put, slot};

/// First boot: software reset. Second: the watchdog bites. Third: done. The causes are collected.
pub fn watchdog() -> ! {
    let rcc = unsafe { pac::RCC::steal() };
    let cause = rcc.csr().read().bits() >> 25;
    rcc.csr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 24) });
    let history = &raw mut HISTORY;
    let history = unsafe { &mut *history };
    if history.magic != MAGIC {
        *history = History { magic: MAGIC, causes: [0; 3], boots: 0 };
    }
    history.causes[history.boots as usize % 3] = cause;
    history.boots += 1;
    match history.boots {
        1 => cortex_m::peripheral::SCB::sys_reset(),
        2 => {
            let iwdg = unsafe { pac::IWDG::steal() };
            iwdg.kr().write(|w| unsafe { w.bits(0xcccc) });
            iwdg.kr().write(|w| unsafe { w.bits(0x5555) });
            iwdg.pr().write(|w| unsafe { w.bits(0) });
            iwdg.rlr().write(|w| unsafe { w.bits(80) });
            // A feed while the new values are being taken over loads the old ones.
            while iwdg.sr().read().bits() != 0 {}
            iwdg.kr().write(|w| unsafe { w.bits(0xaaaa) });
            loop {
                cortex_m::asm::wfi();
            }
        }
        _ => {
            for (i, cause) in history.causes.iter().enumerate() {
                put(slot::CAUSES + i, *cause);
            }
            put(slot::STAGE, DONE);
            echo::serve()
        }
    }
}

const MAGIC: u32 = 0x5e1f_7e57;

struct History {
    magic: u32,
    causes: [u32; 3],
    boots: u32,
}

#[unsafe(link_section = ".uninit.HISTORY")]
static mut HISTORY: History = History { magic: 0, causes: [0; 3], boots: 0 };

/// Whether this boot comes after one of [`watchdog`]'s.
pub fn is_under_way() -> bool {
    let history = &raw const HISTORY;
    unsafe { (*history).magic == MAGIC }
}

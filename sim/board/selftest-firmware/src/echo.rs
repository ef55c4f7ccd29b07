//! USART6 sends back what it has heard, 19200 8E1, behind its DE pin: from when the line is idle on.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering::Relaxed};

use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::pac::{self, Interrupt, interrupt};

use crate::usart::TE_RE_UE;

/// Bits of CR1: parity (even), nine bits with it.
const PCE: u32 = 1 << 10;
const M: u32 = 1 << 12;
/// Flags of SR, and the interrupt enables at the same places of CR1.
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
/// PC8.
const DE: u32 = 1 << 8;

static HEARD: [AtomicU8; 32] = [const { AtomicU8::new(0) }; 32];
static LENGTH: AtomicUsize = AtomicUsize::new(0);
static SENT: AtomicUsize = AtomicUsize::new(0);

/// Echoes for ever.
pub fn serve() -> ! {
    let usart = unsafe { pac::USART6::steal() };
    usart.brr().write(|w| unsafe { w.bits((84_000_000 / 19_200) as u16) });
    usart.cr1().write(|w| unsafe { w.bits((TE_RE_UE | M | PCE | RXNE | IDLE) as u16) });
    unsafe { NVIC::unmask(Interrupt::USART6) };
    loop {
        cortex_m::asm::wfi();
    }
}

#[interrupt]
fn USART6() {
    let (usart, port) = unsafe { (pac::USART6::steal(), pac::GPIOC::steal()) };
    let sr = u32::from(usart.sr().read().bits());
    let enable = |on: u32, off: u32| {
        usart.cr1().modify(|r, w| unsafe { w.bits(r.bits() & !off as u16 | on as u16) });
    };
    let enabled = sr & u32::from(usart.cr1().read().bits());
    if sr & (RXNE | IDLE) != 0 {
        // Clears both.
        let byte = usart.dr().read().bits() as u8;
        let length = LENGTH.load(Relaxed);
        if sr & RXNE != 0 && length < HEARD.len() {
            HEARD[length].store(byte, Relaxed);
            LENGTH.store(length + 1, Relaxed);
        } else if sr & IDLE != 0 && length > 0 {
            port.bsrr().write(|w| unsafe { w.bits(DE) });
            enable(TXE, 0);
        }
    }
    if enabled & TXE != 0 {
        let sent = SENT.load(Relaxed);
        usart.dr().write(|w| unsafe { w.bits(u16::from(HEARD[sent].load(Relaxed))) });
        SENT.store(sent + 1, Relaxed);
        if sent + 1 == LENGTH.load(Relaxed) {
            enable(TC, TXE);
        }
    } else if enabled & TC != 0 {
        port.bsrr().write(|w| unsafe { w.bits(DE << 16) });
        enable(0, TC);
        LENGTH.store(0, Relaxed);
        SENT.store(0, Relaxed);
    }
}

//! USARTs: polled, driven by interrupts behind a DE pin, overrun, with parity.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::pac::{self, Interrupt, interrupt};

use crate::timer::{now_us, wait_us};
use crate::{add, get, put, slot};

pub const TE_RE_UE: u32 = 1 << 3 | 1 << 2 | 1 << 13;

pub fn console() {
    let usart = unsafe { pac::USART2::steal() };
    usart.brr().write(|w| unsafe { w.bits((42_000_000 / 115_200) as u16) });
    usart.cr1().write(|w| unsafe { w.bits(TE_RE_UE as u16) });
    for byte in *b"ok\n" {
        while usart.sr().read().bits() & 1 << 7 == 0 {}
        usart.dr().write(|w| unsafe { w.bits(u16::from(byte)) });
    }
    let before = usart.sr().read().bits();
    while usart.sr().read().bits() & 1 << 6 == 0 {}
    put(slot::CONSOLE_SR, u32::from(before) << 16 | u32::from(usart.sr().read().bits()));
}

/// Interrupt-driven, as the gateway does it: DE up, three bytes by TXE, DE down at TC, then the answer.
pub fn t7(nvic: &mut NVIC) {
    let (usart, port) = unsafe { (pac::USART1::steal(), pac::GPIOB::steal()) };
    usart.brr().write(|w| unsafe { w.bits((84_000_000 / 115_200) as u16) });
    usart.cr1().write(|w| unsafe { w.bits((TE_RE_UE | 1 << 5) as u16) });
    unsafe {
        nvic.set_priority(Interrupt::USART1, 1 << 4);
        NVIC::unmask(Interrupt::USART1);
    }
    wait_us(200);
    port.bsrr().write(|w| unsafe { w.bits(1 << 8) });
    usart.cr1().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 7) });
    while get(slot::T7_RECEIVED) < 3 {}
}

static SENT: AtomicU32 = AtomicU32::new(0);

#[interrupt]
fn USART1() {
    let (usart, port) = unsafe { (pac::USART1::steal(), pac::GPIOB::steal()) };
    let sr = usart.sr().read().bits();
    let cr1 = usart.cr1().read().bits();
    if sr & (1 << 5 | 1 << 3) != 0 {
        let data = usart.dr().read().bits();
        let n = get(slot::T7_RECEIVED) as usize;
        put(slot::T7 + n.min(2), u32::from(sr & 0x2f) << 16 | u32::from(data));
        put(slot::T7_RECEIVED, n as u32 + 1);
    }
    if sr & cr1 & 1 << 7 != 0 {
        let n = SENT.load(Relaxed);
        SENT.store(n + 1, Relaxed);
        usart.dr().write(|w| unsafe { w.bits(0x41 + n as u16) });
        if n == 2 {
            usart.cr1().write(|w| unsafe { w.bits(cr1 & !(1 << 7) | 1 << 6) });
        }
    } else if sr & cr1 & 1 << 6 != 0 {
        port.bsrr().write(|w| unsafe { w.bits(1 << (8 + 16)) });
        usart.cr1().write(|w| unsafe { w.bits(cr1 & !(1 << 6)) });
        usart.sr().write(|w| unsafe { w.bits(!(1 << 6)) });
    }
}

/// USART3 overruns at 9600 8N1; USART6 talks 8E1 and meets a parity error and a break in the framing.
pub fn others() {
    let (isu, modbus) = unsafe { (pac::USART3::steal(), pac::USART6::steal()) };
    isu.brr().write(|w| unsafe { w.bits((42_000_000 / 9_600) as u16) });
    isu.cr1().write(|w| unsafe { w.bits(TE_RE_UE as u16) });
    wait_us(1_200);
    isu.dr().write(|w| unsafe { w.bits(0x55) });
    // Three characters come back; the firmware does not read the first two in time.
    wait_us(9_000);
    for i in 0..3 {
        let sr = isu.sr().read().bits();
        if sr & (1 << 5 | 1 << 3) == 0 {
            break;
        }
        put(slot::ISU + i, u32::from(sr & 0x2f) << 16 | u32::from(isu.dr().read().bits()));
        add(slot::ISU_RECEIVED, 1);
    }

    modbus.brr().write(|w| unsafe { w.bits((84_000_000 / 19_200) as u16) });
    modbus.cr1().write(|w| unsafe { w.bits((TE_RE_UE | 1 << 12 | 1 << 10) as u16) });
    wait_us(700);
    modbus.dr().write(|w| unsafe { w.bits(0x07) });
    for i in 0..3 {
        let from = now_us();
        while modbus.sr().read().bits() & 1 << 5 == 0 {
            if now_us().wrapping_sub(from) & 0xffff > 20_000 {
                return;
            }
        }
        let sr = modbus.sr().read().bits();
        put(slot::MODBUS + i, u32::from(sr & 0x2f) << 16 | u32::from(modbus.dr().read().bits()));
        add(slot::MODBUS_RECEIVED, 1);
    }
}

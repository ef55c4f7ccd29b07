//! Exercises what the gateway's firmware relies on and leaves the findings in `RESULTS`.
//!
//! Talks to the registers directly, so that a fault of a driver cannot be taken for one of the board. The test
//! that runs it knows the meaning of each word by `slot`.

#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::{DWT, NVIC};
use cortex_m_rt::entry;
use defmt_rtt as _;
use stm32f4xx_hal::pac::{self, Interrupt, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Where each finding is kept.
mod slot {
    pub const STAGE: usize = 0;
    pub const SYSCLK: usize = 1;
    pub const PCLK1: usize = 2;
    pub const PCLK2: usize = 3;
    /// Core cycles between two TIM4 ticks 1000 µs apart, polled.
    pub const CYCLES_PER_MS: usize = 4;
    /// Compare interrupts taken, and the largest and smallest distance from compare to handler in cycles.
    pub const COMPARES: usize = 5;
    pub const COMPARE_LATEST: usize = 6;
    pub const COMPARE_EARLIEST: usize = 7;
    /// Update interrupts taken.
    pub const UPDATES: usize = 8;
    /// Order of the nested interrupts: one hexadecimal digit per event.
    pub const NESTING: usize = 9;
    /// Counter after a WFI with interrupts masked, the compare it waited for, and handlers run meanwhile.
    pub const WOKE_AT: usize = 10;
    pub const WOKE_FOR: usize = 11;
    pub const RAN_MASKED: usize = 12;
    /// Core cycles of a sleep of 500 µs, by DWT.
    pub const SLEPT_CYCLES: usize = 13;
    /// Instructions executed in IT blocks whose condition is false, words changed on the interrupted stack, and
    /// interrupts taken meanwhile.
    pub const IT_EXECUTED: usize = 20;
    pub const IT_STACK: usize = 21;
    pub const IT_INTERRUPTS: usize = 22;
    /// USART2's SR right after the last character was written, and after TC.
    pub const CONSOLE_SR: usize = 14;
    /// Status register of USART1 after the first reply, received characters with their flags.
    pub const T7_RECEIVED: usize = 16;
    pub const T7: usize = 17;
    /// Likewise for USART3 and USART6.
    pub const ISU_RECEIVED: usize = 24;
    pub const ISU: usize = 25;
    pub const MODBUS_RECEIVED: usize = 28;
    pub const MODBUS: usize = 29;
    /// Period and pulse width of eight PWM cycles: TIM5, then TIM2.
    pub const PWM1: usize = 32;
    pub const PWM2: usize = 48;
    /// Why each of three boots happened: the top bits of RCC_CSR.
    pub const CAUSES: usize = 64;
    /// Levels read from the input register while the PWM inputs belong to the timers: bit 0 channel 1 seen low,
    /// bit 1 seen high, bits 2 and 3 likewise for channel 2.
    pub const PWM_LEVELS: usize = 67;
    pub const COUNT: usize = 68;
}

/// Not cleared at start: the findings survive the resets of the last stage. RAM is zero at power-up here.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.RESULTS")]
static RESULTS: [AtomicU32; slot::COUNT] = [const { AtomicU32::new(0) }; slot::COUNT];

fn put(slot: usize, value: u32) {
    RESULTS[slot].store(value, Relaxed);
}

fn get(slot: usize) -> u32 {
    RESULTS[slot].load(Relaxed)
}

fn add(slot: usize, value: u32) {
    put(slot, get(slot).wrapping_add(value));
}

const DONE: u32 = 0xd0e;

#[entry]
fn main() -> ! {
    let cp = cortex_m::Peripherals::take().unwrap();
    let dp = pac::Peripherals::take().unwrap();
    let rcc = dp.RCC.freeze(Config::hse(8.MHz()).sysclk(168.MHz()));
    put(slot::SYSCLK, rcc.clocks.sysclk().raw());
    put(slot::PCLK1, rcc.clocks.pclk1().raw());
    put(slot::PCLK2, rcc.clocks.pclk2().raw());
    let rcc = unsafe { pac::RCC::steal() };
    rcc.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 0b1111) });
    rcc.apb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 0b1111 | 1 << 17 | 1 << 18) });
    rcc.apb2enr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 4 | 1 << 5) });
    let (mut dcb, mut dwt) = (cp.DCB, cp.DWT);
    dcb.enable_trace();
    dwt.enable_cycle_counter();
    let mut nvic = cp.NVIC;
    pins();

    let history = &raw const HISTORY;
    if unsafe { (*history).magic } == MAGIC {
        // Came back from a reset of the last stage.
        watchdog();
    }
    put(slot::STAGE, 1);
    timer(&mut nvic);
    put(slot::STAGE, 2);
    nesting(&mut nvic);
    put(slot::STAGE, 3);
    masked_sleep();
    it_blocks();
    put(slot::STAGE, 4);
    console();
    put(slot::STAGE, 5);
    t7(&mut nvic);
    put(slot::STAGE, 6);
    others();
    put(slot::STAGE, 7);
    pwm();
    put(slot::STAGE, 8);
    for i in 0..200_u32 {
        defmt::println!("a line that fills the log: {=u32} {=u32}", i, !i);
        wait_us(100);
    }
    watchdog()
}

/// Switches `pin` of the port to `mode`: 1 output, or an alternate function + 16.
fn pin(port: *const pac::gpioa::RegisterBlock, pin: u32, mode: u32) {
    let port = unsafe { &*port };
    let (two, bits) = (2 * pin, if mode < 16 { mode } else { 2 });
    port.moder().modify(|r, w| unsafe { w.bits(r.bits() & !(3 << two) | bits << two) });
    if mode >= 16 {
        let four = 4 * (pin % 8);
        let set = |old: u32| old & !(0xf << four) | (mode - 16) << four;
        if pin < 8 {
            port.afrl().modify(|r, w| unsafe { w.bits(set(r.bits())) });
        } else {
            port.afrh().modify(|r, w| unsafe { w.bits(set(r.bits())) });
        }
    }
}

fn pins() {
    let (a, b) = (pac::GPIOA::ptr().cast(), pac::GPIOB::ptr().cast());
    let (c, d) = (pac::GPIOC::ptr().cast(), pac::GPIOD::ptr().cast());
    for (port, number, mode) in [
        (a, 1, 16 + 2),
        (a, 15, 16 + 1),
        (a, 2, 16 + 7),
        (a, 3, 16 + 7),
        (b, 6, 16 + 7),
        (b, 7, 16 + 7),
        (b, 8, 1),
        (d, 8, 16 + 7),
        (d, 9, 16 + 7),
        (d, 10, 1),
        (c, 6, 16 + 8),
        (c, 7, 16 + 8),
        (c, 8, 1),
    ] {
        pin(port, number, mode);
    }
}

// ---- TIM4: 1 µs clock ----------------------------------------------------------------------------------

const CORE_PER_US: u32 = 168;

fn tim4() -> pac::TIM4 {
    unsafe { pac::TIM4::steal() }
}

fn now_us() -> u32 {
    tim4().cnt().read().bits() & 0xffff
}

fn wait_us(us: u32) {
    let start = now_us();
    while now_us().wrapping_sub(start) & 0xffff < us {}
}

fn arm_compare(us: u32) {
    let at = now_us().wrapping_add(us) & 0xffff;
    tim4().ccr1().write(|w| unsafe { w.bits(at) });
}

fn timer(nvic: &mut NVIC) {
    let tim = tim4();
    tim.psc().write(|w| unsafe { w.bits(83) });
    tim.arr().write(|w| unsafe { w.bits(0xffff) });
    tim.egr().write(|w| unsafe { w.bits(1) });
    tim.sr().write(|w| unsafe { w.bits(0) });
    tim.ccr1().write(|w| unsafe { w.bits(0x8000) });
    tim.cr1().write(|w| unsafe { w.bits(1) });

    while now_us() < 10 {}
    let from = DWT::cycle_count();
    while now_us() < 1_010 {}
    put(slot::CYCLES_PER_MS, DWT::cycle_count().wrapping_sub(from));

    put(slot::COMPARE_EARLIEST, u32::MAX);
    tim.sr().write(|w| unsafe { w.bits(0) });
    tim.dier().write(|w| unsafe { w.bits(0b11) });
    unsafe {
        nvic.set_priority(Interrupt::TIM4, 4 << 4);
        nvic.set_priority(Interrupt::EXTI0, 8 << 4);
        NVIC::unmask(Interrupt::TIM4);
        NVIC::unmask(Interrupt::EXTI0);
    }
    // Two wraps of the counter, with a compare armed anew by each handler.
    arm_compare(137);
    while get(slot::UPDATES) < 2 {
        cortex_m::asm::nop();
    }
    tim.dier().write(|w| unsafe { w.bits(0) });
}

#[interrupt]
fn TIM4() {
    let tim = tim4();
    // The counter counts whole microseconds: only its edge says how late this is in cycles.
    let late_us = now_us().wrapping_sub(tim.ccr1().read().bits()) & 0xffff;
    let flags = tim.sr().read().bits();
    tim.sr().write(|w| unsafe { w.bits(!(flags & 0b11)) });
    if flags & 0b01 != 0 {
        add(slot::UPDATES, 1);
    }
    if flags & 0b10 == 0 {
        return;
    }
    match get(slot::STAGE) {
        1 => {
            let edge = now_us();
            let from = DWT::cycle_count();
            while now_us() == edge {}
            let since_edge = DWT::cycle_count().wrapping_sub(from);
            let late = late_us * CORE_PER_US + CORE_PER_US.saturating_sub(since_edge);
            add(slot::COMPARES, 1);
            put(slot::COMPARE_LATEST, get(slot::COMPARE_LATEST).max(late));
            put(slot::COMPARE_EARLIEST, get(slot::COMPARE_EARLIEST).min(late));
            arm_compare(137);
        }
        2 => {
            note(0x1);
            NVIC::pend(Interrupt::EXTI0);
            note(0x2);
        }
        3 => add(slot::RAN_MASKED, 1),
        _ => arm_compare(1_000),
    }
}

/// Appends a digit to the record of nested interrupts.
fn note(digit: u32) {
    put(slot::NESTING, get(slot::NESTING) << 4 | digit);
}

#[interrupt]
fn EXTI0() {
    note(0x3);
    if get(slot::NESTING) == 0x123 {
        // A higher priority preempts this one.
        NVIC::pend(Interrupt::TIM2);
        cortex_m::asm::isb();
        note(0x4);
    }
}

#[interrupt]
fn TIM2() {
    note(0x5);
}

fn nesting(nvic: &mut NVIC) {
    unsafe {
        nvic.set_priority(Interrupt::TIM2, 2 << 4);
        NVIC::unmask(Interrupt::TIM2);
    }
    tim4().sr().write(|w| unsafe { w.bits(0) });
    tim4().dier().write(|w| unsafe { w.bits(0b10) });
    arm_compare(50);
    while get(slot::NESTING) & 0xf != 4 {}
    tim4().dier().write(|w| unsafe { w.bits(0) });
    NVIC::mask(Interrupt::TIM2);
}

fn masked_sleep() {
    let tim = tim4();
    cortex_m::interrupt::free(|_| {
        tim.sr().write(|w| unsafe { w.bits(0) });
        tim.dier().write(|w| unsafe { w.bits(0b10) });
        arm_compare(500);
        let from = DWT::cycle_count();
        cortex_m::asm::wfi();
        put(slot::WOKE_AT, now_us());
        put(slot::SLEPT_CYCLES, DWT::cycle_count().wrapping_sub(from));
        put(slot::WOKE_FOR, tim.ccr1().read().bits());
        put(slot::RAN_MASKED, get(slot::RAN_MASKED) << 8);
    });
    cortex_m::asm::isb();
    tim.dier().write(|w| unsafe { w.bits(0) });
}

// ---- IT blocks interrupted ------------------------------------------------------------------------------

/// Interrupts of TIM3, counted by its handler.
#[unsafe(no_mangle)]
static TIM3_COUNT: AtomicU32 = AtomicU32::new(0);

/// Clears TIM3's flag, counts, and returns from within an IT block.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn TIM3() {
    core::arch::naked_asm!(
        "movw r0, #0x0410",
        "movt r0, #0x4000",
        "movs r1, #0",
        "str r1, [r0]",
        "ldr r0, =TIM3_COUNT",
        "ldr r1, [r0]",
        "adds r1, #1",
        "str r1, [r0]",
        "cmp r1, r1",
        "it eq",
        "bxeq lr",
        ".ltorg",
    )
}

/// Runs IT blocks that must do nothing, on top of a stack that must stay zero, under an interrupt every 7 µs.
fn it_blocks() {
    let tim = unsafe { pac::TIM3::steal() };
    tim.arr().write(|w| unsafe { w.bits(7 * 84 + 12) });
    tim.dier().write(|w| unsafe { w.bits(1) });
    tim.cr1().write(|w| unsafe { w.bits(1) });
    unsafe { NVIC::unmask(Interrupt::TIM3) };
    let (mut executed, mut changed) = (0_u32, 0_u32);
    unsafe {
        core::arch::asm!(
            "mov {word}, #0",
            "sub sp, #64",
            "mov {at}, sp",
            ".rept 16",
            "str {word}, [{at}], #4",
            ".endr",
            "2:",
            "cmp {turns}, #0",
            "itttt eq",
            "addeq {executed}, #1",
            "addeq {executed}, #1",
            "addeq {executed}, #1",
            "addeq {executed}, #1",
            "subs {turns}, #1",
            "bne 2b",
            "mov {at}, sp",
            ".rept 16",
            "ldr {word}, [{at}], #4",
            "orr {changed}, {word}",
            ".endr",
            "add sp, #64",
            word = out(reg) _,
            at = out(reg) _,
            turns = inout(reg) 20_000_u32 => _,
            executed = inout(reg) executed,
            changed = inout(reg) changed,
        );
    }
    NVIC::mask(Interrupt::TIM3);
    put(slot::IT_EXECUTED, executed);
    put(slot::IT_STACK, changed);
    put(slot::IT_INTERRUPTS, TIM3_COUNT.load(Relaxed));
}

// ---- USARTs --------------------------------------------------------------------------------------------

const TE_RE_UE: u32 = 1 << 3 | 1 << 2 | 1 << 13;

fn console() {
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
fn t7(nvic: &mut NVIC) {
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
fn others() {
    let (isu, modbus) = unsafe { (pac::USART3::steal(), pac::USART6::steal()) };
    isu.brr().write(|w| unsafe { w.bits((42_000_000 / 9_600) as u16) });
    isu.cr1().write(|w| unsafe { w.bits(TE_RE_UE as u16) });
    wait_us(1_200);
    isu.dr().write(|w| unsafe { w.bits(0x55) });
    // Three characters come back; nobody reads the first two in time.
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

// ---- PWM inputs ----------------------------------------------------------------------------------------

fn pwm() {
    let (tim5, tim2) = unsafe { (pac::TIM5::steal(), pac::TIM2::steal()) };
    // TIM5: TI2FP2 resets the counter; channel 2 takes the rising edge directly, channel 1 the falling one.
    tim5.arr().write(|w| unsafe { w.bits(u32::MAX) });
    tim5.ccmr1_input().write(|w| unsafe { w.bits(0b01 << 8 | 0b10) });
    tim5.ccer().write(|w| unsafe { w.bits(0b0001_0011) });
    tim5.smcr().write(|w| unsafe { w.bits(0b110 << 4 | 0b100) });
    tim5.cr1().write(|w| unsafe { w.bits(1) });
    // TIM2: TI1FP1; channel 1 rising, channel 2 falling.
    tim2.arr().write(|w| unsafe { w.bits(u32::MAX) });
    tim2.ccmr1_input().write(|w| unsafe { w.bits(0b10 << 8 | 0b01) });
    tim2.ccer().write(|w| unsafe { w.bits(0b0011_0001) });
    tim2.smcr().write(|w| unsafe { w.bits(0b101 << 4 | 0b100) });
    tim2.cr1().write(|w| unsafe { w.bits(1) });

    let port = unsafe { pac::GPIOA::steal() };
    let (mut n5, mut n2, mut levels) = (0, 0, 0);
    while n5 < 9 || n2 < 9 {
        let idr = port.idr().read().bits();
        levels |= 1 << (idr >> 1 & 1) | 4 << (idr >> 15 & 1);
        if tim5.sr().read().bits() & 1 << 2 != 0 {
            let (period, high) = (tim5.ccr2().read().bits(), tim5.ccr1().read().bits());
            if (1..9).contains(&n5) {
                put(slot::PWM1 + 2 * (n5 - 1), period);
                put(slot::PWM1 + 2 * (n5 - 1) + 1, high);
            }
            n5 += 1;
        }
        if tim2.sr().read().bits() & 1 << 1 != 0 {
            let (period, high) = (tim2.ccr1().read().bits(), tim2.ccr2().read().bits());
            if (1..9).contains(&n2) {
                put(slot::PWM2 + 2 * (n2 - 1), period);
                put(slot::PWM2 + 2 * (n2 - 1) + 1, high);
            }
            n2 += 1;
        }
    }
    put(slot::PWM_LEVELS, levels);
    tim5.cr1().write(|w| unsafe { w.bits(0) });
    tim2.cr1().write(|w| unsafe { w.bits(0) });
}

// ---- watchdog and reset --------------------------------------------------------------------------------

/// First boot: software reset. Second: the watchdog bites. Third: done. The causes are collected.
fn watchdog() -> ! {
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
            loop {
                cortex_m::asm::wfi();
            }
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

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::asm::udf()
}

//! TIM4 as a clock of 1 µs, its interrupts on the cycle, nesting, and sleep that a masked interrupt ends.

use cortex_m::peripheral::{DWT, NVIC};
use stm32f4xx_hal::pac::{self, Interrupt, interrupt};

use crate::{add, get, put, slot};

const CORE_PER_US: u32 = 168;

fn tim4() -> pac::TIM4 {
    unsafe { pac::TIM4::steal() }
}

pub fn now_us() -> u32 {
    tim4().cnt().read().bits() & 0xffff
}

pub fn wait_us(us: u32) {
    let start = now_us();
    while now_us().wrapping_sub(start) & 0xffff < us {}
}

fn arm_compare(us: u32) {
    let at = now_us().wrapping_add(us) & 0xffff;
    tim4().ccr1().write(|w| unsafe { w.bits(at) });
}

pub fn timer(nvic: &mut NVIC) {
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

pub fn nesting(nvic: &mut NVIC) {
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

pub fn masked_sleep() {
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

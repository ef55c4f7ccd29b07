//! IT blocks that are interrupted must go on with the right conditions.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::pac::{self, Interrupt};

use crate::{put, slot};

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
pub fn it_blocks() {
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

//! The first instructions after a reset, before memory is set up: start the watchdog, and see whether this is the chip that
//! the image is for: the device number, and as much flash as the image needs (RM0090 sections 38.6.1 and 39.2, RM0390
//! sections 33.6.1 and 34.2).
//!
//! In assembly: no Rust may run before memory is set up, and the stack may be in memory that another chip does not have.

use core::arch::global_asm;

use crate::board::{DEVICE_IDS, FLASH_KB, wrong_chip};

/// A stack in SRAM for [`wrong_chip`]: every STM32F4 has this memory.
const STACK: u32 = 0x2000_1000;

global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    // IWDG_KR, and START.
    "movw r0, #0x3000",
    "movt r0, #0x4000",
    "movw r1, #0xcccc",
    "str r1, [r0]",
    // DBGMCU_IDCODE, of which the lower twelve bits are the device.
    "movw r0, #0x2000",
    "movt r0, #0xe004",
    "ldr r0, [r0]",
    "ubfx r0, r0, #0, #12",
    // KiB of flash: a halfword of system memory.
    "movw r1, #0x7a22",
    "movt r1, #0x1fff",
    "ldrh r1, [r1]",
    "movw r2, #{first}",
    "movw r3, #{last}",
    "cmp r0, r2",
    "it ne",
    "cmpne r0, r3",
    "bne 1f",
    "cmp.w r1, #{flash_kb}",
    "it hs",
    "bxhs lr",
    "1:",
    "movw r2, #{stack_low}",
    "movt r2, #{stack_high}",
    "mov sp, r2",
    "b {wrong_chip}",
    ".size __pre_init, . - __pre_init",
    first = const DEVICE_IDS[0],
    last = const DEVICE_IDS[DEVICE_IDS.len() - 1],
    flash_kb = const FLASH_KB,
    stack_low = const STACK & 0xFFFF,
    stack_high = const STACK >> 16,
    wrong_chip = sym wrong_chip,
);

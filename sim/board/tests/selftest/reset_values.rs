//! The registers of every peripheral that the gateway's image uses are as the manual says after a power-up, and after a reset by
//! the watchdog.

use clino_board::elf::Image;
use clino_board::{Board, BoardModel};

use super::{MS, built, ports};

/// Order to the firmware.
const REGISTERS: u32 = 4;

/// Registers that are not 0 at reset: RM0090 rev 19 and the register crate `stm32f4` 0.16 (but OSPEEDR of port A, which only
/// the manual has). The firmware has set the clock enables.
const NOT_ZERO: [(&str, u32, u32); 24] = [
    ("GPIOA_MODER", 0x4002_0000, 0xa800_0000),
    ("GPIOA_OSPEEDR", 0x4002_0008, 0x0c00_0000),
    ("GPIOA_PUPDR", 0x4002_000c, 0x6400_0000),
    ("GPIOB_MODER", 0x4002_0400, 0x0000_0280),
    ("GPIOB_OSPEEDR", 0x4002_0408, 0x0000_00c0),
    ("GPIOB_PUPDR", 0x4002_040c, 0x0000_0100),
    ("USART1_SR", 0x4001_1000, 0x0000_00c0),
    ("USART2_SR", 0x4000_4400, 0x0000_00c0),
    ("USART3_SR", 0x4000_4800, 0x0000_00c0),
    ("USART6_SR", 0x4001_1400, 0x0000_00c0),
    // ARR of the timers is left out: the stock ones begin with 0, the chip's with all bits set. The image sets those it uses.
    ("RCC_CR", 0x4002_3800, 0x0000_0083),
    ("RCC_PLLCFGR", 0x4002_3804, 0x2400_3010),
    ("RCC_AHB1ENR", 0x4002_3830, 0x0010_000f),
    ("RCC_APB1ENR", 0x4002_3840, 0x1006_000d),
    ("RCC_APB2ENR", 0x4002_3844, 0x0000_4030),
    ("PWR_CR", 0x4000_7000, 0x0000_4000),
    ("FLASH_CR", 0x4002_3c10, 0x8000_0000),
    ("FLASH_OPTCR", 0x4002_3c14, 0x0fff_aaed),
    ("IWDG_RLR", 0x4000_3008, 0x0000_0fff),
    ("RCC_CFGR", 0x4002_3808, 0),
    ("IWDG_PR", 0x4000_3004, 0),
    ("IWDG_SR", 0x4000_300c, 0),
    ("FLASH_ACR", 0x4002_3c00, 0),
    ("EXTI_IMR", 0x4001_3c00, 0),
];

/// Registers that are 0: name and base of the peripheral, offsets.
const ZERO: [(&str, u32, &[u32]); 13] = [
    ("GPIOA", 0x4002_0000, &[0x04, 0x14, 0x20, 0x24]),
    ("GPIOB", 0x4002_0400, &[0x04, 0x14, 0x20, 0x24]),
    ("GPIOC", 0x4002_0800, &[0x00, 0x04, 0x08, 0x0c, 0x14, 0x20, 0x24]),
    ("GPIOD", 0x4002_0c00, &[0x00, 0x04, 0x08, 0x0c, 0x14, 0x20, 0x24]),
    ("USART1", 0x4001_1000, &[0x08, 0x0c, 0x10, 0x14, 0x18]),
    ("USART2", 0x4000_4400, &[0x08, 0x0c, 0x10, 0x14, 0x18]),
    ("USART3", 0x4000_4800, &[0x08, 0x0c, 0x10, 0x14, 0x18]),
    ("USART6", 0x4001_1400, &[0x08, 0x0c, 0x10, 0x14, 0x18]),
    ("TIM2", 0x4000_0000, &[0x00, 0x04, 0x08, 0x0c, 0x10, 0x18, 0x1c, 0x20, 0x24, 0x28, 0x34, 0x38]),
    ("TIM4", 0x4000_0800, &[0x00, 0x04, 0x08, 0x0c, 0x10, 0x18, 0x1c, 0x20, 0x24, 0x28, 0x34, 0x38]),
    ("TIM5", 0x4000_0c00, &[0x00, 0x04, 0x08, 0x0c, 0x10, 0x18, 0x1c, 0x20, 0x24, 0x28, 0x34, 0x38]),
    ("EXTI", 0x4001_3c00, &[0x04, 0x08, 0x0c, 0x10]),
    ("SYSCFG", 0x4001_3800, &[0x08, 0x0c, 0x10, 0x14]),
];

/// What is not as it should be.
fn wrong(board: &Board) -> Vec<String> {
    let zero = ZERO.iter().flat_map(|&(name, base, offsets)| {
        offsets.iter().map(move |offset| (format!("{name}+{offset:#x}"), base + offset, 0))
    });
    let all = NOT_ZERO.iter().map(|&(name, address, value)| (name.to_owned(), address, value)).chain(zero);
    let wrong = all.filter_map(|(name, address, expected)| {
        let value = board.peek32(address).unwrap_or_else(|| panic!("{name} is there"));
        (value != expected).then(|| format!("{name} {value:#010x}, expected {expected:#010x}"))
    });
    wrong.collect()
}

#[test]
#[ignore = "needs the thumb target"]
fn registers_are_as_the_manual_says_after_power_up_and_after_a_reset() {
    let image = Image::read(&built().join("board-trials"), BoardModel::default()).expect("an image");
    let order: Vec<u8> = [REGISTERS, 0, 0, 0].iter().flat_map(|word: &u32| word.to_le_bytes()).collect();
    let image = image.with_stored(&order).expect("it fits");
    let mut board = Board::new(&image, ports().0).expect("a board");
    board.run_until(10 * MS).expect("it runs");
    assert_eq!(wrong(&board), [""; 0], "after power-up");
    board.run_until(30 * MS).expect("it runs");
    let changed = wrong(&board);
    assert!(changed.len() > 60, "the firmware has changed them: {changed:?}");
    board.run_until(600 * MS).expect("it runs");
    assert_eq!(board.stats().resets, 1);
    assert_eq!(wrong(&board), [""; 0], "after the watchdog");
}

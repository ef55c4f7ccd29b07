//! The registers of every peripheral that the image relies on, as they are at rest: read out of the virtual board, compared
//! with values worked out here from the manual. `docs/registers.md` says why each is what it is.
//!
//! Core registers other than SysTick and NVIC are not in the emulator's memory map: they are checked by what they do
//! (`host-tests/tests/recovery`).

use std::path::Path;

use clino_board::BoardModel;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::{image, model, run};

const MS: u64 = 1_000_000;
/// When everything is at rest: brought up, and as delivered.
const AT_REST: u64 = 300 * MS;

/// Name, address, the bits that are compared, what they are.
type Register = (&'static str, u32, u32, u32);
const ALL: u32 = u32::MAX;

/// Bases (RM0090 table 1).
const TIM2: u32 = 0x4000_0000;
const TIM4: u32 = 0x4000_0800;
const TIM5: u32 = 0x4000_0c00;
const IWDG: u32 = 0x4000_3000;
const USART2: u32 = 0x4000_4400;
const USART3: u32 = 0x4000_4800;
const USART1: u32 = 0x4001_1000;
const USART6: u32 = 0x4001_1400;
const EXTI: u32 = 0x4001_3c00;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const GPIOD: u32 = 0x4002_0c00;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3c00;
const DBGMCU: u32 = 0xe004_2000;

/// GPIO (RM0090 section 8.4), two bits a pin in MODER, OSPEEDR and PUPDR, four in AFRL and AFRH. Unused pins are as
/// at reset: PA13 (SWDIO, up), PA14 (SWCLK, down), PB3 (SWO), PB4 (up).
const PINS: [Register; 12] = [
    // PA1, PA2, PA3, PA15 are alternate functions 2, 7, 7, 1; PA3 alone is pulled up.
    ("GPIOA_MODER", GPIOA, ALL, 0xa800_00a8),
    ("GPIOA_OTYPER", GPIOA + 0x04, ALL, 0),
    ("GPIOA_OSPEEDR", GPIOA + 0x08, ALL, 0x0c00_0000),
    ("GPIOA_PUPDR", GPIOA + 0x0c, ALL, 0x2400_0040),
    ("GPIOA_AFRL", GPIOA + 0x20, ALL, 0x0000_7720),
    ("GPIOA_AFRH", GPIOA + 0x24, ALL, 0x1000_0000),
    // PB6 and PB7 are alternate function 7, PB8 is an output; PB7 is pulled up.
    ("GPIOB_MODER", GPIOB, ALL, 0x0001_a280),
    ("GPIOB_OTYPER", GPIOB + 0x04, ALL, 0),
    ("GPIOB_OSPEEDR", GPIOB + 0x08, ALL, 0x0000_00c0),
    ("GPIOB_PUPDR", GPIOB + 0x0c, ALL, 0x0000_4100),
    ("GPIOB_AFRL", GPIOB + 0x20, ALL, 0x7700_0000),
    ("GPIOB_AFRH", GPIOB + 0x24, ALL, 0),
];

/// The same for the ports whose pins depend on the board: on a Discovery,
const DISCOVERY: [Register; 13] = [
    // PC6 and PC7 are alternate function 8, PC8 is an output; PC7 is pulled up.
    ("GPIOC_MODER", GPIOC, ALL, 0x0001_a000),
    ("GPIOC_OTYPER", GPIOC + 0x04, ALL, 0),
    ("GPIOC_OSPEEDR", GPIOC + 0x08, ALL, 0),
    ("GPIOC_PUPDR", GPIOC + 0x0c, ALL, 0x0000_4000),
    ("GPIOC_AFRL", GPIOC + 0x20, ALL, 0x8800_0000),
    ("GPIOC_AFRH", GPIOC + 0x24, ALL, 0),
    // PD8 and PD9 are alternate function 7, PD10 is an output; PD9 is pulled up.
    ("GPIOD_MODER", GPIOD, ALL, 0x001a_0000),
    ("GPIOD_OTYPER", GPIOD + 0x04, ALL, 0),
    ("GPIOD_OSPEEDR", GPIOD + 0x08, ALL, 0),
    ("GPIOD_PUPDR", GPIOD + 0x0c, ALL, 0x0004_0000),
    ("GPIOD_AFRL", GPIOD + 0x20, ALL, 0),
    ("GPIOD_AFRH", GPIOD + 0x24, ALL, 0x0000_0077),
    // PLLON, CSSON, HSEON, HSION, not HSEBYP; the trimming is the factory's.
    ("RCC_CR", RCC, 0x010d_0001, 0x0109_0001),
];

/// on a black board,
const BLACK: [Register; 13] = [
    // PC6 and PC7 are alternate function 8; PC7 is pulled up.
    ("GPIOC_MODER", GPIOC, ALL, 0x0000_a000),
    ("GPIOC_OTYPER", GPIOC + 0x04, ALL, 0),
    ("GPIOC_OSPEEDR", GPIOC + 0x08, ALL, 0),
    ("GPIOC_PUPDR", GPIOC + 0x0c, ALL, 0x0000_4000),
    ("GPIOC_AFRL", GPIOC + 0x20, ALL, 0x8800_0000),
    ("GPIOC_AFRH", GPIOC + 0x24, ALL, 0),
    // PD8 and PD9 are alternate function 7, PD10 and PD11 are outputs; PD9 is pulled up.
    ("GPIOD_MODER", GPIOD, ALL, 0x005a_0000),
    ("GPIOD_OTYPER", GPIOD + 0x04, ALL, 0),
    ("GPIOD_OSPEEDR", GPIOD + 0x08, ALL, 0),
    ("GPIOD_PUPDR", GPIOD + 0x0c, ALL, 0x0004_0000),
    ("GPIOD_AFRL", GPIOD + 0x20, ALL, 0),
    ("GPIOD_AFRH", GPIOD + 0x24, ALL, 0x0000_0077),
    ("RCC_CR", RCC, 0x010d_0001, 0x0109_0001),
];

/// on a Nucleo.
const NUCLEO: [Register; 13] = [
    // PC6 and PC7 are alternate function 8, PC10 and PC11 alternate function 7, PC8 and PC12 are outputs; PC7 and PC11 are
    // pulled up.
    ("GPIOC_MODER", GPIOC, ALL, 0x01a1_a000),
    ("GPIOC_OTYPER", GPIOC + 0x04, ALL, 0),
    ("GPIOC_OSPEEDR", GPIOC + 0x08, ALL, 0),
    ("GPIOC_PUPDR", GPIOC + 0x0c, ALL, 0x0040_4000),
    ("GPIOC_AFRL", GPIOC + 0x20, ALL, 0x8800_0000),
    ("GPIOC_AFRH", GPIOC + 0x24, ALL, 0x0000_7700),
    ("GPIOD_MODER", GPIOD, ALL, 0),
    ("GPIOD_OTYPER", GPIOD + 0x04, ALL, 0),
    ("GPIOD_OSPEEDR", GPIOD + 0x08, ALL, 0),
    ("GPIOD_PUPDR", GPIOD + 0x0c, ALL, 0),
    ("GPIOD_AFRL", GPIOD + 0x20, ALL, 0),
    ("GPIOD_AFRH", GPIOD + 0x24, ALL, 0),
    // PLLON, CSSON, HSEBYP, HSEON, HSION.
    ("RCC_CR", RCC, 0x010d_0001, 0x010d_0001),
];

/// USART (RM0090 section 30.6). In CR1, TXEIE and TCIE (bits 7 and 6) come and go with what is sent.
const SENDING: u32 = 0xc0;
const SERIAL: [Register; 20] = [
    // UE, TE, RE, RXNEIE; 84 MHz / 115200 Hz = 729.2.
    ("USART1_BRR", USART1 + 0x08, ALL, 729),
    ("USART1_CR1", USART1 + 0x0c, !SENDING, 0x202c),
    ("USART1_CR2", USART1 + 0x10, ALL, 0),
    ("USART1_CR3", USART1 + 0x14, ALL, 0),
    ("USART1_GTPR", USART1 + 0x18, ALL, 0),
    // 42 MHz / 115200 Hz = 364.6.
    ("USART2_BRR", USART2 + 0x08, ALL, 365),
    ("USART2_CR1", USART2 + 0x0c, !SENDING, 0x202c),
    ("USART2_CR2", USART2 + 0x10, ALL, 0),
    ("USART2_CR3", USART2 + 0x14, ALL, 0),
    ("USART2_GTPR", USART2 + 0x18, ALL, 0),
    // 42 MHz / 9600 Hz.
    ("USART3_BRR", USART3 + 0x08, ALL, 4_375),
    ("USART3_CR1", USART3 + 0x0c, !SENDING, 0x202c),
    ("USART3_CR2", USART3 + 0x10, ALL, 0),
    ("USART3_CR3", USART3 + 0x14, ALL, 0),
    ("USART3_GTPR", USART3 + 0x18, ALL, 0),
    // 84 MHz / 19200 Hz; nine bits with parity: M, PCE.
    ("USART6_BRR", USART6 + 0x08, ALL, 4_375),
    ("USART6_CR1", USART6 + 0x0c, !SENDING, 0x342c),
    ("USART6_CR2", USART6 + 0x10, ALL, 0),
    ("USART6_CR3", USART6 + 0x14, ALL, 0),
    ("USART6_GTPR", USART6 + 0x18, ALL, 0),
];

/// Timers (RM0090 section 18.4): CR1 is URS and CEN.
const TIMERS: [Register; 27] = [
    // TI1: rising edges into 1, falling ones into 2, filter 15 for both; reset by TI1FP1.
    ("TIM2_CR1", TIM2, ALL, 0x05),
    ("TIM2_CR2", TIM2 + 0x04, ALL, 0),
    ("TIM2_SMCR", TIM2 + 0x08, ALL, 0x54),
    ("TIM2_DIER", TIM2 + 0x0c, ALL, 0x02),
    ("TIM2_CCMR1", TIM2 + 0x18, ALL, 0xf2f1),
    ("TIM2_CCMR2", TIM2 + 0x1c, ALL, 0),
    ("TIM2_CCER", TIM2 + 0x20, ALL, 0x31),
    ("TIM2_PSC", TIM2 + 0x28, ALL, 0),
    ("TIM2_ARR", TIM2 + 0x2c, ALL, u32::MAX),
    // TI2: rising edges into 2, falling ones into 1; reset by TI2FP2.
    ("TIM5_CR1", TIM5, ALL, 0x05),
    ("TIM5_CR2", TIM5 + 0x04, ALL, 0),
    ("TIM5_SMCR", TIM5 + 0x08, ALL, 0x64),
    ("TIM5_DIER", TIM5 + 0x0c, ALL, 0x04),
    ("TIM5_CCMR1", TIM5 + 0x18, ALL, 0xf1f2),
    ("TIM5_CCMR2", TIM5 + 0x1c, ALL, 0),
    ("TIM5_CCER", TIM5 + 0x20, ALL, 0x13),
    ("TIM5_PSC", TIM5 + 0x28, ALL, 0),
    ("TIM5_ARR", TIM5 + 0x2c, ALL, u32::MAX),
    // Microseconds of 84 MHz, 16 bits. In DIER the compare interrupts (bits 1 and 2) come and go with the alarms.
    ("TIM4_CR1", TIM4, ALL, 0x05),
    ("TIM4_CR2", TIM4 + 0x04, ALL, 0),
    ("TIM4_SMCR", TIM4 + 0x08, ALL, 0),
    ("TIM4_DIER", TIM4 + 0x0c, !0x06, 0x01),
    ("TIM4_CCMR1", TIM4 + 0x18, ALL, 0),
    ("TIM4_CCMR2", TIM4 + 0x1c, ALL, 0),
    ("TIM4_CCER", TIM4 + 0x20, ALL, 0),
    ("TIM4_PSC", TIM4 + 0x28, ALL, 83),
    ("TIM4_ARR", TIM4 + 0x2c, ALL, 0xffff),
];

/// Clocks, flash, watchdog, debugging, interrupt lines (RM0090 sections 7.3, 3.9, 21.4, 38.16, 12.3).
const CHIP: [Register; 21] = [
    // APB2 at a half, APB1 at a quarter, AHB whole, PLL in use.
    ("RCC_CFGR", RCC + 0x08, 0x0000_fcff, 0x0000_940a),
    ("RCC_CIR", RCC + 0x0c, ALL, 0),
    ("RCC_AHB1RSTR", RCC + 0x10, ALL, 0),
    ("RCC_APB1RSTR", RCC + 0x20, ALL, 0),
    ("RCC_APB2RSTR", RCC + 0x24, ALL, 0),
    // GPIOA to GPIOD; the core-coupled memory with the stack, as at reset.
    ("RCC_AHB1ENR", RCC + 0x30, ALL, 0x0010_000f),
    // TIM2, TIM4, TIM5, USART2, USART3; USART1, USART6.
    ("RCC_APB1ENR", RCC + 0x40, ALL, 0x0006_000d),
    ("RCC_APB2ENR", RCC + 0x44, ALL, 0x0000_0030),
    // Its flags have been read and cleared.
    ("RCC_CSR", RCC + 0x74, 0xfe00_0000, 0),
    // Five wait states, prefetch, both caches.
    ("FLASH_ACR", FLASH, ALL, 0x0000_0705),
    // Locked, no interrupt; no sector is protected, and the watchdog is started by software.
    ("FLASH_CR", FLASH + 0x10, ALL, 0x8000_0000),
    ("FLASH_OPTCR", FLASH + 0x14, 0x0fff_00e0, 0x0fff_00e0),
    // Divider 16; 1572 counts: 1.48 s at 17 kHz. Both are taken over.
    ("IWDG_PR", IWDG + 0x04, ALL, 0b010),
    ("IWDG_RLR", IWDG + 0x08, ALL, 1_571),
    ("IWDG_SR", IWDG + 0x0c, ALL, 0),
    ("DBGMCU_APB1_FZ", DBGMCU + 0x08, 1 << 12, 1 << 12),
    // The bus and the Modbus level borrow lines 0 and 1 of the interrupt controller, not of EXTI.
    ("EXTI_IMR", EXTI, ALL, 0),
    ("EXTI_EMR", EXTI + 0x04, ALL, 0),
    ("EXTI_RTSR", EXTI + 0x08, ALL, 0),
    ("EXTI_FTSR", EXTI + 0x0c, ALL, 0),
    ("EXTI_SWIER", EXTI + 0x10, ALL, 0),
];

/// A board with nothing on its lines.
fn board(scenario: &str) -> Run {
    let text = format!("duration = \"4s\"\n{scenario}");
    let scenario = Scenario::parse(Path::new("registers"), &text).unwrap_or_else(|error| panic!("{error}"));
    Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"))
}

/// What is not as it should be.
fn wrong(run: &mut Run) -> Vec<String> {
    let of_board = match model() {
        BoardModel::F407Disc1 => &DISCOVERY[..],
        BoardModel::F407Ve => &BLACK,
        BoardModel::NucleoF446re => &NUCLEO,
    };
    let registers = [&PINS[..], of_board, &SERIAL, &TIMERS, &CHIP].concat();
    let wrong = registers.into_iter().filter_map(|(name, address, mask, expected)| {
        let value = run.board().peek32(address).unwrap_or_else(|| panic!("{name} is there"));
        (value & mask != expected)
            .then(|| format!("{name} {:#010x}, expected {expected:#010x}", value & mask))
    });
    wrong.collect()
}

#[test]
fn every_register_is_as_the_image_relies_on_it() {
    let mut run = board("");
    run.board().run_until(AT_REST).expect("it runs");
    assert_eq!(wrong(&mut run), [""; 0]);
    // 168 MHz of 8 MHz: input divided by M to 1 to 2 MHz, times N, divided by P (RM0090 section 7.3.2).
    let pll = run.board().peek32(RCC + 0x04).expect("PLLCFGR");
    let (m, n, p) = (pll & 0x3f, pll >> 6 & 0x1ff, 2 * ((pll >> 16 & 3) + 1));
    assert!((4..=8).contains(&m) && pll & 1 << 22 != 0, "{pll:#010x}");
    assert_eq!(8 * n, 168 * m * p);
}

#[test]
fn every_register_is_so_after_a_warm_reset() {
    for (what, level) in [("pin_reset", "main"), ("masked_hang", "main"), ("bus_fault", "bus")] {
        let mut run =
            board(&format!("plant = [{{ at = \"100ms\", what = \"{what}\", level = \"{level}\" }}]"));
        run.board().run_until(100 * MS + 2_000 * MS).expect("it runs");
        assert_eq!(run.board().stats().resets, 1, "{what}");
        assert_eq!(wrong(&mut run), [""; 0], "{what}");
    }
}

#[test]
fn a_pwm_input_that_is_not_connected_is_pulled_nowhere() {
    // JTDI, which PA15 is at reset, has a pull-up: with it this input would read as stuck high.
    let ran = run("duration = \"1s\"\n");
    for slot in [4, 5] {
        let status: Vec<_> = ran.slot(slot).map(|spoken| spoken.reading.status.as_str()).collect();
        assert!(status.contains(&"stuck_low"), "{status:?}");
        assert!(!status.contains(&"stuck_high"), "{status:?}");
    }
}

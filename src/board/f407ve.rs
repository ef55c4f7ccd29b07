//! The common black boards with an STM32F407VE (STM32_F4VE): their pins, their chip, their clock.
//!
//! | role          | peripheral | pins                        | what else hangs on them                        |
//! |---------------|------------|-----------------------------|------------------------------------------------|
//! | T7 bus        | USART1     | TX PB6, RX PB7, DE PB8      | the header of an NRF24L01, to be left empty     |
//! | ISU bus       | USART3     | TX PD8, RX PD9, DE PD10     | the header of a display, to be left empty       |
//! | console       | USART2     | TX PA2, RX PA3              | nothing                                        |
//! | Modbus uplink | USART6     | TX PC6, RX PC7, DE PD11     | nothing                                        |
//! | PWM input 1   | TIM5 CH2   | PA1                         | nothing                                        |
//! | PWM input 2   | TIM2 CH1   | PA15                        | JTDI, free when debugging over SWD             |
//!
//! Avoided: PC8 to PC12 and PD2 (the card, which pulls them up: a driver enable there would be on during a reset), PB0 and PB3
//! to PB5 (flash memory), PA6 and PA7 (LEDs), PA0, PE3, PE4 (buttons), PA9 to PA12 (USB). All pins used are 5 V tolerant
//! (DS8626 table 7, "FT"), those without a pull resistor only.
//!
//! Source: the board's circuit diagram as the sellers hand it out. Check yours: boards of this kind differ.

use stm32f4xx_hal::gpio::{gpioa, gpiob, gpioc, gpiod};

pub use stm32f4xx_hal::gpio::{PA1 as Pwm1Pin, PA15 as Pwm2Pin};
pub use stm32f4xx_hal::gpio::{PA2 as ConsoleTx, PA3 as ConsoleRx};
pub use stm32f4xx_hal::gpio::{PB6 as T7Tx, PB7 as T7Rx, PB8 as T7De};
pub use stm32f4xx_hal::gpio::{PC6 as ModbusTx, PC7 as ModbusRx, PD11 as ModbusDe};
pub use stm32f4xx_hal::gpio::{PD8 as IsuTx, PD9 as IsuRx, PD10 as IsuDe};

use super::{ExternalClock, Pins};

/// Name of the board.
pub const NAME: &str = "STM32F407VE";
/// Its chip.
pub const CHIP: &str = "STM32F407";
/// Product code, as a Modbus master may ask for it.
pub const PRODUCT: &str = "clino-f407";
/// Device numbers of the chip: as in `f407_disc1.rs`.
pub const DEVICE_IDS: [u32; 2] = [0x413, 0x411];
/// KiB of its flash.
pub const FLASH_KB: u32 = 512;
/// Y2, 8 MHz.
pub const CLOCK: ExternalClock = ExternalClock::Crystal { hz: 8_000_000 };

/// Each pin by its role.
pub fn take(a: gpioa::Parts, b: gpiob::Parts, c: gpioc::Parts, d: gpiod::Parts) -> Pins {
    Pins {
        t7: (b.pb6, b.pb7, b.pb8),
        isu: (d.pd8, d.pd9, d.pd10),
        console: (a.pa2, a.pa3),
        modbus: (c.pc6, c.pc7, d.pd11),
        pwm1: a.pa1,
        pwm2: a.pa15,
    }
}

//! NUCLEO-F446RE (MB1136): its pins, its chip, its clock.
//!
//! | role          | peripheral | pins                        | connector                | what else hangs on them   |
//! |---------------|------------|-----------------------------|--------------------------|---------------------------|
//! | T7 bus        | USART1     | TX PB6, RX PB7, DE PB8      | CN10-17, CN7-21, CN10-3  | nothing                   |
//! | ISU bus       | USART3     | TX PC10, RX PC11, DE PC12   | CN7-1, CN7-2, CN7-3      | nothing                   |
//! | console       | USART2     | TX PA2, RX PA3              | the ST-LINK's USB        | SB13, SB14: the ST-LINK's virtual COM port |
//! | Modbus uplink | USART6     | TX PC6, RX PC7, DE PC8      | CN10-4, CN10-19, CN10-2  | nothing                   |
//! | PWM input 1   | TIM5 CH2   | PA1                         | CN7-30                   | nothing                   |
//! | PWM input 2   | TIM2 CH1   | PA15                        | CN7-17                   | JTDI, free when debugging over SWD |
//!
//! Avoided: PA5 (LED LD2), PC13 (button B1), PB3 (SWO), PC14 and PC15 (32 kHz crystal), PH0 (the clock from the ST-LINK). All
//! pins used are 5 V tolerant (DS10693 table 10, "FT"), those without a pull resistor only. The package with 64 pins has of
//! port D PD2 alone.
//!
//! Source: UM1724 (board MB1136), RM0390, DS10693.

use stm32f4xx_hal::gpio::{gpioa, gpiob, gpioc, gpiod};

pub use stm32f4xx_hal::gpio::{PA1 as Pwm1Pin, PA15 as Pwm2Pin};
pub use stm32f4xx_hal::gpio::{PA2 as ConsoleTx, PA3 as ConsoleRx};
pub use stm32f4xx_hal::gpio::{PB6 as T7Tx, PB7 as T7Rx, PB8 as T7De};
pub use stm32f4xx_hal::gpio::{PC6 as ModbusTx, PC7 as ModbusRx, PC8 as ModbusDe};
pub use stm32f4xx_hal::gpio::{PC10 as IsuTx, PC11 as IsuRx, PC12 as IsuDe};

use super::{ExternalClock, Pins};

/// Name of the board.
pub const NAME: &str = "NUCLEO-F446RE";
/// Its chip.
pub const CHIP: &str = "STM32F446";
/// Product code, as a Modbus master may ask for it.
pub const PRODUCT: &str = "clino-f446";
/// Device number of the chip (RM0390 section 33.6.1).
pub const DEVICE_IDS: [u32; 1] = [0x421];
/// KiB of its flash.
pub const FLASH_KB: u32 = 512;
/// MCO of the ST-LINK, 8 MHz (UM1724 section 6.7.1).
pub const CLOCK: ExternalClock = ExternalClock::Fed { hz: 8_000_000 };

/// Each pin by its role.
pub fn take(a: gpioa::Parts, b: gpiob::Parts, c: gpioc::Parts, _: gpiod::Parts) -> Pins {
    Pins {
        t7: (b.pb6, b.pb7, b.pb8),
        isu: (c.pc10, c.pc11, c.pc12),
        console: (a.pa2, a.pa3),
        modbus: (c.pc6, c.pc7, c.pc8),
        pwm1: a.pa1,
        pwm2: a.pa15,
    }
}

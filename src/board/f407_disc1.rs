//! STM32F407G-DISC1 (STM32F4-Discovery, MB997): its pins, its chip, its clock.
//!
//! | role          | peripheral | pins                        | what else hangs on them                        |
//! |---------------|------------|-----------------------------|------------------------------------------------|
//! | T7 bus        | USART1     | TX PB6, RX PB7, DE PB8      | PB6: SCL of the audio codec, 4.7 kΩ to 3 V (idles high, as TX does) |
//! | ISU bus       | USART3     | TX PD8, RX PD9, DE PD10     | nothing                                        |
//! | console       | USART2     | TX PA2, RX PA3              | nothing                                        |
//! | Modbus uplink | USART6     | TX PC6, RX PC7, DE PC8      | PC7: master clock input of the audio codec     |
//! | PWM input 1   | TIM5 CH2   | PA1                         | nothing                                        |
//! | PWM input 2   | TIM2 CH1   | PA15                        | JTDI, free when debugging over SWD             |
//!
//! Avoided: PA0 (user button), PA9 (capacitor on VBUS), PA10 to PA12 (USB), PA4 and PA5 (not 5 V tolerant). All pins
//! used are 5 V tolerant (DS8626 table 7, "FT"), those without a pull resistor only.

use stm32f4xx_hal::gpio::{gpioa, gpiob, gpioc, gpiod};

pub use stm32f4xx_hal::gpio::{PA1 as Pwm1Pin, PA15 as Pwm2Pin};
pub use stm32f4xx_hal::gpio::{PA2 as ConsoleTx, PA3 as ConsoleRx};
pub use stm32f4xx_hal::gpio::{PB6 as T7Tx, PB7 as T7Rx, PB8 as T7De};
pub use stm32f4xx_hal::gpio::{PC6 as ModbusTx, PC7 as ModbusRx, PC8 as ModbusDe};
pub use stm32f4xx_hal::gpio::{PD8 as IsuTx, PD9 as IsuRx, PD10 as IsuDe};

use super::{ExternalClock, Pins};

/// Name of the board.
pub const NAME: &str = "STM32F407G-DISC1";
/// Its chip.
pub const CHIP: &str = "STM32F407";
/// Product code, as a Modbus master may ask for it.
pub const PRODUCT: &str = "clino-f407";
/// Device numbers of the chip (RM0090 section 38.6.1), the second that of revision A, which has the number of an F2
/// (errata sheet ES0182, "MCU device ID is incorrect").
pub const DEVICE_IDS: [u32; 2] = [0x413, 0x411];
/// KiB of its flash.
pub const FLASH_KB: u32 = 1024;
/// X2, 8 MHz.
pub const CLOCK: ExternalClock = ExternalClock::Crystal { hz: 8_000_000 };

/// Each pin by its role.
pub fn take(a: gpioa::Parts, b: gpiob::Parts, c: gpioc::Parts, d: gpiod::Parts) -> Pins {
    Pins {
        t7: (b.pb6, b.pb7, b.pb8),
        isu: (d.pd8, d.pd9, d.pd10),
        console: (a.pa2, a.pa3),
        modbus: (c.pc6, c.pc7, c.pc8),
        pwm1: a.pa1,
        pwm2: a.pa15,
    }
}

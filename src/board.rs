//! The board: which pin and which peripheral plays which role. Everything else knows roles.
//!
//! This file and those below it are the only ones that name pins, and, with the interrupts in `main.rs`, the only ones that
//! name peripherals: the table in `docs/architecture.md`.
//!
//! The pins, the chip and its clock are in one file for each board, below `board`, which a feature of the firmware chooses.
//! The rest is the same on all of them:
//!
//! | role          | peripheral |
//! |---------------|------------|
//! | T7 bus        | USART1     |
//! | ISU bus       | USART3     |
//! | console       | USART2, TX PA2 |
//! | Modbus uplink | USART6     |
//! | PWM input 1   | TIM5 CH2   |
//! | PWM input 2   | TIM2 CH1   |
//! | clock, alarms | TIM4       |
//!
//! Which registers are relied on, and where they are set, is in `docs/registers.md`. How to add a board: `docs/boards.md`.

use core::ops::Deref;
use core::ptr;

use clino_recovery::{Clock, ResetSource, Uid};
use cortex_m::Peripherals as Core;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, NVIC, SCB};
use stm32f4xx_hal::gpio::{Alternate, Output, Pin, PinState, Pull};
use stm32f4xx_hal::pac::{self, tim2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{self, BusClock, BusTimerClock, Config, Enable, Rcc};

use crate::params;

#[cfg(feature = "board-f407-disc1")]
mod f407_disc1;
#[cfg(feature = "board-f407ve")]
mod f407ve;
#[cfg(feature = "board-nucleo-f446re")]
mod nucleo_f446re;
mod wrong_chip;

#[cfg(feature = "board-f407-disc1")]
use f407_disc1 as layout;
#[cfg(feature = "board-f407ve")]
use f407ve as layout;
#[cfg(feature = "board-nucleo-f446re")]
use nucleo_f446re as layout;

pub use layout::{CHIP, DEVICE_IDS, FLASH_KB, PRODUCT};
pub use wrong_chip::wrong_chip;

/// What clocks the chip from outside.
#[allow(dead_code, reason = "a board has one of them")]
#[derive(Clone, Copy)]
pub enum ExternalClock {
    /// A crystal at its oscillator.
    Crystal {
        /// Its frequency.
        hz: u32,
    },
    /// A clock at the oscillator's input.
    Fed {
        /// Its frequency.
        hz: u32,
    },
}

impl ExternalClock {
    const fn hz(self) -> u32 {
        match self {
            ExternalClock::Crystal { hz } | ExternalClock::Fed { hz } => hz,
        }
    }

    /// The chip's oscillator is not used.
    const fn is_fed(self) -> bool {
        matches!(self, ExternalClock::Fed { .. })
    }
}

/// The pins by their roles, as a reset leaves them: TX, RX and DE of a line, the inputs of the timers.
pub struct Pins {
    t7: (layout::T7Tx, layout::T7Rx, layout::T7De),
    isu: (layout::IsuTx, layout::IsuRx, layout::IsuDe),
    console: (layout::ConsoleTx, layout::ConsoleRx),
    modbus: (layout::ModbusTx, layout::ModbusRx, layout::ModbusDe),
    pwm1: layout::Pwm1Pin,
    pwm2: layout::Pwm2Pin<Alternate<0>>,
}

pub type T7Usart = pac::USART1;
pub type T7De = layout::T7De<Output>;
pub type IsuUsart = pac::USART3;
pub type IsuDe = layout::IsuDe<Output>;
pub type ConsoleUsart = pac::USART2;
pub type ModbusUsart = pac::USART6;
pub type ModbusDe = layout::ModbusDe<Output>;
pub type Pwm1Pin = layout::Pwm1Pin<Alternate<2>>;
pub type Pwm2Timer = pac::TIM2;
pub type Pwm2Pin = layout::Pwm2Pin<Alternate<1>>;
pub type ClockTimer = pac::TIM4;
pub type FlashRegisters = pac::FLASH;

/// The timer of PWM input 1 with the registers of that of input 2: the same but for the option register, which is not
/// used here (RM0090 section 18.4).
pub struct Pwm1Timer(pac::TIM5);

impl Deref for Pwm1Timer {
    type Target = tim2::RegisterBlock;

    fn deref(&self) -> &tim2::RegisterBlock {
        // SAFETY: the peripheral is owned and lives for ever; every register used is at the same offset.
        unsafe { &*pac::TIM5::ptr().cast() }
    }
}

/// All roles, nothing switched on yet.
pub struct Board {
    pub watchdog: Watchdog,
    pub reset: ResetControl,
    pub clock: ClockTimer,
    pub flash: FlashRegisters,
    pub ports: Ports,
}

impl Board {
    /// Gives each peripheral its role.
    pub fn new(device: pac::Peripherals) -> Board {
        Board {
            watchdog: Watchdog(device.IWDG, device.DBGMCU),
            reset: ResetControl(device.RCC),
            clock: device.TIM4,
            flash: device.FLASH,
            ports: Ports {
                pins: (device.GPIOA, device.GPIOB, device.GPIOC, device.GPIOD),
                usarts: (device.USART1, device.USART3, device.USART2, device.USART6),
                timers: (device.TIM5, device.TIM2),
            },
        }
    }
}

/// The independent watchdog, and what stops it with the core.
pub struct Watchdog(pac::IWDG, pac::DBGMCU);

impl Watchdog {
    /// A core that a probe has stopped is no hang.
    pub fn stop_with_core(&self) {
        self.1.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    }
}

impl Deref for Watchdog {
    type Target = pac::iwdg::RegisterBlock;

    fn deref(&self) -> &pac::iwdg::RegisterBlock {
        &self.0
    }
}

/// The key that feeds the watchdog (RM0090 section 21.4.1).
pub const FEED: u16 = 0xAAAA;

/// Writes one of its keys to the watchdog.
pub fn tell_watchdog(key: u16) {
    // SAFETY: KR takes keys and nothing else, in one write.
    unsafe { (*pac::IWDG::ptr()).kr().write(|w| w.bits(key)) };
}

/// What knows why the chip was reset, and makes its clocks.
pub struct ResetControl(pac::RCC);

impl ResetControl {
    /// Flags of the reset controller, which are cleared.
    pub fn cause(&self) -> ResetSource {
        let flags = self.0.csr().read();
        self.0.csr().modify(|_, w| w.rmvf().set_bit());
        // Each reset sets the flag of the pin, too, and each power-on that of the brown-out detector.
        if flags.porrstf().bit_is_set() {
            ResetSource::PowerOn
        } else if flags.borrstf().bit_is_set() {
            ResetSource::BrownOut
        } else if flags.wdgrstf().bit_is_set() {
            ResetSource::Watchdog
        } else if flags.wwdgrstf().bit_is_set() {
            ResetSource::WindowWatchdog
        } else if flags.sftrstf().bit_is_set() {
            ResetSource::Software
        } else if flags.lpwrrstf().bit_is_set() {
            ResetSource::LowPower
        } else if flags.padrstf().bit_is_set() {
            ResetSource::Pin
        } else {
            ResetSource::Unknown
        }
    }

    /// Core at full speed from the crystal, or from the internal oscillator when there is no crystal: it is 1 % off at
    /// 25 °C and up to 8 % over temperature (DS8626 table 39).
    ///
    /// A crystal that stops later raises an NMI (`faults.rs`); `before` says if it has.
    pub fn start_clocks(self, before: Clock) -> (Clock, Rcc) {
        let (clock, config) = match before {
            Clock::Crystal if crystal_starts(&self.0) => {
                self.0.cr().modify(|_, w| w.csson().set_bit());
                (Clock::Crystal, external())
            }
            Clock::Crystal => (Clock::Internal, Config::hsi()),
            known => (known, Config::hsi()),
        };
        (clock, self.0.freeze(config.sysclk(params::CORE_HZ.Hz())))
    }
}

/// From the clock outside.
fn external() -> Config {
    let config = Config::hse(layout::CLOCK.hz().Hz());
    if layout::CLOCK.is_fed() { config.bypass_hse_oscillator() } else { config }
}

/// Tries to start the crystal, or to take over the clock that is in its place. The HAL would wait for it for ever.
fn crystal_starts(rcc: &pac::RCC) -> bool {
    rcc.cr().modify(|_, w| w.hsebyp().bit(layout::CLOCK.is_fed()));
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    let begin = cycles();
    let limit = (params::INTERNAL_HZ / 1_000_000).saturating_mul(params::CRYSTAL_START.as_micros());
    while cycles().wrapping_sub(begin) < limit {
        if rcc.cr().read().hserdy().bit_is_set() {
            return true;
        }
    }
    rcc.cr().modify(|_, w| w.hseon().clear_bit());
    false
}

/// Whether the crystal has stopped since the last call. For the NMI.
pub fn crystal_has_stopped() -> bool {
    // SAFETY: only the NMI's handler uses the register after start, and a write of this bit clears one flag.
    let rcc = unsafe { &*pac::RCC::ptr() };
    let stopped = rcc.cir().read().cssf().bit_is_set();
    if stopped {
        rcc.cir().write(|w| w.cssc().set_bit());
    }
    stopped
}

/// The ports of which no pin is set up.
pub struct Ports {
    pins: (pac::GPIOA, pac::GPIOB, pac::GPIOC, pac::GPIOD),
    usarts: (T7Usart, IsuUsart, ConsoleUsart, ModbusUsart),
    timers: (pac::TIM5, Pwm2Timer),
}

/// The lines, each to be taken into service by its `start`.
pub struct Lines {
    pub t7: T7Line,
    pub isu: IsuLine,
    pub console: ConsoleLine,
    pub modbus: ModbusLine,
    pub pwm1: Pwm1Line,
    pub pwm2: Pwm2Line,
}

pub struct T7Line(T7Usart, layout::T7Tx, layout::T7Rx, layout::T7De);
pub struct IsuLine(IsuUsart, layout::IsuTx, layout::IsuRx, layout::IsuDe);
pub struct ConsoleLine(ConsoleUsart, layout::ConsoleTx, layout::ConsoleRx);
pub struct ModbusLine(ModbusUsart, layout::ModbusTx, layout::ModbusRx, layout::ModbusDe);
pub struct Pwm1Line(pac::TIM5, layout::Pwm1Pin);
pub struct Pwm2Line(Pwm2Timer, layout::Pwm2Pin<Alternate<0>>);

impl Ports {
    pub fn split(self, rcc: &mut Rcc) -> Lines {
        let (a, b) = (self.pins.0.split(rcc), self.pins.1.split(rcc));
        let (c, d) = (self.pins.2.split(rcc), self.pins.3.split(rcc));
        let Pins { t7, isu, console, modbus, pwm1, pwm2 } = layout::take(a, b, c, d);
        Lines {
            t7: T7Line(self.usarts.0, t7.0, t7.1, t7.2),
            isu: IsuLine(self.usarts.1, isu.0, isu.1, isu.2),
            console: ConsoleLine(self.usarts.2, console.0, console.1),
            modbus: ModbusLine(self.usarts.3, modbus.0, modbus.1, modbus.2),
            pwm1: Pwm1Line(self.timers.0, pwm1),
            pwm2: Pwm2Line(self.timers.1, pwm2),
        }
    }
}

// The pull of each pin is set: at reset some have one (PA13 to PA15, PB4: JTAG), and `into_alternate` leaves it. A
// receive pin is pulled up: a transceiver whose receiver is off leaves it floating. No other has a pull.

impl T7Line {
    /// USART, DE and the USART's clock in Hz.
    pub fn start(self, rcc: &mut Rcc) -> (T7Usart, T7De, u32) {
        self.1.into_alternate::<7>().internal_resistor(Pull::None);
        self.2.into_alternate::<7>().internal_resistor(Pull::Up);
        (self.0, driver_enable(self.3), switch_on::<T7Usart>(rcc))
    }
}

impl IsuLine {
    /// USART, DE and the USART's clock in Hz.
    pub fn start(self, rcc: &mut Rcc) -> (IsuUsart, IsuDe, u32) {
        self.1.into_alternate::<7>().internal_resistor(Pull::None);
        self.2.into_alternate::<7>().internal_resistor(Pull::Up);
        (self.0, driver_enable(self.3), switch_on::<IsuUsart>(rcc))
    }
}

impl ConsoleLine {
    /// USART and its clock in Hz.
    pub fn start(self, rcc: &mut Rcc) -> (ConsoleUsart, u32) {
        self.1.into_alternate::<7>().internal_resistor(Pull::None);
        self.2.into_alternate::<7>().internal_resistor(Pull::Up);
        (self.0, switch_on::<ConsoleUsart>(rcc))
    }
}

impl ModbusLine {
    /// USART, DE and the USART's clock in Hz.
    pub fn start(self, rcc: &mut Rcc) -> (ModbusUsart, ModbusDe, u32) {
        self.1.into_alternate::<8>().internal_resistor(Pull::None);
        self.2.into_alternate::<8>().internal_resistor(Pull::Up);
        (self.0, driver_enable(self.3), switch_on::<ModbusUsart>(rcc))
    }
}

// The signals have 5 V. An FT pin is 5 V tolerant only without a pull (DS8626 section 5.3.1).

impl Pwm1Line {
    pub fn start(self, rcc: &mut Rcc) -> (Pwm1Timer, Pwm1Pin) {
        switch_on::<pac::TIM5>(rcc);
        (Pwm1Timer(self.0), self.1.into_alternate::<2>().internal_resistor(Pull::None))
    }
}

impl Pwm2Line {
    pub fn start(self, rcc: &mut Rcc) -> (Pwm2Timer, Pwm2Pin) {
        switch_on::<Pwm2Timer>(rcc);
        (self.0, self.1.into_alternate::<1>().internal_resistor(Pull::None))
    }
}

/// A driver enable, low: a resistor on the board keeps it low while the chip is in reset.
fn driver_enable<const P: char, const N: u8>(pin: Pin<P, N>) -> Pin<P, N, Output> {
    pin.into_push_pull_output_in_state(PinState::Low).internal_resistor(Pull::None)
}

/// Switches a peripheral's clock on and everything in it to its reset value; returns the bus clock in Hz.
pub fn switch_on<P: Enable + rcc::Reset + BusClock>(rcc: &mut Rcc) -> u32 {
    P::enable(rcc);
    P::reset(rcc);
    P::clock(&rcc.clocks).raw()
}

/// Clock of the timers of the PWM inputs, Hz.
pub fn capture_hz(rcc: &Rcc) -> u32 {
    pac::TIM5::timer_clock(&rcc.clocks).raw()
}

/// Lets the core's cycles be counted: [`cycles`].
pub fn count_cycles(core: &mut Core) {
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}

/// Cycles of the core, which come round: 25 s at 168 MHz.
pub fn cycles() -> u32 {
    DWT::cycle_count()
}

/// Keeps an interrupt out.
pub fn mask(interrupt: pac::Interrupt) {
    NVIC::mask(interrupt);
}

/// Starts the watchdog's tick, every `cycles` of the core, above every interrupt.
pub fn start_tick(mut core: Core, cycles: u32) {
    // SAFETY: the tick shares nothing but atomic numbers and the watchdog, and takes no lock.
    unsafe { core.SCB.set_priority(SystemHandler::SysTick, 0) };
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(cycles - 1);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
}

/// Restarts at once.
pub fn reset() -> ! {
    SCB::sys_reset()
}

/// CFSR, HFSR, MMFAR and BFAR: the fault registers of the core.
pub fn fault_status() -> [u32; 4] {
    // SAFETY: reading the fault registers changes nothing.
    let scb = unsafe { &*SCB::PTR };
    [scb.cfsr.read(), scb.hfsr.read(), scb.mmfar.read(), scb.bfar.read()]
}

/// The unique number of the chip (RM0090 section 39.1, RM0390 section 34.1).
pub fn uid() -> Uid {
    const UID: *const [u32; 3] = 0x1FFF_7A10 as *const _;
    // SAFETY: three aligned words of system memory, which every part has and nothing writes.
    Uid(unsafe { ptr::read_volatile(UID) })
}

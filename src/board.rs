//! The board: which pin and which peripheral plays which role. Everything else knows roles.
//!
//! It is the only file that names pins, and, with the interrupts in `main.rs`, the only one that names peripherals: the
//! table in `docs/architecture.md`.
//!
//! | role          | peripheral | pins                        | what else hangs on them on a STM32F4-Discovery |
//! |---------------|------------|-----------------------------|------------------------------------------------|
//! | T7 bus        | USART1     | TX PB6, RX PB7, DE PB8      | PB6: SCL of the audio codec, 4.7 kΩ to 3 V (idles high, as TX does) |
//! | ISU bus       | USART3     | TX PD8, RX PD9, DE PD10     | nothing                                        |
//! | console       | USART2     | TX PA2, RX PA3              | nothing; the ST-LINK's virtual COM port on a Nucleo |
//! | Modbus uplink | USART6     | TX PC6, RX PC7, DE PC8      | PC7: master clock input of the audio codec     |
//! | PWM input 1   | TIM5 CH2   | PA1                         | nothing                                        |
//! | PWM input 2   | TIM2 CH1   | PA15                        | JTDI, free when debugging over SWD             |
//! | clock, alarms | TIM4       |                             |                                                |
//!
//! Avoided: PA0 (user button), PA9 (capacitor on VBUS), PA10 to PA12 (USB), PA4 and PA5 (not 5 V tolerant). All pins
//! used are 5 V tolerant (DS8626 table 7, "FT"), those without a pull resistor only. Which registers are relied on, and
//! where they are set, is in `docs/registers.md`.

use core::ops::Deref;
use core::ptr;

use clino_recovery::{Clock, ResetSource, Uid};
use cortex_m::Peripherals as Core;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, NVIC, SCB};
use stm32f4xx_hal::gpio::{
    Alternate, Output, PA1, PA2, PA3, PA15, PB6, PB7, PB8, PC6, PC7, PC8, PD8, PD9, PD10,
};
use stm32f4xx_hal::gpio::{Pin, PinState, Pull};
use stm32f4xx_hal::pac::{self, tim2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{self, BusClock, BusTimerClock, Config, Enable, Rcc};

use crate::params;

pub type T7Usart = pac::USART1;
pub type T7De = PB8<Output>;
pub type IsuUsart = pac::USART3;
pub type IsuDe = PD10<Output>;
pub type ConsoleUsart = pac::USART2;
pub type ModbusUsart = pac::USART6;
pub type ModbusDe = PC8<Output>;
pub type Pwm1Pin = PA1<Alternate<2>>;
pub type Pwm2Timer = pac::TIM2;
pub type Pwm2Pin = PA15<Alternate<1>>;
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
                (Clock::Crystal, Config::hse(params::CRYSTAL_HZ.Hz()))
            }
            Clock::Crystal => (Clock::Internal, Config::hsi()),
            known => (known, Config::hsi()),
        };
        (clock, self.0.freeze(config.sysclk(params::CORE_HZ.Hz())))
    }
}

/// Tries to start the crystal. The HAL would wait for it for ever.
fn crystal_starts(rcc: &pac::RCC) -> bool {
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

pub struct T7Line(T7Usart, PB6, PB7, PB8);
pub struct IsuLine(IsuUsart, PD8, PD9, PD10);
pub struct ConsoleLine(ConsoleUsart, PA2, PA3);
pub struct ModbusLine(ModbusUsart, PC6, PC7, PC8);
pub struct Pwm1Line(pac::TIM5, PA1);
pub struct Pwm2Line(Pwm2Timer, PA15<Alternate<0>>);

impl Ports {
    pub fn split(self, rcc: &mut Rcc) -> Lines {
        let (a, b) = (self.pins.0.split(rcc), self.pins.1.split(rcc));
        let (c, d) = (self.pins.2.split(rcc), self.pins.3.split(rcc));
        Lines {
            t7: T7Line(self.usarts.0, b.pb6, b.pb7, b.pb8),
            isu: IsuLine(self.usarts.1, d.pd8, d.pd9, d.pd10),
            console: ConsoleLine(self.usarts.2, a.pa2, a.pa3),
            modbus: ModbusLine(self.usarts.3, c.pc6, c.pc7, c.pc8),
            pwm1: Pwm1Line(self.timers.0, a.pa1),
            pwm2: Pwm2Line(self.timers.1, a.pa15),
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

/// The unique number of the chip (RM0090 section 39.1).
pub fn uid() -> Uid {
    const UID: *const [u32; 3] = 0x1FFF_7A10 as *const _;
    // SAFETY: three aligned words of system memory, which every part has and nothing writes.
    Uid(unsafe { ptr::read_volatile(UID) })
}

//! The board: which pin and which peripheral plays which role.
//!
//! It is the only file that names pins. Peripherals are also named by the file that drives each of them, and interrupts
//! where they are handled: the table in `docs/architecture.md`.
//!
//! | role          | peripheral | pins                        | what else hangs on them on a STM32F4-Discovery |
//! |---------------|------------|-----------------------------|------------------------------------------------|
//! | T7 bus        | USART1     | TX PB6, RX PB7, DE PB8      | PB6: SCL of the audio codec, 4.7 kΩ to 3 V (idles high, as TX does) |
//! | ISU bus       | USART3     | TX PD8, RX PD9, DE PD10     | nothing                                        |
//! | console       | USART2     | TX PA2, RX PA3              | nothing; the ST-LINK's virtual COM port on a Nucleo |
//! | Modbus uplink | USART6     | TX PC6, RX PC7, DE PC8      | PC7: master clock input of the audio codec     |
//! | PWM input 1   | TIM5 CH2   | PA1                         | nothing                                        |
//! | PWM input 2   | TIM2 CH1   | PA15                        | JTDI, free when debugging over SWD             |
//! | clock, alarm  | TIM4       |                             |                                                |
//! | bus level     | EXTI0      | (interrupt only, no pin)    |                                                |
//!
//! Avoided: PA0 (user button), PA9 (capacitor on VBUS), PA10 to PA12 (USB), PA4 and PA5 (not 5 V tolerant).
//! All pins used are 5 V tolerant (DS8626 table 7, "FT"), those without a pull resistor only. Which registers are relied on,
//! and where they are set, is in `docs/registers.md`.

use core::ptr;

use clino_bus::Event;
use clino_console::Received;
use clino_gateway::{Bus, Capture, Restraint};
use clino_recovery::{Clock, Mode, Uid};
use cortex_m::peripheral::{DWT, NVIC};
use cortex_m::singleton;
use heapless::spsc::{Consumer, Queue};
use stm32f4xx_hal::gpio::{Alternate, Output, PA1, PA15, PB8, PC8, PD10, Pin, PinState, Pull};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{BusClock, BusTimerClock, Config, Enable, Rcc, Reset};

use crate::bus::Inbox;
use crate::capture::{PwmCapture, Tim5, TimerInput};
use crate::keeper::Keeper;
use crate::log::log;
use crate::ports::{self, Ports};
use crate::uart::{self, Rs485};
use crate::{bus, clock, console, modbus, params, start, watchdog};

pub type T7Port = Rs485<pac::USART1, PB8<Output>>;
pub type IsuPort = Rs485<pac::USART3, PD10<Output>>;
/// Driver enable of the Modbus port.
pub type ModbusDe = PC8<Output>;
pub type Pwm1Port = PwmCapture<Tim5, PA1<Alternate<2>>>;
pub type Pwm2Port = PwmCapture<pac::TIM2, PA15<Alternate<1>>>;

/// Events the T7 bus can have in hand before the bus level fetches them: 2.8 ms of characters at 115200 bit/s.
const T7_EVENTS: usize = 32;
/// The same for the ISU bus: 17 ms at 9600 bit/s.
const ISU_EVENTS: usize = 16;
/// Cycles a PWM input can have in hand.
const CAPTURES: usize = 4;

/// The queues between interrupts and the levels above.
pub struct Queues {
    t7: Queue<Event, T7_EVENTS>,
    isu: Queue<Event, ISU_EVENTS>,
    pwm1: Queue<Capture, CAPTURES>,
    pwm2: Queue<Capture, CAPTURES>,
    console: console::Queues,
    modbus: modbus::port::Queues,
}

impl Queues {
    pub const fn new() -> Queues {
        Queues {
            t7: Queue::new(),
            isu: Queue::new(),
            pwm1: Queue::new(),
            pwm2: Queue::new(),
            console: console::Queues::new(),
            modbus: modbus::port::Queues::new(),
        }
    }
}

/// The roles, ready to run.
pub struct Board {
    /// How much of it is to run.
    pub mode: Mode,
    /// What is typed.
    pub keys: Consumer<'static, Received>,
    /// Who stores the configuration.
    pub keeper: &'static mut Keeper,
}

impl Board {
    /// Brings the board up; at last the interrupts of its ports are let in. A function of its own: its share of the stack is
    /// free again after it.
    #[inline(never)]
    pub fn init(peripherals: pac::Peripherals, nvic: &mut NVIC, queues: &'static mut Queues) -> Board {
        watchdog::start(&peripherals.IWDG, &peripherals.DBGMCU);
        let start = start::note(&peripherals.RCC);
        let (clock, mut rcc) = start_clocks(peripherals.RCC, start.clock);
        start::note_clock(clock);
        log!(
            info,
            "clino {=str}, start {=u32} after {=str}, {=u32} crashes, mode {=str}, clock {=str}",
            env!("CARGO_PKG_VERSION"),
            start.boots,
            start.cause.name(),
            start.crashes,
            start.mode.name(),
            clock.name()
        );
        if let Some(crash) = start.crash {
            let at = crash.registers.unwrap_or_default();
            log!(
                error,
                "last crash: {=str} {=u32} {=str} in start {=u32} after {=u32} ms, pc {=u32:#010x}, lr {=u32:#010x}, \
                 level {=u16}, cfsr {=u32:#010x}, address {=u32:#010x}",
                crash.cause.name(),
                crash.detail,
                crash.file().unwrap_or(""),
                crash.boot,
                crash.uptime_ms,
                at.pc,
                at.lr,
                at.exception,
                crash.fault.cfsr,
                crash.fault.address
            );
        }
        let rcc = &mut rcc;
        clock::start(peripherals.TIM4, rcc);

        let (t7_producer, t7) = queues.t7.split();
        let (isu_producer, isu) = queues.isu.split();
        let (pwm1_producer, pwm1) = queues.pwm1.split();
        let (pwm2_producer, pwm2) = queues.pwm2.split();
        let timer_hz = pac::TIM5::timer_clock(&rcc.clocks).raw();
        let limits = params::pwm_limits(timer_hz, clock.is_exact());
        bus::prepare(Inbox { t7, isu, pwm1, pwm2 }, limits);
        let gpioa = peripherals.GPIOA.split(rcc);
        let gpiob = peripherals.GPIOB.split(rcc);
        let gpioc = peripherals.GPIOC.split(rcc);
        let gpiod = peripherals.GPIOD.split(rcc);

        let mut modbus_settings = params::MODBUS;
        let Some(keeper) = singleton!(: Keeper = Keeper::new(peripherals.FLASH)) else {
            panic!("the board is brought up once");
        };
        match start.mode {
            Mode::Bare => keeper.leave(),
            Mode::Normal | Mode::Safe => keeper.load(&mut modbus_settings),
        }
        let core_hz = rcc.clocks.hclk().raw();

        // Each pin is told its pull: at reset some have one (PA13 to PA15, PB4: JTAG), and `into_alternate` leaves it. A receive
        // pin is pulled up: a transceiver whose receiver is off leaves it floating. No other has a pull.
        gpiob.pb6.into_alternate::<7>().internal_resistor(Pull::None);
        gpiob.pb7.into_alternate::<7>().internal_resistor(Pull::Up);
        let de = driver_enable(gpiob.pb8);
        let clock_hz = switch_on::<pac::USART1>(rcc);
        let t7 = Rs485::new(peripherals.USART1, de, &bus::timing(Bus::T7), clock_hz, core_hz, t7_producer);

        gpiod.pd8.into_alternate::<7>().internal_resistor(Pull::None);
        gpiod.pd9.into_alternate::<7>().internal_resistor(Pull::Up);
        let de = driver_enable(gpiod.pd10);
        let clock_hz = switch_on::<pac::USART3>(rcc);
        let isu = Rs485::new(peripherals.USART3, de, &bus::timing(Bus::Isu), clock_hz, core_hz, isu_producer);

        gpioa.pa2.into_alternate::<7>().internal_resistor(Pull::None);
        gpioa.pa3.into_alternate::<7>().internal_resistor(Pull::Up);
        let clock_hz = switch_on::<pac::USART2>(rcc);
        let divider = uart::divider(clock_hz, params::CONSOLE.baud);
        let keys = console::start(peripherals.USART2, divider, &mut queues.console);

        gpioc.pc6.into_alternate::<8>().internal_resistor(Pull::None);
        gpioc.pc7.into_alternate::<8>().internal_resistor(Pull::Up);
        let de = driver_enable(gpioc.pc8);
        let clock_hz = switch_on::<pac::USART6>(rcc);
        let lines =
            modbus::port::start(peripherals.USART6, de, clock_hz, &modbus_settings, &mut queues.modbus);

        // The signals have 5 V. An FT pin is 5 V tolerant only without a pull (DS8626 section 5.3.1).
        switch_on::<pac::TIM5>(rcc);
        let pin = gpioa.pa1.into_alternate::<2>().internal_resistor(Pull::None);
        let pwm1 = PwmCapture::new(Tim5(peripherals.TIM5), TimerInput::Ti2, pin, pwm1_producer);
        switch_on::<pac::TIM2>(rcc);
        let pin = gpioa.pa15.into_alternate::<1>().internal_resistor(Pull::None);
        let pwm2 = PwmCapture::new(peripherals.TIM2, TimerInput::Ti1, pin, pwm2_producer);

        bus::start(restraint(start.mode, clock));
        modbus::start(lines, modbus_settings);
        ports::start(Ports { t7, isu, pwm1, pwm2 }, start.mode, nvic);
        Board { mode: start.mode, keys, keeper }
    }
}

/// A driver enable, low: a resistor on the board keeps it low while the chip is in reset.
fn driver_enable<const P: char, const N: u8>(pin: Pin<P, N>) -> Pin<P, N, Output> {
    pin.into_push_pull_output_in_state(PinState::Low).internal_resistor(Pull::None)
}

/// What must not be asked of the gateway.
fn restraint(mode: Mode, clock: Clock) -> Restraint {
    if mode != Mode::Normal {
        Restraint::NoBuses
    } else if !clock.is_exact() {
        Restraint::InexactClock
    } else {
        Restraint::None
    }
}

/// Core at full speed from the crystal, or from the internal oscillator when there is no crystal: it is 1 % off at 25 °C
/// and up to 8 % over temperature (DS8626 table 39).
///
/// A crystal that stops later raises an NMI (`faults.rs`); `before` says if it has.
fn start_clocks(rcc: pac::RCC, before: Clock) -> (Clock, Rcc) {
    let (clock, config) = match before {
        Clock::Crystal if crystal_starts(&rcc) => {
            rcc.cr().modify(|_, w| w.csson().set_bit());
            (Clock::Crystal, Config::hse(params::CRYSTAL_HZ.Hz()))
        }
        Clock::Crystal => (Clock::Internal, Config::hsi()),
        known => (known, Config::hsi()),
    };
    (clock, rcc.freeze(config.sysclk(params::CORE_HZ.Hz())))
}

/// Switches a peripheral's clock on and everything in it to its reset value; returns the bus clock in Hz.
fn switch_on<P: Enable + Reset + BusClock>(rcc: &mut Rcc) -> u32 {
    P::enable(rcc);
    P::reset(rcc);
    P::clock(&rcc.clocks).raw()
}

/// Tries to start the crystal. The HAL would wait for it for ever.
fn crystal_starts(rcc: &pac::RCC) -> bool {
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    let begin = DWT::cycle_count();
    let limit = (params::INTERNAL_HZ / 1_000_000).saturating_mul(params::CRYSTAL_START.0 as u32);
    while DWT::cycle_count().wrapping_sub(begin) < limit {
        if rcc.cr().read().hserdy().bit_is_set() {
            return true;
        }
    }
    rcc.cr().modify(|_, w| w.hseon().clear_bit());
    false
}

/// The unique number of the chip (RM0090 section 39.1).
pub fn uid() -> Uid {
    const UID: *const [u32; 3] = 0x1FFF_7A10 as *const _;
    // SAFETY: three aligned words of system memory, which every part has and nothing writes.
    Uid(unsafe { ptr::read_volatile(UID) })
}

//! The numbers of this board and this installation: value, unit, derivation, source.
//!
//! Pins are in `board.rs`. Timing of the sensors is in the codec and bus crates; default settings of each kind of slot (periods,
//! stale limits, rates) are in the gateway's `config.rs`; sizes of queues and waits of one driver are in its file.

use clino_bus::{Duration, Serial, Timing};
use clino_codec::{isu, pwm, t7};
use clino_gateway::config::PWM_PERIOD;
use clino_gateway::{BusSettings, INTERNAL_OSCILLATOR_PPM, PwmInput, SlotConfig, Source};

/// Core clock, Hz: the F407's maximum (DS8626 table 14), and the F446's without over-drive (DS10693 table 16), so that all
/// boards have the same times. APB1 runs at a quarter, APB2 at half of it.
pub const CORE_HZ: u32 = 168_000_000;

/// The internal oscillator the part starts on, Hz (DS8626 table 39).
pub const INTERNAL_HZ: u32 = 16_000_000;

/// How long a crystal may take to start before the internal oscillator is used. DS8626 table 37 gives 2 ms
/// typical; bad weather and age get the rest.
pub const CRYSTAL_START: Duration = Duration::from_micros(20_000);

/// How long safe mode lasts.
pub const SAFE_MODE: Duration = Duration::from_millis(clino_recovery::SAFE_MODE_MS);

/// The microsecond clock: ticks per second.
pub const CLOCK_HZ: u32 = 1_000_000;

/// T7 bus: bit rate, waits, turnaround guard (one character, 87 µs at 115200 bit/s).
pub const T7: BusSettings = BusSettings::new(Timing::t7(Serial::T7_DEFAULT));

/// ISU bus: bit rate, waits, turnaround guard (one character, 1042 µs at 9600 bit/s).
pub const ISU: BusSettings = BusSettings::new(Timing::isu());

/// Console bit rate, 8N1.
pub const CONSOLE: Serial = Serial { baud: 115_200 };

/// Modbus port: address 1, 19200 bit/s, 8E1 (MODBUS over Serial Line V1.02, section 2.5.1).
pub const MODBUS: clino_modbus::Settings = clino_modbus::Settings::DEFAULT;

/// Version of the firmware: major, minor, patch.
pub const VERSION: (u8, u8, u16) = (
    number(env!("CARGO_PKG_VERSION_MAJOR")) as u8,
    number(env!("CARGO_PKG_VERSION_MINOR")) as u8,
    number(env!("CARGO_PKG_VERSION_PATCH")),
);

/// Decimal digits as a number.
const fn number(digits: &str) -> u16 {
    match u16::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => panic!("not a number"),
    }
}

/// A new line is made when fewer characters than this wait for the console: enough to keep the line busy while
/// the next one is made (16 characters last 1.4 ms, making one takes less than 0.1 ms), few enough that the printed values
/// are fresh.
pub const CONSOLE_LOW_WATER: usize = 16;

/// A character that comes so soon after the start may belong to a line that began before it: three times the pause that a USB
/// adapter makes between two frames of 1 ms.
pub const CONSOLE_START: Duration = Duration::from_millis(3);

/// A PWM input without a cycle for this long has no signal: two and a half nominal periods, so that one lost
/// cycle is not yet a fault.
pub const PWM_NO_SIGNAL: Duration = Duration::from_micros(PWM_PERIOD.as_micros() * 5 / 2);

/// Input filter of the capture timers: TIMx_CCMR1.ICxF = 15, eight equal samples at f_DTS/32, which is 3.0 µs at
/// 84 MHz (RM0090 section 18.4.7). Both edges are delayed alike, so the duty cycle is not.
pub const CAPTURE_FILTER: u8 = 0b1111;

/// Limits within which a PWM cycle is an angle, for a timer at `timer_hz`. Without the crystal the period may be off by what
/// the internal oscillator is off.
pub const fn pwm_limits(timer_hz: u32, is_exact: bool) -> pwm::Limits {
    let limits = pwm::Limits::new(timer_hz);
    if is_exact { limits } else { limits.with_clock_error(INTERNAL_OSCILLATOR_PPM) }
}

/// The slot table the gateway starts with.
pub const SLOTS: &[SlotConfig] = &[
    t7_slot(1),
    t7_slot(2),
    t7_slot(3),
    #[cfg(feature = "isu")]
    SlotConfig::usual(Source::Isu { address: isu_address(1) }),
    #[cfg(feature = "pwm")]
    SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 }),
    #[cfg(feature = "pwm")]
    SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm2 }),
];

const fn t7_slot(address: u8) -> SlotConfig {
    SlotConfig::usual(Source::T7 { address: t7_address(address), axis: t7::Axis::Two })
}

/// A mistake in the table above ends the build.
const fn t7_address(address: u8) -> t7::Address {
    match t7::Address::new(address) {
        Some(address) => address,
        None => panic!("not a T7 address"),
    }
}

/// See [`t7_address`].
const fn isu_address(address: u8) -> isu::Address {
    match isu::Address::new(address) {
        Some(address) => address,
        None => panic!("not an ISU address"),
    }
}

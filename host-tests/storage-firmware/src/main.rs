//! Loads the configuration, says what it found, saves the next one, and says what came of it.
//!
//! Configurations are numbered: number `n` is in every slot, in both buses and in the Modbus port, so that a mix of two is
//! none of them. The test that runs this knows the meaning of each word by `slot`.

#![no_std]
#![no_main]

#[path = "../../../src/flash.rs"]
mod flash;

mod board {
    pub use stm32f4xx_hal::pac::FLASH as FlashRegisters;
}

mod watchdog {
    /// No watchdog runs here: no check of the tasks before a sector is erased.
    pub fn look() {}
}

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use clino_bus::{Duration, Serial, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7;
use clino_gateway::config::{AlarmConfig, AlarmLimits, Ask, Direction, Filter, Name};
use clino_gateway::{MAX_SLOTS, Settings, SlotConfig, Source};
use clino_storage::{Loaded, SaveOutcome, Store};
use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use defmt_rtt as _;
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Where each finding is kept.
mod slot {
    /// 1: loaded, 2: saved as well.
    pub const STAGE: usize = 0;
    /// 0: nothing, 1: a configuration, 2: the factory's settings are asked for, 3: an error, 4: a mix.
    pub const FOUND: usize = 1;
    /// Its number.
    pub const NUMBER: usize = 2;
    /// 1: written, 2: unchanged, 3: an error; then likewise for the same once more.
    pub const SAVED: usize = 3;
    pub const SAVED_AGAIN: usize = 4;
    /// Sectors erased.
    pub const ERASES: usize = 5;
    /// Core cycles of the load and of the save.
    pub const LOAD_CYCLES: usize = 6;
    pub const SAVE_CYCLES: usize = 7;
    pub const COUNT: usize = 8;
}

/// RAM is zero at power-up here.
#[unsafe(no_mangle)]
static RESULTS: [AtomicU32; slot::COUNT] = [const { AtomicU32::new(0) }; slot::COUNT];

fn put(slot: usize, value: u32) {
    RESULTS[slot].store(value, Relaxed);
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    let chip = pac::Peripherals::take().unwrap();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let _ = chip.RCC.freeze(Config::hse(8.MHz()).sysclk(168.MHz()));

    let mut sectors = flash::ConfigurationFlash::new(chip.FLASH);
    let mut store = Store::new(&mut sectors);
    let (mut settings, mut port) = numbered(0);
    let begin = DWT::cycle_count();
    let loaded = store.load(&mut settings, &mut port);
    put(slot::LOAD_CYCLES, DWT::cycle_count().wrapping_sub(begin));
    // The soft zero of the configuration that nothing has numbered is the least.
    let number = (settings.slots[0].soft_zero.udeg() + LEAST_ZERO) as u32;
    put(slot::NUMBER, number);
    put(
        slot::FOUND,
        match loaded {
            Ok(_) if numbered(number) != (settings, port) => 4,
            Ok(Loaded::Nothing) => 0,
            Ok(Loaded::Stored { .. }) => 1,
            Ok(Loaded::Factory) => 2,
            Err(_) => 3,
        },
    );
    put(slot::STAGE, 1);

    let (settings, port) = numbered(number + 1);
    for result in [slot::SAVED, slot::SAVED_AGAIN] {
        let begin = DWT::cycle_count();
        let saved = store.save(&settings, &port);
        if result == slot::SAVED {
            put(slot::SAVE_CYCLES, DWT::cycle_count().wrapping_sub(begin));
        }
        put(
            result,
            match saved {
                Ok(SaveOutcome::Written) => 1,
                Ok(SaveOutcome::Unchanged) => 2,
                Err(_) => 3,
            },
        );
    }
    put(slot::ERASES, store.erases());
    put(slot::STAGE, 2);
    loop {
        cortex_m::asm::wfi();
    }
}

/// A turn, µ°: the least soft zero is its negative.
const LEAST_ZERO: i32 = 360_000_000;

/// A long one.
fn numbered(n: u32) -> (Settings, clino_modbus::Settings) {
    let slot = SlotConfig {
        source: Source::T7 { address: t7::Address::FACTORY, axis: t7::Axis::One },
        enabled: false,
        ask: Ask::Everything,
        retries: 10,
        confirm: false,
        filter: Filter::Median,
        samples: 3,
        held_axis: t7::Axis::Two,
        direction: Direction::Reversed,
        range: Range::Unidirectional,
        partner: Some(47),
        tolerance: u16::MAX,
        period: Duration::from_micros(1_200_000_000),
        timeout: Duration::from_micros(500_000),
        stale: Duration::from_micros(3_600_000_000),
        report_every: Duration::from_micros(3_600_000_000),
        soft_zero: Angle::from_udeg(n as i32 - LEAST_ZERO),
        name: Name::new("~~~~~~~~~~~~~~~~").unwrap(),
        max_rate: 36_000_000 - n,
        alarm: AlarmConfig {
            high: 359_999,
            low: -360_000,
            hysteresis: 360_000,
            rate: 36_000_000,
            delay: 36_000,
            no_value: 36_000,
            limits: AlarmLimits::Both,
            latching: true,
        },
    };
    let mut settings = Settings::new(&[slot; MAX_SLOTS], Timing::t7(Serial::T7_DEFAULT), Timing::isu());
    settings.t7.line.pre_delay = Duration::from_micros(n);
    settings.isu.line.pre_delay = Duration::from_micros(n);
    (settings, clino_modbus::Settings { address: (n % 247 + 1) as u8, ..clino_modbus::Settings::DEFAULT })
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::asm::udf()
}

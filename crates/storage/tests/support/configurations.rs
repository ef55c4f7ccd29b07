//! Configurations of all sizes.

use clino_bus::{Duration, Serial, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{AlarmConfig, AlarmLimits, Ask, Direction, Filter, Name};
use clino_gateway::{MAX_SLOTS, PwmInput, Settings, SlotConfig, Source};

/// What is stored, and what is compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Configuration {
    pub settings: Settings,
    pub modbus: clino_modbus::Settings,
}

/// What the gateway has when nothing is stored.
pub fn factory() -> Configuration {
    let settings = Settings::new(&[], Timing::t7(Serial::T7_DEFAULT), Timing::isu());
    Configuration { settings, modbus: clino_modbus::Settings::DEFAULT }
}

/// 32 T7, 14 ISU, two PWM inputs, all as usual.
pub fn usual() -> Configuration {
    let t7 = (1..=32)
        .map(|address| Source::T7 { address: t7::Address::new(address).unwrap(), axis: t7::Axis::Two });
    let isu = (1..=14).map(|address| Source::Isu { address: isu::Address::new(address).unwrap() });
    let pwm = [PwmInput::Pwm1, PwmInput::Pwm2].map(|input| Source::Pwm { input });
    let mut all = factory();
    for (slot, source) in all.settings.slots.iter_mut().zip(t7.chain(isu).chain(pwm)) {
        *slot = SlotConfig::usual(source);
    }
    all
}

/// The usual one, with one number of every slot and port changed: a mix with another `n` is none of the two.
pub fn numbered(n: u32) -> Configuration {
    let mut all = usual();
    for slot in &mut all.settings.slots {
        slot.soft_zero = Angle::from_udeg(n as i32);
    }
    all.settings.t7.line.pre_delay = Duration::from_micros(n % 5_000);
    all.settings.isu.line.pre_delay = Duration::from_micros(n % 5_000);
    all.modbus.address = (n % 247 + 1) as u8;
    all
}

/// As long as a record can be that the gateway takes.
pub fn longest(n: u32) -> Configuration {
    let mut all = factory();
    let slot = SlotConfig {
        source: Source::T7 { address: t7::Address::new(100).unwrap(), axis: t7::Axis::One },
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
        soft_zero: Angle::from_udeg(-360_000_000 + n as i32),
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
    all.settings.slots = [slot; MAX_SLOTS];
    for (bus, post) in [(&mut all.settings.t7, 2_000), (&mut all.settings.isu, 1_000)] {
        (bus.timing.guard, bus.line.guard) = (Duration::from_micros(20_000), Duration::from_micros(20_000));
        bus.line.pre_delay = Duration::from_micros(5_000);
        bus.line.post_delay = Duration::from_micros(post);
    }
    all.modbus.baud = 115_200;
    all.modbus.address = (n % 247 + 1) as u8;
    all
}

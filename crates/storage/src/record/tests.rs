//! What is written is read; what is not a record is refused; old ones are read for ever.

use std::vec::Vec;

use clino_bus::line::EchoMode;
use clino_bus::{Duration, Serial, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{AlarmConfig, AlarmLimits, Ask, Direction, Filter, Kind as SourceKind, Name};
use clino_gateway::order::Refusal;
use clino_gateway::settings::Number;
use clino_gateway::{PwmInput, Settings, Source};
use clino_modbus::settings::{Parity, Pauses, StopBits};
use proptest::prelude::*;

use super::base::base;
use super::*;

type Modbus = clino_modbus::Settings;

fn factory() -> Settings {
    Settings::new(&[], Timing::t7(Serial::T7_DEFAULT), Timing::isu())
}

fn written(settings: &Settings, modbus: &Modbus) -> Vec<u8> {
    let mut buffer = [0; LONGEST];
    let mut fill = Fill::new(&mut buffer);
    encode(Content::Configuration(settings, modbus), &mut fill);
    let left = fill.left().expect("the longest record fits");
    buffer[..LONGEST - left].to_vec()
}

fn read(record: &[u8]) -> Result<(Settings, Modbus), Reject> {
    let (mut settings, mut modbus) = (factory(), Modbus::DEFAULT);
    let take = &mut |part: Part<'_>| match part {
        Part::Bus(Bus::T7, bus) => settings.t7 = *bus,
        Part::Bus(Bus::Isu, bus) => settings.isu = *bus,
        Part::Modbus(port) => modbus = port,
        Part::Console(console) => settings.console = console,
        Part::Slot(slot, config) => settings.slots[usize::from(slot)] = *config,
    };
    match decode(record, take)? {
        Kind::Configuration(_) => Ok((settings, modbus)),
        Kind::Factory => panic!("not a configuration"),
    }
}

/// CRC-32/ISO-HDLC as the catalogue of CRC algorithms describes it.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 != 0 { 0xEDB8_8320 } else { 0 };
        }
    }
    !crc
}

#[test]
fn the_checksum_is_the_one_of_the_catalogue() {
    assert_eq!((bytes::CHECKSUM.checksum(b"123456789"), crc32(b"123456789")), (0xCBF4_3926, 0xCBF4_3926));
}

/// The same with the right checksum at its end.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    [bytes, &crc32(bytes).to_le_bytes()].concat()
}

fn sources() -> impl Strategy<Value = Source> {
    let axis = (0_usize..3).prop_map(|axis| t7::Axis::ALL[axis]);
    let any = (0_u8..4, 0_u8..=127, axis).prop_map(|(kind, address, axis)| {
        let kind = [SourceKind::Off, SourceKind::T7, SourceKind::Isu, SourceKind::Pwm][usize::from(kind)];
        Source::of(kind, address, axis)
    });
    prop_oneof![8 => any, 1 => Just(Source::held(SourceKind::Isu, 0, t7::Axis::Two))]
}

fn slots() -> impl Strategy<Value = SlotConfig> {
    let filter = prop_oneof![Just(Filter::Off), Just(Filter::Mean), Just(Filter::Median)];
    let filter = (filter, 1..=Filter::MOST);
    let switches = (sources(), any::<[bool; 5]>(), 0_u8..=10, filter, prop::option::of(0_u8..48), 0_usize..3);
    let timeout = prop_oneof![Just(0_u32), 2_000_u32..=500_000];
    let numbers = (any::<u16>(), 0_u32..=1_200_000_000, timeout, 0_u32..=3_600_000_000);
    let more = (0_u32..=3_600_000_000, -360_000_000..=360_000_000, 0_u32..=36_000_000, any::<bool>());
    let angle = || -360_000_i32..=360_000;
    let watched = (angle(), angle(), 0_u32..=360_000, 0_u32..=36_000_000, 0_u16..=36_000, 0_u16..=36_000);
    let alarm = (watched, 0_i64..4, any::<bool>()).prop_map(|(watched, limits, latching)| {
        let (high, low, hysteresis, rate, delay, no_value) = watched;
        let limits = AlarmLimits::from_code(limits);
        AlarmConfig { high, low, hysteresis, rate, delay, no_value, limits, latching }
    });
    (switches, numbers, more, "[ !#-~]{0,16}", alarm).prop_map(|(switches, numbers, more, name, alarm)| {
        let (source, switches, retries, (filter, samples), partner, axis) = switches;
        let [enabled, everything, confirm, reversed, positive] = switches;
        let (tolerance, period, timeout, stale) = numbers;
        let (report, soft_zero, max_rate, usual) = more;
        if usual {
            return SlotConfig::usual(source);
        }
        let held_axis = if matches!(source, Source::T7 { .. }) { t7::Axis::Two } else { t7::Axis::ALL[axis] };
        let config = SlotConfig {
            source,
            enabled,
            ask: if everything { Ask::Everything } else { Ask::Angle },
            retries,
            confirm,
            filter,
            samples,
            held_axis,
            direction: if reversed { Direction::Reversed } else { Direction::Normal },
            range: if positive { Range::Unidirectional } else { Range::Bidirectional },
            partner,
            tolerance,
            period: Duration::from_micros(period),
            timeout: Duration::from_micros(timeout),
            stale: Duration::from_micros(stale),
            report_every: Duration::from_micros(report),
            soft_zero: Angle::from_udeg(soft_zero),
            name: Name::new(&name).unwrap(),
            max_rate,
            alarm,
        };
        match settings::slot::check(&config) {
            Ok(()) => config,
            // Too short for the period, or a high limit below the low one.
            Err(_) => SlotConfig {
                stale: Duration::ZERO,
                alarm: AlarmConfig { high: alarm.low, ..alarm },
                ..config
            },
        }
    })
}

fn buses(of: Bus) -> impl Strategy<Value = BusSettings> {
    let echo = prop_oneof![Just(EchoMode::Off), Just(EchoMode::Expected), Just(EchoMode::Detect)];
    (0_usize..5, prop::option::of(0_u32..=20_000), 0_u32..=5_000, 0_u32..=1_000, echo).prop_map(
        move |(rate, guard, pre, post, echo)| {
            let mut timing = match of {
                Bus::T7 => Timing::t7(Serial { baud: [9_600, 19_200, 38_400, 57_600, 115_200][rate] }),
                Bus::Isu => Timing::isu(),
            };
            timing.guard = guard.map_or(timing.guard, Duration::from_micros);
            let mut settings = BusSettings::new(timing);
            settings.line.pre_delay = Duration::from_micros(pre);
            settings.line.post_delay = Duration::from_micros(post);
            settings.line.echo = echo;
            settings
        },
    )
}

fn ports() -> impl Strategy<Value = Modbus> {
    let parity = prop_oneof![Just(Parity::None), Just(Parity::Even), Just(Parity::Odd)];
    let echo = prop_oneof![Just(EchoMode::Off), Just(EchoMode::Expected), Just(EchoMode::Detect)];
    (1_u8..=247, 0_usize..7, parity, any::<[bool; 3]>(), echo).prop_map(
        |(address, rate, parity, [two, strict, locked], echo)| Modbus {
            address,
            baud: clino_modbus::settings::BIT_RATES[rate],
            parity,
            stop_bits: if two { StopBits::Two } else { StopBits::One },
            echo,
            pauses: if strict { Pauses::Strict } else { Pauses::Tolerant },
            locked,
        },
    )
}

fn configurations() -> impl Strategy<Value = (Settings, Modbus)> {
    let slots = prop::collection::vec(slots(), MAX_SLOTS);
    (slots, buses(Bus::T7), buses(Bus::Isu), ports(), 0_u32..=86_400).prop_map(
        |(slots, t7, isu, modbus, idle_s)| {
            let mut settings = factory();
            settings.slots.copy_from_slice(&slots);
            (Settings { t7, isu, console: ConsoleSettings { idle_s }, ..settings }, modbus)
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read((settings, modbus) in configurations()) {
        prop_assert_eq!(check(&settings, &modbus), Ok(()));
        prop_assert_eq!(read(&written(&settings, &modbus)), Ok((settings, modbus)));
    }

    #[test]
    fn anything_may_be_there(bytes in prop::collection::vec(any::<u8>(), 0..LONGEST)) {
        // A right checksum by chance is one in four thousand million.
        prop_assert!(read(&bytes).is_err());
    }

    /// Beyond the checksum: what passes is a configuration that the gateway takes.
    #[test]
    fn anything_may_be_sealed(version in 1..=VERSION, bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok((settings, modbus)) = read(&sealed(&[&[version, CONFIGURATION], &bytes[..]].concat())) {
            prop_assert_eq!(check(&settings, &modbus), Ok(()));
        }
    }

    /// Near a real one, where all of the decoder is reached.
    #[test]
    fn some_bytes_may_be_wrong(
        (settings, modbus) in configurations(),
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut record = written(&settings, &modbus);
        record.truncate(record.len() - CRC);
        wrong.iter().for_each(|(at, byte)| *at.get_mut(&mut record) = *byte);
        if record[0] == 0 || record[0] > VERSION || record[1] != CONFIGURATION {
            return Ok(());
        }
        if let Ok((settings, modbus)) = read(&sealed(&record)) {
            prop_assert_eq!(check(&settings, &modbus), Ok(()));
        }
    }

    #[test]
    fn an_end_may_be_missing((settings, modbus) in configurations(), length in any::<prop::sample::Index>()) {
        let record = written(&settings, &modbus);
        let length = length.index(record.len() - CRC);
        prop_assert!(read(&record[..length]).is_err());
        prop_assert_eq!(read(&sealed(&record[..length])).unwrap_err(), Reject::Short);
    }
}

/// Every wrong bit of a whole record is seen.
#[test]
fn one_bit_is_wrong() {
    let record = written(&factory(), &Modbus::DEFAULT);
    for bit in 0..record.len() * 8 {
        let mut wrong = record.clone();
        wrong[bit / 8] ^= 1 << (bit % 8);
        assert!(matches!(read(&wrong), Err(Reject::Checksum { .. })), "bit {bit}");
    }
}

#[test]
fn something_is_left_over() {
    let record = written(&factory(), &Modbus::DEFAULT);
    let longer = [&record[..record.len() - CRC], &[0, 0]].concat();
    assert_eq!(read(&sealed(&longer)), Err(Reject::Surplus(2)));
}

#[test]
fn a_newer_firmware_was_here() {
    assert_eq!(read(&sealed(&[VERSION + 1, 77, 78, 79])), Err(Reject::Newer { version: VERSION + 1 }));
    // Not whole, so that its version is unknown.
    assert!(matches!(read(&[VERSION + 1, 77, 78, 79, 0, 0]), Err(Reject::Checksum { .. })));
}

#[test]
fn version_zero_never_was() {
    assert_eq!(read(&sealed(&[0, 0])), Err(Reject::Code { what: "version", code: 0 }));
}

/// What the gateway would refuse is refused on both ways.
#[test]
fn limits_are_those_of_orders() {
    let mut settings = factory();
    settings.slots[7] = SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 });
    settings.slots[7].retries = 11;
    let number = Number { name: "retries", unit: "", value: 11, decimals: 0 };
    let refusal = Reject::Refused(Refusal::Range { number, least: 0, most: 10 });
    assert_eq!(check(&settings, &Modbus::DEFAULT), Err(refusal));
    assert_eq!(read(&written(&settings, &Modbus::DEFAULT)), Err(refusal));

    let modbus = Modbus { address: 248, ..Modbus::DEFAULT };
    let number = Number { name: "address", unit: "", value: 248, decimals: 0 };
    let refusal = Reject::Refused(Refusal::Range { number, least: 1, most: 247 });
    assert_eq!(check(&factory(), &modbus), Err(refusal));
    assert_eq!(read(&written(&factory(), &modbus)), Err(refusal));
}

/// Otherwise the usual slots are longer than they need to be: time for a new version of the format.
#[test]
fn the_base_is_the_usual() {
    let t7 = Source::T7 { address: t7::Address::new(5).unwrap(), axis: t7::Axis::One };
    let isu = Source::Isu { address: isu::Address::new(9).unwrap() };
    for source in [Source::Off, t7, isu, Source::Pwm { input: PwmInput::Pwm2 }] {
        assert_eq!(base(source), SlotConfig::usual(source));
    }
}

/// The longest there can be is as long as the buffer, but for the padding to a word.
#[test]
fn the_longest_fits() {
    let mut settings = factory();
    settings.slots = [longest_slot(); MAX_SLOTS];
    for (bus, post) in [(&mut settings.t7, 2_000), (&mut settings.isu, 1_000)] {
        bus.timing.guard = Duration::from_micros(20_000);
        bus.line = bus.timing.line();
        bus.line.pre_delay = Duration::from_micros(5_000);
        bus.line.post_delay = Duration::from_micros(post);
        bus.line.echo = EchoMode::Detect;
    }
    settings.t7 = BusSettings {
        timing: Timing { serial: Serial { baud: 57_600 }, ..settings.t7.timing },
        ..settings.t7
    };
    settings.console.idle_s = 86_400;
    let modbus = Modbus {
        address: 247,
        baud: 115_200,
        parity: Parity::Odd,
        stop_bits: StopBits::Two,
        echo: EchoMode::Detect,
        pauses: Pauses::Strict,
        locked: true,
    };
    assert_eq!(check(&settings, &modbus), Ok(()));
    let longest = written(&settings, &modbus).len();
    // The bit rates of a T7 take three bytes, those of an ISU have no other; a word is four.
    assert!((LONGEST - 8..=LONGEST).contains(&longest), "{longest} of {LONGEST}");
}

fn longest_slot() -> SlotConfig {
    SlotConfig {
        source: Source::T7 { address: t7::Address::new(100).unwrap(), axis: t7::Axis::One },
        enabled: false,
        ask: Ask::Everything,
        retries: 10,
        confirm: false,
        filter: Filter::Median,
        samples: 8,
        held_axis: t7::Axis::Two,
        direction: Direction::Reversed,
        range: Range::Unidirectional,
        partner: Some(47),
        tolerance: u16::MAX,
        period: Duration::from_micros(1_200_000_000),
        timeout: Duration::from_micros(500_000),
        stale: Duration::from_micros(3_599_999_999),
        report_every: Duration::from_micros(3_600_000_000),
        soft_zero: Angle::from_udeg(-360_000_000),
        name: Name::new("~~~~~~~~~~~~~~~~").unwrap(),
        max_rate: 36_000_000,
        alarm: AlarmConfig {
            high: 360_000,
            low: -360_000,
            hysteresis: 360_000,
            rate: 36_000_000,
            delay: 36_000,
            no_value: 36_000,
            limits: AlarmLimits::Both,
            latching: true,
        },
    }
}

mod stored {
    //! Records as they lie in flash, checksums by zlib. These bytes never change.

    use super::*;

    /// 115200 bit/s; 87 µs, 2 ms, 25 ms, 87 µs, 348 µs, 87 µs, 6 ms, 25 ms, 2 ms, 5.903 ms; 115200 bit/s, 87 µs, 0, 0, off.
    #[rustfmt::skip]
    const T7: &[u8] = &[
    0x80, 0x84, 0x07, 0x57, 0xD0, 0x0F, 0xA8, 0xC3, 0x01, 0x57, 0xDC, 0x02, 0x57, 0xF0, 0x2E, 0xA8, 0xC3,
    0x01, 0xD0, 0x0F, 0x8F, 0x2E, 0x80, 0x84, 0x07, 0x57, 0x00, 0x00, 0x00,
    ];
    /// 9600 bit/s; 1.042 ms, 51 ms, 401 ms, 1.042 ms, 10.417 ms, 2.084 ms, 50 ms, 400 ms, 50 ms, 267.709 ms; 9600 bit/s,
    /// 1.042 ms, 0, 0, off.
    #[rustfmt::skip]
    const ISU: &[u8] = &[
    0x80, 0x4B, 0x92, 0x08, 0xB8, 0x8E, 0x03, 0xE8, 0xBC, 0x18, 0x92, 0x08, 0xB1, 0x51, 0xA4, 0x10, 0xD0,
    0x86, 0x03, 0x80, 0xB5, 0x18, 0xD0, 0x86, 0x03, 0xBD, 0xAB, 0x10, 0x80, 0x4B, 0x92, 0x08, 0x00, 0x00,
    0x00,
    ];
    /// Server 17, 9600 bit/s, no parity, two stop bits.
    const MODBUS: &[u8] = &[0x11, 0x80, 0x4B, 0x00, 0x01];
    /// T7 3, axis 2, as usual; ISU 14, disabled, soft zero −1.5°; PWM 2, median of 5, partner 1.
    #[rustfmt::skip]
    const SLOTS: &[u8] = &[
    0x01, 0x03, 0x02, 0x00, 0x02, 0x0E, 0x81, 0x40, 0xBF, 0x8D, 0xB7, 0x01, 0x03, 0x01, 0xC0, 0x01, 0x02,
    0x05, 0x02,
    ];
    const OFF: [u8; 2] = [0, 0];

    fn record(version: u8, parts: &[&[u8]], crc: u32) -> Vec<u8> {
        let slots = [&[MAX_SLOTS as u8], SLOTS, &OFF.repeat(MAX_SLOTS - 3)].concat();
        [&[version, CONFIGURATION], &parts.concat()[..], &slots, &crc.to_le_bytes()].concat()
    }

    fn expected() -> Settings {
        let t7 = Source::T7 { address: t7::Address::new(3).unwrap(), axis: t7::Axis::Two };
        let isu = Source::Isu { address: isu::Address::new(14).unwrap() };
        let mut settings = factory();
        settings.slots[0] = SlotConfig {
            source: t7,
            enabled: true,
            retries: 1,
            confirm: true,
            period: Duration::from_millis(20),
            report_every: Duration::from_millis(100),
            tolerance: 100,
            max_rate: 180_000,
            ..SlotConfig::OFF
        };
        settings.slots[1] = SlotConfig {
            source: isu,
            retries: 1,
            confirm: true,
            range: Range::Unidirectional,
            period: Duration::from_millis(266),
            soft_zero: Angle::from_udeg(-1_500_000),
            max_rate: 90_000,
            ..SlotConfig::OFF
        };
        settings.slots[2] = SlotConfig {
            source: Source::Pwm { input: PwmInput::Pwm2 },
            enabled: true,
            filter: Filter::Median,
            samples: 5,
            range: Range::Unidirectional,
            partner: Some(1),
            tolerance: 560,
            period: Duration::from_micros(33_333),
            ..SlotConfig::OFF
        };
        settings
    }

    const PORT: Modbus = Modbus {
        address: 17,
        baud: 9_600,
        parity: Parity::None,
        stop_bits: StopBits::Two,
        echo: EchoMode::Off,
        pauses: Pauses::Tolerant,
        locked: false,
    };

    /// The same as versions 1 and 2 have it: nothing of a bus is different, four settings of the port are.
    #[test]
    fn version_3() {
        #[rustfmt::skip]
        let record = [
            &[3, CONFIGURATION, 0, 0][..],
            // Address, bit rate, parity and stop bits: 17, 9600, none, 2.
            &[0x0F, 0x11, 0x80, 0x4B, 0x00, 0x02],
            // Console; number of slots.
            &[0, MAX_SLOTS as u8],
            // T7 3 as usual; ISU 14: bits 3 and 13 (enabled, zero); PWM 2: bits 11, 12 and 17 (filter, samples, partner).
            &[1, 3, 0, 2, 14, 0x88, 0x40, 0xBF, 0x8D, 0xB7, 0x01],
            &[3, 2, 0x80, 0xB0, 0x08, 2, 5, 2],
            &OFF.repeat(MAX_SLOTS - 3),
        ]
        .concat();
        let record = sealed(&record);
        assert_eq!(written(&expected(), &PORT), record);
        assert_eq!(read(&record), Ok((expected(), PORT)));
        assert_eq!(decode(&record, &mut |_| ()), Ok(Kind::Configuration(3)));
    }

    #[test]
    fn version_2() {
        let record = record(2, &[T7, ISU, MODBUS], 0xF75A196);
        assert_eq!(read(&record), Ok((expected(), PORT)));
        assert_eq!(decode(&record, &mut |_| ()), Ok(Kind::Configuration(2)));
    }

    /// Without the Modbus port, which is then as in the factory; the rest is kept.
    #[test]
    fn version_1() {
        let record = record(1, &[T7, ISU], 0xA0DB65EA);
        assert_eq!(read(&record), Ok((expected(), Modbus::DEFAULT)));
        assert_eq!(decode(&record, &mut |_| ()), Ok(Kind::Configuration(1)));
    }

    /// A slot of version 2 alone.
    fn old_slot(slot: &[u8]) -> SlotConfig {
        let bytes = [&[2, CONFIGURATION], T7, ISU, MODBUS, &[1], slot].concat();
        read(&sealed(&bytes)).expect("a record").0.slots[0]
    }

    /// What was allowed, and does not fit any more: a period of a second with the stale limit of 20 ms (60 ms, not
    /// written); the same, written; a timeout of 0.1 ms; a rate beyond all; a soft zero beyond a turn. A limit that fits is
    /// kept.
    #[test]
    fn what_older_versions_allowed_becomes_what_comes_next_to_it() {
        // Bit 9: 1 000 000 us.
        let slot = old_slot(&[1, 3, 2, 0x80, 0x04, 0xC0, 0x84, 0x3D]);
        assert_eq!((slot.stale, slot.stale_after()), (Duration::ZERO, Duration::from_millis(3_000)));
        // Bits 9 and 11: 1 000 000 us, 60 000 us.
        let slot = old_slot(&[1, 3, 2, 0x80, 0x14, 0xC0, 0x84, 0x3D, 0xE0, 0xD4, 0x03]);
        assert_eq!((slot.stale, slot.stale_after()), (Duration::ZERO, Duration::from_millis(3_000)));
        // Bit 11: 100 000 us.
        let slot = old_slot(&[1, 3, 2, 0x80, 0x10, 0xA0, 0x8D, 0x06]);
        assert_eq!(
            (slot.stale, slot.stale_after()),
            (Duration::from_millis(100), Duration::from_millis(100))
        );
        // Bit 10: 100 us.
        assert_eq!(old_slot(&[1, 3, 2, 0x80, 0x08, 100]).timeout, Duration::ZERO);
        // Bit 14: 4 294 967 295.
        assert_eq!(old_slot(&[1, 3, 2, 0x80, 0x80, 0x01, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F]).max_rate, 0);
        // Bit 13: 450 000 000 udeg, zigzag 900 000 000.
        let slot = old_slot(&[1, 3, 2, 0x80, 0x40, 0x80, 0xD2, 0x93, 0xAD, 0x03]);
        assert_eq!(slot.soft_zero, Angle::from_udeg(90_000_000));
    }

    /// A driver that stayed on for longer than any sensor waits.
    #[test]
    fn a_delay_of_an_older_version_is_the_longest_there_may_be() {
        let mut t7 = T7.to_vec();
        let end = t7.len() - 2..t7.len() - 1;
        // 5000 us.
        t7.splice(end, [0x88, 0x27]);
        let bytes = [&[2, CONFIGURATION], &t7[..], ISU, MODBUS, &[0]].concat();
        let (settings, _) = read(&sealed(&bytes)).expect("a record");
        assert_eq!(settings.t7.line.post_delay, Duration::from_micros(2_000));
    }

    #[test]
    fn factory_settings() {
        assert_eq!(decode(&sealed(&[3, FACTORY]), &mut |_| ()), Ok(Kind::Factory));
        let record = [0x02, 0x01, 0xEB, 0x40, 0xE8, 0x04];
        assert_eq!(decode(&record, &mut |_| ()), Ok(Kind::Factory));
    }

    /// A gateway that knows fewer slots stored it: the others are off.
    #[test]
    fn fewer_slots() {
        let bytes = [&[2, CONFIGURATION], T7, ISU, MODBUS, &[3], SLOTS].concat();
        assert_eq!(read(&sealed(&bytes)).map(|(settings, _)| settings), Ok(expected()));
    }
}

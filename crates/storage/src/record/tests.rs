//! What is written is read; what is not a record is refused; old ones are read for ever.

use std::vec::Vec;

use clino_bus::line::EchoMode;
use clino_bus::{Micros, Serial, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{Ask, Direction, Filter};
use clino_gateway::order::{Refusal, T7_BIT_RATES};
use clino_gateway::{PwmInput, Settings, Source, Span};
use clino_modbus::settings::{Parity, StopBits};
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
    prop_oneof![
        Just(Source::Off),
        (1_u8..=100, 0_usize..3).prop_map(|(address, axis)| Source::T7 {
            address: t7::Address::new(address).unwrap(),
            axis: t7::Axis::ALL[axis]
        }),
        (0_u8..=14).prop_map(|address| Source::Isu { address: isu::Address::new(address).unwrap() }),
        prop_oneof![Just(PwmInput::Pwm1), Just(PwmInput::Pwm2)].prop_map(|input| Source::Pwm { input }),
    ]
}

fn slots() -> impl Strategy<Value = SlotConfig> {
    let filter = prop_oneof![
        Just(Filter::Off),
        (1..=Filter::MOST).prop_map(Filter::Mean),
        (1..=Filter::MOST).prop_map(Filter::Median)
    ];
    let switches = (sources(), any::<[bool; 5]>(), 0_u8..=10, filter, prop::option::of(0_u8..48));
    let numbers = (any::<u16>(), 0_u32..=1_200_000_000, 0_u32..=500_000, 10_000_u32..=3_600_000_000);
    let more = (0_u32..=3_600_000_000, any::<i32>(), any::<u32>(), any::<bool>());
    (switches, numbers, more).prop_map(|(switches, numbers, more)| {
        let (source, [enabled, everything, confirm, reversed, positive], retries, filter, partner) = switches;
        let (tolerance, period, timeout, stale) = numbers;
        let (report, soft_zero, max_rate, usual) = more;
        if usual {
            return SlotConfig::usual(source);
        }
        SlotConfig {
            source,
            enabled,
            ask: if everything { Ask::Everything } else { Ask::Angle },
            retries,
            confirm,
            filter,
            direction: if reversed { Direction::Reversed } else { Direction::Normal },
            range: if positive { Range::Unidirectional } else { Range::Bidirectional },
            partner,
            tolerance,
            period: Span::from_micros(period),
            timeout: Span::from_micros(timeout),
            stale_after: Span::from_micros(stale),
            report_every: Span::from_micros(report),
            soft_zero: Angle::from_udeg(soft_zero),
            max_rate,
        }
    })
}

fn buses(of: Bus) -> impl Strategy<Value = BusSettings> {
    let echo = prop_oneof![Just(EchoMode::Off), Just(EchoMode::Expected), Just(EchoMode::Detect)];
    (0_usize..5, 0_u64..=20_000, 0_u64..=5_000, 0_u64..=5_000, any::<u32>(), echo).prop_map(
        move |(rate, guard, pre, post, slack, echo)| {
            let timing = match of {
                Bus::T7 => Timing::t7(Serial { baud: T7_BIT_RATES[rate] }),
                Bus::Isu => Timing::isu(),
            };
            let timing = Timing { guard: Micros(guard), slack: Micros(slack.into()), ..timing };
            let mut settings = BusSettings::new(timing);
            settings.line.pre_delay = Micros(pre);
            settings.line.post_delay = Micros(post);
            settings.line.echo = echo;
            settings
        },
    )
}

fn ports() -> impl Strategy<Value = Modbus> {
    let parity = prop_oneof![Just(Parity::None), Just(Parity::Even), Just(Parity::Odd)];
    (1_u8..=247, 0_usize..7, parity, any::<bool>()).prop_map(|(address, rate, parity, two)| Modbus {
        address,
        baud: clino_modbus::settings::BIT_RATES[rate],
        parity,
        stop_bits: if two { StopBits::Two } else { StopBits::One },
        ..Modbus::DEFAULT
    })
}

fn configurations() -> impl Strategy<Value = (Settings, Modbus)> {
    let slots = prop::collection::vec(slots(), MAX_SLOTS);
    (slots, buses(Bus::T7), buses(Bus::Isu), ports()).prop_map(|(slots, t7, isu, modbus)| {
        let mut settings = factory();
        settings.slots.copy_from_slice(&slots);
        (Settings { t7, isu, ..settings }, modbus)
    })
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
    // Not whole, so that nobody knows who was here.
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
    let refusal = Reject::Refused(Refusal::Range { what: "retries", value: 11, least: 0, most: 10 });
    assert_eq!(check(&settings, &Modbus::DEFAULT), Err(refusal));
    assert_eq!(read(&written(&settings, &Modbus::DEFAULT)), Err(refusal));

    let modbus = Modbus { address: 248, ..Modbus::DEFAULT };
    assert_eq!(check(&factory(), &modbus), Err(Reject::Modbus));
    assert_eq!(read(&written(&factory(), &modbus)), Err(Reject::Modbus));
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
    for bus in [&mut settings.t7, &mut settings.isu] {
        let all = Micros(u64::MAX);
        bus.timing = Timing {
            serial: Serial { baud: u32::MAX },
            guard: all,
            get_latency: all,
            set_latency: all,
            margin: all,
            gap: all,
            quiet: all,
            patience: all,
            late: all,
            slack: all,
            line_busy: all,
        };
        bus.line = bus.timing.line();
        bus.line.pre_delay = all;
        bus.line.post_delay = all;
    }
    let modbus = Modbus { baud: u32::MAX, ..Modbus::DEFAULT };
    assert_eq!(written(&settings, &modbus).len().next_multiple_of(crate::pages::WORD), LONGEST);
}

fn longest_slot() -> SlotConfig {
    let all = Span::from_micros(u32::MAX);
    SlotConfig {
        source: Source::T7 { address: t7::Address::new(100).unwrap(), axis: t7::Axis::Two },
        enabled: false,
        ask: Ask::Everything,
        retries: 10,
        confirm: false,
        filter: Filter::Median(3),
        direction: Direction::Reversed,
        range: Range::Unidirectional,
        partner: Some(47),
        tolerance: u16::MAX,
        period: all,
        timeout: all,
        stale_after: all,
        report_every: all,
        soft_zero: Angle::from_udeg(i32::MIN),
        max_rate: u32::MAX,
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
            period: Span::from_millis(20),
            stale_after: Span::from_millis(60),
            report_every: Span::from_millis(100),
            tolerance: 100,
            max_rate: 180_000,
            ..SlotConfig::OFF
        };
        settings.slots[1] = SlotConfig {
            source: isu,
            retries: 1,
            confirm: true,
            range: Range::Unidirectional,
            period: Span::from_millis(266),
            stale_after: Span::from_millis(798),
            soft_zero: Angle::from_udeg(-1_500_000),
            max_rate: 90_000,
            ..SlotConfig::OFF
        };
        settings.slots[2] = SlotConfig {
            source: Source::Pwm { input: PwmInput::Pwm2 },
            enabled: true,
            filter: Filter::Median(5),
            range: Range::Unidirectional,
            partner: Some(1),
            tolerance: 56,
            period: Span::from_micros(33_333),
            stale_after: Span::from_micros(99_999),
            ..SlotConfig::OFF
        };
        settings
    }

    #[test]
    fn version_2() {
        let modbus = Modbus {
            address: 17,
            baud: 9_600,
            parity: Parity::None,
            stop_bits: StopBits::Two,
            ..Modbus::DEFAULT
        };
        let record = record(2, &[T7, ISU, MODBUS], 0xF75A196);
        assert_eq!(read(&record), Ok((expected(), modbus)));
        assert_eq!(written(&expected(), &modbus), record);
    }

    /// Without the Modbus port, which is then as in the factory; the rest is kept.
    #[test]
    fn version_1() {
        let record = record(1, &[T7, ISU], 0xA0DB65EA);
        assert_eq!(read(&record), Ok((expected(), Modbus::DEFAULT)));
        assert_eq!(decode(&record, &mut |_| ()), Ok(Kind::Configuration(1)));
    }

    #[test]
    fn factory_settings() {
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

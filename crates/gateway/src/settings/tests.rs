//! The tables are sound, and what comes of a change of a slot.

use clino_bus::Duration;
use std::collections::BTreeSet;
use std::vec::Vec;

use super::setting::{Definition, Form, Given, Setting};
use super::slot::{self, id};
use super::{bus, console, port};
use crate::config::{Bus, Filter, Kind, Name, SlotConfig, Source};
use crate::refusal::Refusal;
use clino_codec::t7::Axis;

fn source(kind: Kind, address: u8) -> Source {
    Source::of(kind, address, Axis::Two)
}

fn usual(kind: Kind, address: u8) -> SlotConfig {
    SlotConfig::usual(source(kind, address))
}

/// Names these settings, exactly.
fn changed(now: &SlotConfig, named: &[(u8, i64)]) -> Result<SlotConfig, Refusal> {
    slot::changed(now, &|id| {
        named.iter().find(|(named, _)| *named == id).map(|&(_, value)| Given::exactly(value))
    })
}

fn sound<T>(table: &[Setting<T>], of: &T) {
    let ids: BTreeSet<u8> = table.iter().map(|setting| setting.id).collect();
    assert!(
        ids.len() == table.len() && !ids.contains(&0) && ids.last() <= Some(&64),
        "ids are distinct, and have a bit"
    );
    let names: BTreeSet<&str> = table.iter().map(|setting| setting.name).collect();
    assert_eq!(names.len(), table.len());
    for setting in table {
        let Definition { name, form, text, .. } = **setting;
        assert!(name.len() <= 10 && !text.is_empty(), "{name}");
        let (least, most) = form.limits();
        assert!(form.allows(least) && form.allows(most) && !form.allows(most + 1), "{name}");
        assert!(!form.allows(least - 1), "{name}");
        setting.check((setting.get)(of)).expect(name);
    }
}

#[test]
fn tables_are_sound() {
    sound(&slot::SETTINGS, &SlotConfig::OFF);
    sound(&port::SETTINGS, &port::PortSettings::DEFAULT);
    sound(&console::SETTINGS, &console::ConsoleSettings::DEFAULT);
    for bus in Bus::ALL {
        sound(bus::settings(bus), &super::BusSettings::first(bus));
    }
}

/// Stored records name settings by these numbers.
#[test]
fn ids_never_change() {
    let ids = |kind: &str| -> Vec<(u8, &str)> {
        match kind {
            "slot" => slot::SETTINGS.iter().map(|setting| (setting.id, setting.name)).collect(),
            "bus" => bus::T7_SETTINGS.iter().map(|setting| (setting.id, setting.name)).collect(),
            "port" => port::SETTINGS.iter().map(|setting| (setting.id, setting.name)).collect(),
            _ => console::SETTINGS.iter().map(|setting| (setting.id, setting.name)).collect(),
        }
    };
    for pair in [
        (1, "kind"),
        (2, "address"),
        (3, "axis"),
        (4, "enabled"),
        (5, "ask"),
        (6, "period"),
        (7, "timeout"),
        (8, "retries"),
        (9, "stale"),
        (10, "report"),
        (11, "confirm"),
        (12, "filter"),
        (13, "samples"),
        (14, "zero"),
        (15, "direction"),
        (16, "range"),
        (17, "rate"),
        (18, "partner"),
        (19, "tolerance"),
        (20, "stale_auto"),
        (21, "name"),
        (24, "name_4"),
        (25, "alarm"),
        (26, "high"),
        (27, "low"),
        (28, "hysteresis"),
        (29, "delay"),
        (30, "latch"),
        (31, "alarm_rate"),
        (32, "no_value"),
    ] {
        assert!(ids("slot").contains(&pair), "{pair:?}");
    }
    assert_eq!(ids("bus"), [(1, "baud"), (2, "guard"), (3, "pre"), (4, "post"), (5, "echo")]);
    let port = [
        (1, "address"),
        (2, "baud"),
        (3, "parity"),
        (4, "stop_bits"),
        (5, "echo"),
        (6, "pauses"),
        (7, "locked"),
    ];
    assert_eq!(ids("port"), port);
    assert_eq!(ids("console"), [(1, "idle")]);
}

/// Each setting keeps what it is set to, and no other setting moves with it.
#[test]
fn each_setting_is_a_field_of_its_own() {
    // A stale limit and whether it follows are one field; kind, address and axis are a source.
    let linked = |id| matches!(id, id::KIND | id::ADDRESS | id::AXIS | id::STALE | id::STALE_AUTO);
    for kind in Kind::ALL {
        let before = SlotConfig { stale: Duration::from_millis(2_000), ..usual(kind, 1) };
        for setting in slot::SETTINGS.iter().filter(|setting| !linked(setting.id)) {
            let (least, most) = setting.form.limits();
            for value in [least, most] {
                let mut config = before;
                (setting.set)(&mut config, value);
                assert_eq!((setting.get)(&config), value, "{}", setting.name);
                for other in slot::SETTINGS.iter().filter(|other| other.id != setting.id) {
                    assert_eq!(
                        (other.get)(&config),
                        (other.get)(&before),
                        "{} moves {}",
                        setting.name,
                        other.name
                    );
                }
            }
        }
    }
}

#[test]
fn the_usual_is_allowed_and_a_change_of_nothing_is_none() {
    for (kind, address) in
        [(Kind::Off, 0), (Kind::T7, 5), (Kind::Isu, 3), (Kind::Pwm, 1), (Kind::T7, 0), (Kind::Pwm, 9)]
    {
        let config = usual(kind, address);
        assert_eq!(slot::check(&config), Ok(()), "{kind:?}");
        assert_eq!(changed(&config, &[]), Ok(config));
        // All of it, as it is.
        let all: Vec<(u8, i64)> =
            slot::SETTINGS.iter().map(|setting| (setting.id, (setting.get)(&config))).collect();
        assert_eq!(changed(&config, &all), Ok(config), "{kind:?} {address}");
    }
}

/// Three times the longer of period and timeout; not less than the sensor's pace allows.
#[test]
fn a_stale_limit_follows() {
    for (kind, period_ms, timeout_ms, expected_us) in [
        (Kind::T7, 20, 0, 60_000),
        (Kind::T7, 1_000, 0, 3_000_000),
        (Kind::T7, 1, 0, 30_000),
        (Kind::T7, 20, 400, 1_200_000),
        (Kind::T7, 0, 0, 1_000_000),
        (Kind::T7, 0, 500, 1_500_000),
        (Kind::Isu, 266, 0, 798_000),
        (Kind::Isu, 5, 0, 150_000),
        (Kind::Pwm, 10, 0, 99_999),
        (Kind::T7, 1_200_000, 0, 3_600_000_000),
    ] {
        let named = [(id::PERIOD, period_ms * 1_000), (id::TIMEOUT, timeout_ms * 1_000)];
        let config = changed(&usual(kind, 1), &named).expect("a slot");
        assert_eq!(
            i64::from(config.stale_after().as_micros()),
            expected_us,
            "{kind:?} {period_ms} {timeout_ms}"
        );
        assert_eq!(config.stale, Duration::ZERO);
    }
}

#[test]
fn what_does_not_fit_is_refused_with_both_numbers() {
    let t7 = usual(Kind::T7, 5);
    let set = changed(&t7, &[(id::STALE, 100_000)]).expect("a limit");
    let Err(Refusal::Shorter { number, least }) = changed(&set, &[(id::PERIOD, 100_001)]) else {
        panic!("it fits")
    };
    assert_eq!((number.name, number.value, least.name, least.value), ("stale", 100_000, "period", 100_001));
    assert!(changed(&set, &[(id::PERIOD, 100_000)]).is_ok());
    assert!(changed(&set, &[(id::PERIOD, 200_000), (id::STALE, 200_000)]).is_ok());
    assert!(changed(&set, &[(id::PERIOD, 200_000), (id::STALE_AUTO, 1)]).is_ok());
    let Err(Refusal::Shorter { number, least }) = changed(&t7, &[(id::TIMEOUT, 1_999)]) else {
        panic!("it fits")
    };
    assert_eq!((number.name, number.value, least.value), ("timeout", 1_999, 2_000));
    assert!(changed(&usual(Kind::Isu, 5), &[(id::TIMEOUT, 1_000)]).is_ok());
    assert!(changed(&usual(Kind::Pwm, 1), &[(id::STALE, 33_332)]).is_err());
    // Named together, one excludes the other.
    let both = [(id::STALE, 70_000), (id::STALE_AUTO, 1)];
    assert_eq!(changed(&t7, &both), Err(Refusal::Excluded("stale")));
}

#[test]
fn another_kind_brings_its_usual_settings_for_what_is_not_named() {
    let t7 = SlotConfig {
        filter: Filter::Mean,
        samples: 4,
        name: Name::new("Boom").unwrap(),
        ..usual(Kind::T7, 5)
    };
    assert_eq!(changed(&t7, &[(id::KIND, 2)]), Ok(usual(Kind::Isu, 5)));
    let kept = changed(&t7, &[(id::KIND, 2), (id::ADDRESS, 3), (id::PERIOD, 20_000), (id::RETRIES, 1)]);
    assert_eq!(kept, Ok(SlotConfig { period: Duration::from_millis(20), ..usual(Kind::Isu, 3) }));
    assert_eq!(changed(&t7, &[(id::KIND, 0)]), Ok(SlotConfig::OFF));
    // An address that the kind does not have is held; one that is named is refused.
    let held = changed(&t7, &[(id::KIND, 3)]).expect("held");
    assert_eq!(held.source, Source::Incomplete { kind: Kind::Pwm, address: 5 });
    assert!(held.source.is_faulty() && !held.is_on());
    for (kind, address) in [(3, 3), (2, 15), (1, 0), (1, 101), (0, 101)] {
        let refused = changed(&t7, &[(id::KIND, kind), (id::ADDRESS, address)]);
        assert!(matches!(refused, Err(Refusal::Address { .. })), "{kind} {address}: {refused:?}");
    }
    assert!(matches!(changed(&t7, &[(id::KIND, 4)]), Err(Refusal::Range { .. })));
}

/// What an unused slot is told stays when it gets a kind.
#[test]
fn an_unused_slot_holds_what_it_is_told() {
    let mut config = SlotConfig::OFF;
    for named in [(id::AXIS, 1), (id::PERIOD, 50_000), (id::ADDRESS, 9), (id::FILTER, 2), (id::SAMPLES, 5)] {
        config = changed(&config, &[named]).expect("held");
        assert!(!config.is_on() && !config.source.is_faulty());
    }
    let config = changed(&config, &[(id::KIND, 1)]).expect("a T7");
    let expected = SlotConfig {
        source: Source::of(Kind::T7, 9, Axis::One),
        period: Duration::from_millis(50),
        filter: Filter::Median,
        samples: 5,
        ..usual(Kind::T7, 9)
    };
    // The axis is that of the source.
    assert_eq!(SlotConfig { held_axis: Axis::Two, ..config }, expected);
}

/// An ISU is asked at address 0, which all answer, only when that was said.
#[test]
fn no_address_is_not_address_zero() {
    let isu = changed(&SlotConfig::OFF, &[(id::KIND, 2)]).expect("held");
    assert!(isu.source.is_faulty());
    let told = changed(&isu, &[(id::ADDRESS, 0)]).expect("an ISU");
    assert_eq!(told, usual(Kind::Isu, 0));
    assert_eq!(changed(&SlotConfig::OFF, &[(id::KIND, 2), (id::ADDRESS, 0)]), Ok(usual(Kind::Isu, 0)));
    // A block of it that is written back says nothing new.
    assert_eq!(changed(&isu, &[(id::KIND, 2), (id::ADDRESS, 0)]), Ok(isu));
}

/// A door that counts in whole milliseconds does not cut what it cannot tell.
#[test]
fn a_coarse_value_that_is_there_is_left_as_it_is() {
    let pwm = usual(Kind::Pwm, 1);
    let named = |value| move |id: u8| (id == id::PERIOD).then_some(Given { value, scale: 1_000 });
    assert_eq!(slot::changed(&pwm, &named(33)), Ok(pwm));
    assert_eq!(slot::changed(&pwm, &named(34)).map(|config| config.period), Ok(Duration::from_millis(34)));
}

#[test]
fn names_are_printable() {
    for (text, valid) in
        [("", true), ("Boom left", true), ("0123456789abcdef", true), ("0123456789abcdefg", false)]
    {
        assert_eq!(Name::new(text).is_some(), valid, "{text}");
    }
    for text in ["a\tb", "\u{e4}", "say \"x\"", "a\0b"] {
        assert_eq!(Name::new(text), None, "{text}");
    }
    let name = Name::new("Boom 1").unwrap();
    assert_eq!([name.part(0), name.part(1), name.part(2)], [0x426F_6F6D, 0x2031_0000, 0]);
    assert!(changed(&SlotConfig::OFF, &[(id::NAME[1], 0x4141_4141)]).is_err(), "behind the end");
    assert!(!Form::Characters.allows(0x4100_4100));
}

#[test]
fn limits_of_an_alarm_fit_each_other_only_where_both_count() {
    let now = usual(Kind::T7, 5);
    let set = |limits, high, low| changed(&now, &[(id::ALARM, limits), (id::HIGH, high), (id::LOW, low)]);
    let refused = set(3, -5_000, 5_000);
    assert!(matches!(refused, Err(Refusal::Shorter { number, .. }) if number.name == "high"), "{refused:?}");
    // One limit alone may lie anywhere, and both in one point are a band without width.
    for (limits, high, low) in [(0, -5_000, 5_000), (1, -5_000, 5_000), (2, -5_000, 5_000), (3, 5_000, 5_000)]
    {
        let config = set(limits, high, low).unwrap();
        assert_eq!((i64::from(config.alarm.high), i64::from(config.alarm.low)), (high, low));
    }
    for (id, most) in
        [(id::HIGH, 360_000), (id::LOW, 360_000), (id::HYSTERESIS, 360_000), (id::DELAY, 36_000)]
    {
        assert!(changed(&now, &[(id, most)]).is_ok());
        assert!(matches!(changed(&now, &[(id, most + 1)]), Err(Refusal::Range { .. })), "{id}");
    }
}

//! The configuration as text: pasted into another gateway it makes the same one, and there the same text.

use clino_bus::Duration;
use clino_bus::line::EchoMode;
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::Axis;
use clino_gateway::config::{Ask, Direction, Filter, Kind, Name};
use clino_gateway::order::Order;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::{Bus, BusChange, MAX_SLOTS, SlotConfig, Source};
use clino_modbus::settings::{Parity, Pauses, Settings, StopBits};

use crate::desk::Desk;

/// The longest line that can be typed (`docs/console.md`).
const LONGEST: usize = 80;

fn configs(desk: &Desk) -> Vec<SlotConfig> {
    (0..MAX_SLOTS).map(|slot| *desk.rest.gateway.config(slot).expect("a slot")).collect()
}

/// The text of a JSON string of printable ASCII: `\\"` and `\\\\` are the only escapes there.
fn unescaped(text: &str) -> String {
    let mut escaped = false;
    text.chars()
        .filter(|&character| {
            escaped = character == '\\' && !escaped;
            !escaped
        })
        .collect()
}

fn exported(desk: &mut Desk) -> Vec<String> {
    let lines = desk.type_in("export\r");
    let text = |line: &str| {
        line.strip_prefix("{\"export\":\"").and_then(|rest| rest.strip_suffix("\"}")).map(unescaped)
    };
    lines.lines().map(|line| text(line).unwrap_or_else(|| panic!("{line}"))).collect()
}

/// Slots of every kind and state, with every setting that they have.
fn furnished() -> Desk {
    let mut desk = Desk::new();
    let rich = |source| SlotConfig {
        enabled: false,
        ask: Ask::Everything,
        retries: 10,
        confirm: false,
        filter: Filter::Median,
        samples: 7,
        direction: Direction::Reversed,
        range: Range::Bidirectional,
        tolerance: 12_345,
        period: Duration::from_micros(1_199_999_999),
        timeout: Duration::from_micros(499_999),
        stale: Duration::from_micros(3_599_999_999),
        report_every: Duration::from_micros(3_599_999_999),
        soft_zero: Angle::from_udeg(-359_999_999),
        max_rate: 35_999_999,
        ..SlotConfig::usual(source)
    };
    let of = |kind, address| Source::of(kind, address, Axis::Two);
    let table = [
        rich(Source::of(Kind::T7, 100, Axis::Zero)),
        SlotConfig { ask: Ask::Angle, tolerance: 0, ..rich(of(Kind::Isu, 0)) },
        SlotConfig {
            timeout: Duration::ZERO,
            partner: Some(47),
            retries: 0,
            ask: Ask::Angle,
            ..rich(of(Kind::Pwm, 2))
        },
        SlotConfig { name: Name::new("Boom \\left, 2.").unwrap(), ..SlotConfig::usual(of(Kind::T7, 127)) },
        SlotConfig { samples: 3, ..SlotConfig::usual(of(Kind::Isu, 14)) },
        // No address yet, an address of no PWM input, an address without a kind; settings without a kind.
        SlotConfig { retries: 5, ..SlotConfig::usual(Source::held(Kind::Isu, 0, Axis::Two)) },
        SlotConfig::usual(of(Kind::Pwm, 9)),
        SlotConfig::usual(of(Kind::Off, 9)),
        SlotConfig { held_axis: Axis::One, period: Duration::from_micros(12_345), ..SlotConfig::OFF },
    ];
    for (slot, config) in (0..).zip(table) {
        desk.rest
            .gateway
            .carry_out(Order::Slot { slot, config }, clino_gateway::Requester::Console)
            .expect("a slot");
    }
    let bus = |bus, post, echo| Order::Bus {
        bus,
        change: BusChange {
            guard: Some(Duration::from_micros(19_999)),
            pre_delay: Some(Duration::from_micros(4_999)),
            post_delay: Some(Duration::from_micros(post)),
            echo: Some(echo),
            ..BusChange::NONE
        },
    };
    for order in [
        bus(Bus::T7, 1_999, EchoMode::Expected),
        bus(Bus::Isu, 999, EchoMode::Detect),
        Order::Console(ConsoleSettings { idle_s: 86_399 }),
    ] {
        desk.rest.gateway.carry_out(order, clino_gateway::Requester::Console).expect("an order");
    }
    desk.rest.modbus = Some(Settings {
        address: 247,
        baud: 115_200,
        parity: Parity::None,
        stop_bits: StopBits::Two,
        echo: EchoMode::Expected,
        pauses: Pauses::Tolerant,
        locked: true,
    });
    desk
}

#[test]
fn what_is_pasted_elsewhere_makes_the_same() {
    let mut one = furnished();
    let lines = exported(&mut one);
    assert!(lines.iter().all(|line| line.len() <= LONGEST), "{lines:#?}");
    // Into a gateway with another configuration, twice.
    let mut other = Desk::new();
    other.type_in("slot 40 t7 33\r");
    for _ in 0..2 {
        for line in &lines {
            // A bus is changed when no exchange is in hand.
            let said = other.type_in(&format!("{line}\r"));
            assert!(
                ["{\"done\":true}\r\n", "{\"accepted\":true}\r\n"].contains(&said.as_str()),
                "{line}: {said}"
            );
        }
        let (expected, found) = (configs(&one), configs(&other));
        for (slot, (expected, found)) in expected.iter().zip(&found).enumerate() {
            assert_eq!(found, expected, "slot {slot}: {lines:#?}");
        }
        for bus in [Bus::T7, Bus::Isu] {
            assert_eq!(other.rest.gateway.bus_settings(bus), one.rest.gateway.bus_settings(bus));
        }
        assert_eq!(other.rest.modbus, one.rest.modbus);
        assert_eq!(other.rest.gateway.fingerprint(), one.rest.gateway.fingerprint());
        assert_eq!(exported(&mut other), lines);
    }
}

#[test]
fn people_get_the_commands_alone() {
    let mut desk = Desk::with_person();
    let text = desk.type_in("export\r");
    for line in [
        "set t7 baud 115200 guard 87 pre 0 post 0",
        "set t7 echo off",
        "set console idle 60",
        "slot 0 t7 5",
        "slot 1 isu 3",
        "slot 2 off",
        "slot 47 off",
    ] {
        assert!(text.contains(&format!("\r\n{line}\r\n")), "{line}: {text}");
    }
}

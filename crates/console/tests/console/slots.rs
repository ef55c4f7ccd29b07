//! Settings of slots, their values, and what happened to them.

use clino_bus::{Duration, Instant};
use clino_codec::angle::{Angle, Range};
use clino_codec::pwm::Ticks;
use clino_gateway::config::{Ask, Direction, Filter};
use clino_gateway::order::Order;
use clino_gateway::{Bus, Capture, PwmInput, SlotConfig};

use crate::desk::Desk;

/// A cycle of 30 Hz at 84 MHz with half of it high: 1920 of 3840 steps are 180° (AN #201 section 5).
const HALF: Capture = Capture::Cycle(Ticks { period: 2_800_000, high: 1_400_000 });

/// A desk whose slot 2 reads 180° at a PWM input.
fn with_angle() -> Desk {
    let mut desk = Desk::new();
    desk.type_in("slot 2 pwm 1\r");
    desk.rest.now = Instant::from_millis(100);
    desk.rest.gateway.pwm(PwmInput::Pwm1, HALF, desk.rest.now);
    desk.rest.publish();
    desk
}

fn set(desk: &mut Desk, line: &str) -> SlotConfig {
    assert_eq!(desk.type_in(&format!("{line}\r")), "{\"done\":true}\r\n", "{line}");
    let Some(Order::Slot { slot: 0, config }) = desk.rest.orders.last() else { panic!("{line}") };
    *config
}

#[test]
fn a_setting_is_changed_and_the_others_stay() {
    let mut desk = Desk::new();
    let mut expected = *desk.rest.gateway.config(0).expect("slot 0");
    type Change = fn(&mut SlotConfig);
    let changes: [(&str, Change); 19] = [
        ("enabled off", |c| c.enabled = false),
        ("enabled on", |c| c.enabled = true),
        ("ask everything", |c| c.ask = Ask::Everything),
        ("period 33.333", |c| c.period = Duration::from_micros(33_333)),
        ("timeout 500", |c| c.timeout = Duration::from_millis(500)),
        ("retries 10", |c| c.retries = 10),
        ("stale 500", |c| c.stale = Duration::from_millis(500)),
        ("report 3600000", |c| c.report_every = Duration::from_millis(3_600_000)),
        ("confirm off", |c| c.confirm = false),
        ("filter mean 8", |c| (c.filter, c.samples) = (Filter::Mean, 8)),
        ("filter median 5", |c| (c.filter, c.samples) = (Filter::Median, 5)),
        ("filter off", |c| c.filter = Filter::Off),
        ("zero -- -12.345", |c| c.soft_zero = Angle::from_udeg(-12_345_000)),
        ("direction reversed", |c| c.direction = Direction::Reversed),
        ("range unidirectional", |c| c.range = Range::Unidirectional),
        ("rate 0.5", |c| c.max_rate = 500),
        ("samples 3", |c| c.samples = 3),
        ("stale_auto on", |c| c.stale = Duration::ZERO),
        ("tolerance 0.25", |c| c.tolerance = 250),
    ];
    for (line, change) in changes {
        change(&mut expected);
        assert_eq!(set(&mut desk, &format!("set 0 {line}")), expected, "{line}");
        assert_eq!(desk.rest.gateway.config(0), Some(&expected), "{line}");
    }
}

#[test]
fn how_a_slot_is_set_is_told() {
    let mut desk = Desk::new();
    desk.type_in("set 0 filter mean 4\r");
    desk.type_in("set 0 zero 12.345\r");
    assert_eq!(
        desk.type_in("show 0\r"),
        concat!(
            r#"{"config":0,"kind":"t7","address":5,"axis":2,"enabled":true,"ask":"angle","period_ms":20,"#,
            r#""timeout_ms":0,"retries":1,"stale_ms":60,"stale_auto":true,"report_ms":100,"confirm":true,"filter":"mean","samples":4,"#,
            r#""zero_deg":12.345,"direction":"normal","range":"bidirectional","rate_deg_s":180,"partner":null,"#,
            r#""tolerance":0.100,"alarm":"off","high_deg":0,"low_deg":0,"hysteresis_deg":0,"delay_s":0,"latch":false,"#,
            r#""alarm_rate_deg_s":0,"no_value_s":0,"name":""}"#,
            "\r\n"
        )
    );
    let empty = desk.type_in("show 47\r");
    assert!(
        empty.starts_with(r#"{"config":47,"kind":"off","address":null,"axis":null,"enabled":false,"#),
        "{empty}"
    );
    desk.type_in("slot 2 pwm 2\r");
    let pwm = desk.type_in("show 2\r");
    assert!(pwm.contains(r#""kind":"pwm","address":2,"#) && pwm.contains(r#""period_ms":33.333,"#), "{pwm}");
    // 0.56°
    assert!(
        pwm.contains("\"tolerance\":0.560,") && pwm.ends_with("\"no_value_s\":0,\"name\":\"\"}\r\n"),
        "{pwm}"
    );
}

#[test]
fn a_value_is_told_with_all_that_is_known_of_it() {
    let mut desk = with_angle();
    desk.rest.now = Instant::from_millis(103);
    assert_eq!(
        desk.type_in("read 2\r"),
        concat!(
            r#"{"slot":2,"kind":"pwm","bus":"pwm1","address":0,"status":"ok","angle_deg":180.000,"age_ms":3,"#,
            r#""health":[],"raw_deg":180.000,"rate_deg_s":0,"turns":0,"temperature_c":null,"fresh":true,"sequence":2,"#,
            r#""last_error":null,"unconfirmed":false,"quarantine":false}"#,
            "\r\n"
        )
    );
}

#[test]
fn a_slot_reads_zero_as_it_stands() {
    let mut desk = with_angle();
    assert_eq!(desk.type_in("zero 2\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.rest.gateway.config(2).expect("slot 2").soft_zero, Angle::from_udeg(180_000_000));
    desk.rest.gateway.pwm(PwmInput::Pwm1, HALF, desk.rest.now);
    desk.rest.publish();
    assert!(desk.type_in("read 2\r").contains(r#""angle_deg":0.000,"#));
    // Two periods and a half later it is stale.
    desk.rest.now = Instant::from_millis(1_000);
    assert_eq!(
        desk.type_in("zero 2\r"),
        "{\"error\":{\"kind\":\"no_value\",\"slot\":2,\"status\":\"stale\"}}\r\n"
    );
}

#[test]
fn transactions_come_newest_first_and_are_counted() {
    let mut desk = Desk::new();
    // The requests of the gateway are not sent.
    for second in 0..3 {
        desk.rest.gateway.poll(Bus::T7, Instant::from_millis(second * 10_000), |_| {});
        desk.rest.gateway.poll(Bus::T7, Instant::from_millis(second * 10_000 + 5_000), |_| {});
    }
    let trace = desk.type_in("trace\r");
    let at = |line: &str| {
        let rest = line.strip_prefix(r#"{"trace":"t7","at_us":"#).expect("a transaction");
        rest.split(',').next().expect("a number").parse::<u64>().expect("a number")
    };
    let times: Vec<u64> = trace.lines().map(at).collect();
    assert!(times.len() >= 3 && times.is_sorted_by(|a, b| a > b), "{trace}");
    assert!(trace.contains(r#","address":5,"code":"#) && trace.contains(r#""purpose":"reading","verdict":"#));
    assert_eq!(desk.type_in("trace 1\r").lines().count(), 1);
    let counters = desk.type_in("counters 0\r");
    let requests = format!(r#"{{"counters":0,"requests":{},"first_try":0,"#, times.len());
    assert!(counters.starts_with(&requests), "{counters}");
    assert!(
        counters.ends_with("\"response_us\":null,\"response_min_us\":null,\"response_max_us\":null}\r\n")
    );
}

#[test]
fn the_load_of_the_buses_and_what_is_not_wise() {
    let mut desk = Desk::new();
    // One T7 every 20 ms: 3 characters, 2 ms, 8 characters, a guard of 87 us, 3.04 ms in all.
    assert!(desk.type_in("load\r").starts_with(r#"{"load":"t7","wanted_percent":16,"polls_per_s":null}"#));
    desk.type_in("slot 1 t7 5\r");
    desk.type_in("slot 2 pwm 1\r");
    desk.type_in("set 2 partner 0\r");
    let load = desk.type_in("load\r");
    for why in ["slot 1 reads the same as slot 0", "slot 2: slot 0 reads no ISU"] {
        assert!(load.contains(&format!("{{\"what\":\"unwise\",\"why\":\"{why}\"}}\r\n")), "{load}");
    }
}

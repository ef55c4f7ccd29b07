//! Alarms at the console: the line of a change, the list, the acknowledgement. Extremes.

use clino_codec::pwm::Ticks;
use clino_gateway::{Capture, PwmInput};

use super::desk::Desk;
use clino_bus::Duration;

/// One cycle of the PWM output at 33.3 ms, in ticks of 84 MHz.
const PERIOD: u32 = 2_800_000;

/// A cycle of this angle comes, in whole degrees: angle = 6.749 · duty − 157.45.
fn turn_to(desk: &mut Desk, degrees: f64) {
    let duty = (degrees + 157.45) / 674.9;
    let high = (f64::from(PERIOD) * duty).round() as u32;
    desk.rest.now = desk.rest.now + Duration::from_micros(33_333);
    let cycle = Capture::Cycle(Ticks { period: PERIOD, high });
    desk.rest.gateway.pwm(PwmInput::Pwm1, cycle, desk.rest.now);
    desk.rest.publish();
}

/// Slot 2 reads a PWM input; the other slots are off.
fn desk() -> Desk {
    let mut desk = Desk::new();
    desk.stream();
    for line in ["slot 0 off", "slot 1 off", "slot 2 pwm 1"] {
        desk.type_in(&format!("{line}\r"));
    }
    desk
}

/// The lines about alarms, without what depends on the angle's rounding.
fn told(printed: &str) -> Vec<(String, String)> {
    let lines = printed.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let alarms = lines.filter(|line| line.get("alarm").is_some_and(|alarm| alarm.is_number()));
    let text = |value: &serde_json::Value| value.as_str().expect("a word").to_owned();
    alarms.map(|line| (text(&line["name"]), text(&line["state"]))).collect()
}

fn pairs(of: &[(&str, &str)]) -> Vec<(String, String)> {
    of.iter().map(|&(alarm, state)| (alarm.to_owned(), state.to_owned())).collect()
}

#[test]
fn each_change_is_a_line_of_the_stream() {
    let mut desk = desk();
    desk.type_in("set 2 alarm both high 100 low 50 hysteresis 5 latch on\r");
    turn_to(&mut desk, 75.0);
    assert_eq!(told(&desk.stream()), []);
    turn_to(&mut desk, 110.0);
    let printed = desk.stream();
    assert_eq!(told(&printed), pairs(&[("high", "active")]));
    let line = printed.lines().find(|line| line.contains("\"name\":\"high\"")).expect("the line");
    let line: serde_json::Value = serde_json::from_str(line).expect("an object");
    assert_eq!((&line["alarm"], &line["age_ms"], &line["unit"]), (&2.into(), &0.into(), &"deg".into()));
    assert!((line["extreme"].as_f64().expect("a number") - 110.0).abs() < 0.01, "{line}");
    assert_eq!(line["extreme"], line["angle_deg"]);
    // It ends behind the hysteresis, and waits.
    turn_to(&mut desk, 96.0);
    assert_eq!(told(&desk.stream()), []);
    turn_to(&mut desk, 94.0);
    assert_eq!(told(&desk.stream()), pairs(&[("high", "unacknowledged")]));
    // Without a value nothing ends.
    desk.rest.now = desk.rest.now + Duration::from_millis(5_000);
    assert_eq!(told(&desk.stream()), []);
    assert_eq!(desk.type_in("acknowledge 2\r"), "{\"done\":true}\r\n");
    assert_eq!(told(&desk.stream()), pairs(&[("high", "quiet")]));
    assert_eq!(desk.type_in("alarms\r"), "{\"alarm\":null}\r\n");
}

#[test]
fn the_list_names_what_is_not_quiet() {
    let mut desk = desk();
    assert_eq!(desk.type_in("alarms\r"), "{\"alarm\":null}\r\n");
    desk.type_in("set 2 alarm low low 50 latch on\r");
    desk.type_in("set 2 alarm_rate 100\r");
    for degrees in [75.0, 75.0, 20.0] {
        turn_to(&mut desk, degrees);
    }
    assert_eq!(told(&desk.type_in("alarms\r")), pairs(&[("low", "active"), ("rate", "active")]));
    assert_eq!(desk.type_in("acknowledge\r"), "{\"done\":true}\r\n");
    assert_eq!(told(&desk.type_in("alarms\r")), pairs(&[("low", "acknowledged"), ("rate", "acknowledged")]));
    desk.type_in("json off\r");
    let table = desk.type_in("alarms\r");
    assert!(table.contains("slot  2  low       acknowledged    0 s  extreme 20 deg"), "{table}");
    assert!(table.contains("deg/s"), "{table}");
}

#[test]
fn a_slot_that_is_not_there_is_refused() {
    let mut desk = desk();
    for line in ["acknowledge 48", "acknowledge x", "acknowledge -1", "acknowledge 1 2", "alarms 1"] {
        assert!(desk.type_in(&format!("{line}\r")).contains("\"error\""), "{line}");
    }
}

#[test]
fn extremes_are_told_and_cleared() {
    let mut desk = desk();
    for degrees in [75.0, 75.0, 20.0, 90.0] {
        turn_to(&mut desk, degrees);
    }
    desk.rest.now = desk.rest.now + Duration::from_micros(5_000_000);
    let told = |desk: &mut Desk, line: &str| desk.type_in(&format!("{line}\r"));
    let line: serde_json::Value = serde_json::from_str(&told(&mut desk, "extremes 2")).expect("an object");
    let number = |key: &str| line[key].as_f64().expect("a number");
    assert!(
        (number("lowest_deg") - 20.0).abs() < 0.01 && (number("highest_deg") - 90.0).abs() < 0.01,
        "{line}"
    );
    assert_eq!((&line["lowest_age_s"], &line["highest_age_s"]), (&5.into(), &5.into()));
    assert_eq!(told(&mut desk, "extremes").lines().count(), 1, "the slot in use");
    assert_eq!(told(&mut desk, "extremes clear 1"), "{\"done\":true}\r\n");
    assert!(told(&mut desk, "extremes 2").contains("\"lowest_deg\":20"));
    assert_eq!(told(&mut desk, "extremes clear"), "{\"done\":true}\r\n");
    assert!(told(&mut desk, "extremes 2").contains("\"lowest_deg\":null"));
    for line in
        ["extremes 48", "extremes clear 48", "extremes clear 1 2", "extremes 1 clear", "extremes clean"]
    {
        assert!(told(&mut desk, line).contains("\"error\""), "{line}");
    }
}

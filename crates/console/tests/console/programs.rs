//! JSON lines in, JSON lines out.

use clino_bus::Micros;
use clino_gateway::Source;
use clino_gateway::Span;
use clino_gateway::order::Order;

use crate::desk::Desk;

#[test]
fn a_program_may_speak_into_the_stream() {
    let mut desk = Desk::new();
    for slot in 0..48 {
        let line = format!("slot {slot} t7 {} -p 0 -s 1000\r", slot + 1);
        assert_eq!(desk.type_in(&line), "{\"done\":true}\r\n", "{line}");
    }
    assert_eq!(desk.rest.orders.len(), 48);
    let Order::Slot { slot: 47, config } = desk.rest.orders[47] else { panic!("{:?}", desk.rest.orders[47]) };
    assert!(matches!(config.source, Source::T7 { address, .. } if address.get() == 48));
    assert_eq!((config.period, config.stale_after), (Span::ZERO, Span::from_millis(1_000)));
}

#[test]
fn either_line_end_or_both_end_a_command() {
    let mut desk = Desk::new();
    for end in ["\r", "\n", "\r\n"] {
        assert_eq!(
            desk.type_in(&format!("version{end}")),
            "{\"what\":\"clino\",\"version\":\"9.8.7\",\"uptime_ms\":0}\r\n"
        );
    }
}

#[test]
fn what_is_wrong_is_said_with_its_limit() {
    let mut desk = Desk::new();
    for (line, answer) in [
        ("nonsense", r#"{"error":{"kind":"unknown_command"}}"#),
        ("read", r#"{"error":{"kind":"missing_argument","what":"<SLOT>"}}"#),
        ("read 48", r#"{"error":{"kind":"out_of_range","what":"slot","value":48,"least":0,"most":47}}"#),
        ("read x", r#"{"error":{"kind":"bad_argument","value":"x","expected":"u8"}}"#),
        (
            "slot 1 t7 101",
            r#"{"error":{"kind":"out_of_range","what":"t7_address","value":101,"least":1,"most":127}}"#,
        ),
        (
            "slot 1 isu 15",
            r#"{"error":{"kind":"out_of_range","what":"isu_address","value":15,"least":1,"most":14}}"#,
        ),
        (
            "slot 1 isu 0",
            r#"{"error":{"kind":"out_of_range","what":"isu_address","value":0,"least":1,"most":14}}"#,
        ),
        ("slot 1 isu", r#"{"error":{"kind":"missing_argument","what":"address"}}"#),
        (
            "slot 1 tape 1",
            r#"{"error":{"kind":"bad_argument","value":"tape","expected":"t7, isu, pwm or off"}}"#,
        ),
        (
            "slot 1 t7 5 -r 11",
            r#"{"error":{"kind":"out_of_range","what":"retries","value":11,"least":0,"most":10}}"#,
        ),
        (
            "bus t7 -b 1200",
            r#"{"error":{"kind":"bit_rate","value":1200,"why":"the sensors do not have 1200 bit/s, only 115200 57600 38400 19200 9600"}}"#,
        ),
        (
            "bus isu -b 19200",
            r#"{"error":{"kind":"bit_rate","value":19200,"why":"the sensors do not have 19200 bit/s, only 9600"}}"#,
        ),
        (
            "bus t7 -g 20001",
            r#"{"error":{"kind":"out_of_range","what":"guard_us","value":20001,"least":0,"most":20000}}"#,
        ),
        ("read \"a\\\"b\"", r#"{"error":{"kind":"bad_argument","value":"ab","expected":"u8"}}"#),
    ] {
        assert_eq!(desk.type_in(&format!("{line}\r")), format!("{answer}\r\n"), "{line}");
    }
    assert!(desk.rest.orders.is_empty(), "{:?}", desk.rest.orders);
}

#[test]
fn a_line_that_is_too_long_is_refused_whole() {
    let mut desk = Desk::new();
    let line = format!("slot 0 t7 5 {}-p 1000\r", " ".repeat(80));
    assert_eq!(desk.type_in(&line), "{\"error\":{\"kind\":\"line_too_long\",\"most\":80}}\r\n");
    assert_eq!(desk.type_in("slot 0 off\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.rest.orders.len(), 1);
}

#[test]
fn a_bus_tells_how_it_is_set() {
    let mut desk = Desk::new();
    let bus = |desk: &mut Desk| desk.type_in("bus t7\r");
    let start = r#"{"bus":"t7","baud":115200,"guard_us":87,"pre_us":0,"post_us":0,"echo":"off"}"#;
    assert_eq!(bus(&mut desk), format!("{start}\r\n"));
    let set = "bus t7 -b 9600 -g 0 --pre 100 --post 50 -e detect\r";
    assert_eq!(desk.type_in(set), "{\"done\":true}\r\n");
    let end = r#"{"bus":"t7","baud":9600,"guard_us":0,"pre_us":100,"post_us":50,"echo":"detect"}"#;
    assert_eq!(bus(&mut desk), format!("{end}\r\n"));
}

#[test]
fn every_line_is_an_object_and_no_value_is_none() {
    let mut desk = Desk::new();
    let mut said = desk.type_in("list\r");
    said += &desk.type_in("counters\r");
    desk.rest.now = Micros(1_000_000);
    said += &desk.stream();
    assert!(said.lines().count() >= 2 + 7 + 6, "{said}");
    for line in said.lines() {
        assert!(line.starts_with('{') && line.ends_with('}') && !line.contains("NaN"), "{line}");
    }
    assert!(said.contains(r#""status":"never_read","angle_deg":null,"age_ms":null}"#), "{said}");
}

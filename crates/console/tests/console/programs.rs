//! JSON lines in, JSON lines out.

use clino_bus::{Duration, Instant};
use clino_console::Host;
use clino_gateway::order::Order;
use clino_gateway::{Bus, SlotConfig, Source};

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
    assert_eq!((config.period, config.stale_after()), (Duration::ZERO, Duration::from_millis(1_000)));
}

#[test]
fn either_line_end_or_both_end_a_command() {
    let mut desk = Desk::new();
    for end in ["\r", "\n", "\r\n"] {
        let version = r#"{"what":"clino","version":"9.8.7","uptime_ms":0,"mode":"normal","clock":"crystal","power_ups":0,"boots":1,"uid":"000000020000000100000000"}"#;
        assert_eq!(desk.type_in(&format!("version{end}")), format!("{version}\r\n"));
    }
}

#[test]
fn what_is_wrong_is_said_with_its_limit() {
    let mut desk = Desk::new();
    for (line, answer) in [
        ("nonsense", r#"{"error":{"kind":"unknown_command"}}"#),
        ("slot 1", r#"{"error":{"kind":"missing_argument","what":"kind","expected":"off, t7, isu or pwm"}}"#),
        ("set console", r#"{"error":{"kind":"missing_argument","what":"setting","expected":"idle"}}"#),
        ("set 1 period 20 period 400", r#"{"error":{"kind":"named_twice","what":"period"}}"#),
        ("set 1 filter mean 3 samples 4", r#"{"error":{"kind":"named_twice","what":"samples"}}"#),
        ("set 1 samples 4 filter mean 3", r#"{"error":{"kind":"named_twice","what":"samples"}}"#),
        ("set t7 guard 87 guard 88", r#"{"error":{"kind":"named_twice","what":"guard"}}"#),
        ("set 1 name a name b", r#"{"error":{"kind":"named_twice","what":"name"}}"#),
        ("read", r#"{"error":{"kind":"missing_argument","what":"slot"}}"#),
        ("read 48", r#"{"error":{"kind":"out_of_range","what":"slot","value":48,"least":0,"most":47}}"#),
        ("read x", r#"{"error":{"kind":"bad_argument","what":"slot","value":"x","least":0,"most":47}}"#),
        (
            "slot 1 t7 101",
            r#"{"error":{"kind":"out_of_range","what":"address","value":101,"allowed":"1 to 100 or 127"}}"#,
        ),
        (
            "slot 1 isu 15",
            r#"{"error":{"kind":"out_of_range","what":"address","value":15,"allowed":"1 to 14, or 0 if it is alone"}}"#,
        ),
        (
            "slot 1 pwm 3",
            r#"{"error":{"kind":"out_of_range","what":"address","value":3,"allowed":"1 or 2"}}"#,
        ),
        ("slot 1 isu", r#"{"error":{"kind":"missing_argument","what":"address"}}"#),
        (
            "slot 1 tape 1",
            r#"{"error":{"kind":"bad_argument","value":"tape","expected":"off, t7, isu or pwm"}}"#,
        ),
        (
            "slot 1 t7 5 -r 11",
            r#"{"error":{"kind":"out_of_range","what":"retries","value":11,"least":0,"most":10}}"#,
        ),
        (
            "bus t7 -b 1200",
            r#"{"error":{"kind":"bit_rate","value":1200,"why":"1200 bit/s is not among 115200 57600 38400 19200 9600"}}"#,
        ),
        (
            "bus isu -b 19200",
            r#"{"error":{"kind":"bit_rate","value":19200,"why":"19200 bit/s is not among 9600"}}"#,
        ),
        (
            "bus t7 -g 20001",
            r#"{"error":{"kind":"out_of_range","what":"guard_us","value":20001,"least":0,"most":20000}}"#,
        ),
        ("read 300", r#"{"error":{"kind":"out_of_range","what":"slot","value":300,"least":0,"most":47}}"#),
        ("read 1 2", r#"{"error":{"kind":"unexpected_argument","value":"2"}}"#),
        ("read 1 --fast", r#"{"error":{"kind":"unexpected_option","value":"fast"}}"#),
        ("list -x", r#"{"error":{"kind":"unexpected_option","value":"x"}}"#),
        ("slot 1 t7 5 -p", r#"{"error":{"kind":"missing_argument","what":"period"}}"#),
        (
            "t7 offset 5 -500 --yes",
            r#"{"error":{"kind":"bad_argument","why":"put -- before a negative number"}}"#,
        ),
        (
            "t7 damping 5 5001 --yes",
            r#"{"error":{"kind":"out_of_range","value":5001,"least":2,"most":5000}}"#,
        ),
        (
            "set 1 period 1200000.001",
            r#"{"error":{"kind":"out_of_range","what":"period_ms","value":1200000.001,"least":0,"most":1200000}}"#,
        ),
        (
            "set 1 speed 5",
            concat!(
                r#"{"error":{"kind":"bad_argument","value":"speed","expected":"kind, address, axis, enabled, "#,
                r#"ask, period, timeout, retries, stale, stale_auto, report, confirm, filter, samples, zero, "#,
                r#"direction, range, rate, partner, tolerance, alarm, high, low, hysteresis, delay, latch, alarm_rate, no_value or name"}}"#
            ),
        ),
        (
            "set 1 filter mean 9",
            r#"{"error":{"kind":"out_of_range","what":"samples","value":9,"least":1,"most":8}}"#,
        ),
        ("zero 0", r#"{"error":{"kind":"no_value","slot":0,"status":"never_read"}}"#),
        (
            "modbus address 248",
            r#"{"error":{"kind":"out_of_range","what":"address","value":248,"least":1,"most":247}}"#,
        ),
        (
            "modbus baud 1200",
            concat!(
                r#"{"error":{"kind":"bit_rate","value":1200,"why":"1200 bit/s is not among "#,
                r#"2400 4800 9600 19200 38400 57600 115200"}}"#
            ),
        ),
        ("trace 33", r#"{"error":{"kind":"out_of_range","what":"entries","value":33,"least":1,"most":32}}"#),
        (
            "read \"a b\"",
            r#"{"error":{"kind":"bad_argument","what":"slot","value":"a b","least":0,"most":47}}"#,
        ),
        (
            "read \"a",
            r#"{"error":{"kind":"bad_argument","why":"a quotation mark that is not closed, or within a word"}}"#,
        ),
        (
            "read a\"b\"",
            r#"{"error":{"kind":"bad_argument","why":"a quotation mark that is not closed, or within a word"}}"#,
        ),
    ] {
        assert_eq!(desk.type_in(&format!("{line}\r")), format!("{answer}\r\n"), "{line}");
    }
    assert!(desk.rest.orders.is_empty(), "{:?}", desk.rest.orders);
}

#[test]
fn a_line_that_is_too_long_is_refused_whole() {
    let mut desk = Desk::new();
    let line = format!("slot 0 t7 5 {}-p 1000\r", " ".repeat(80));
    assert_eq!(
        desk.type_in(&line),
        "{\"error\":{\"kind\":\"line_too_long\",\"most\":80,\"characters\":19}}\r\n"
    );
    assert_eq!(desk.type_in("slot 0 off\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.rest.orders.len(), 1);
}

#[test]
fn a_bus_tells_how_it_is_set() {
    let mut desk = Desk::new();
    let bus = |desk: &mut Desk| desk.type_in("bus t7\r");
    let start =
        r#"{"bus":"t7","baud":115200,"guard_us":87,"pre_us":0,"post_us":0,"echo":"off","fault":null}"#;
    assert_eq!(bus(&mut desk), format!("{start}\r\n"));
    let set = "bus t7 -b 9600 -g 0 --pre 100 --post 50 -e detect\r";
    assert_eq!(desk.type_in(set), "{\"done\":true}\r\n");
    let end =
        r#"{"bus":"t7","baud":9600,"guard_us":0,"pre_us":100,"post_us":50,"echo":"detect","fault":null}"#;
    assert_eq!(bus(&mut desk), format!("{end}\r\n"));
}

#[test]
fn every_line_is_an_object_and_no_value_is_none() {
    let mut desk = Desk::new();
    let mut said = desk.type_in("list\r");
    said += &desk.type_in("counters\r");
    desk.rest.now = Instant::from_micros(1_000_000);
    said += &desk.stream();
    assert!(said.lines().count() >= 2 + 7 + 6, "{said}");
    for line in said.lines() {
        assert!(line.starts_with('{') && line.ends_with('}') && !line.contains("NaN"), "{line}");
    }
    assert!(
        said.contains(r#""status":"never_read","angle_deg":null,"age_ms":null,"health":[],"seq":"#),
        "{said}"
    );
}

#[test]
fn what_cannot_be_undone_wants_to_be_confirmed() {
    let mut desk = Desk::new();
    let unconfirmed = r#"{"error":{"kind":"unconfirmed","why":"irreversible, needs --yes"}}"#;
    for line in ["factory-reset", "reboot", "t7 zero 5", "isu repair 3"] {
        assert_eq!(desk.type_in(&format!("{line}\r")), format!("{unconfirmed}\r\n"), "{line}");
    }
    assert!(desk.rest.orders.is_empty() && desk.rest.done.is_empty());
    assert_eq!(desk.type_in("factory-reset --yes\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.type_in("reboot --yes\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.rest.done, ["factory reset", "reboot"]);
    assert_eq!(desk.type_in("t7 offset 5 -a 1 --yes -- -500\r"), "");
    assert_eq!(desk.rest.orders.len(), 1);
    let busy = r#"{"error":{"kind":"busy"}}"#;
    assert_eq!(desk.type_in("reboot --yes\r"), format!("{busy}\r\n"), "a sensor is being written");
    assert_eq!(desk.rest.done.len(), 2);
}

#[test]
fn the_storage_is_asked_and_its_errors_are_told() {
    let mut desk = Desk::new();
    assert_eq!(desk.type_in("save\r"), "{\"what\":\"saved\",\"stored\":\"written\"}\r\n");
    desk.rest.broken_storage = true;
    for line in ["save\r", "factory-reset --yes\r"] {
        assert_eq!(desk.type_in(line), "{\"error\":{\"kind\":\"storage_failed\"}}\r\n");
    }
    assert_eq!(desk.rest.done, ["save"]);
}

#[test]
fn a_save_that_replaces_what_was_not_read_wants_to_be_confirmed() {
    let mut desk = Desk::new();
    desk.rest.unread = true;
    assert!(desk.type_in("save\r").contains(r#""kind":"unconfirmed""#));
    assert!(desk.rest.done.is_empty());
    assert_eq!(desk.type_in("save --yes\r"), "{\"what\":\"saved\",\"stored\":\"written\"}\r\n");
    assert_eq!(desk.rest.done, ["save"]);
    let mut desk = Desk::with_person();
    desk.rest.unread = true;
    let asked = desk.type_in("save\r");
    assert!(asked.ends_with("saved settings that were not read at this start. Go on? y/N "), "{asked:?}");
    desk.type_in("n\r");
    assert!(desk.rest.done.is_empty());
}

#[test]
fn the_modbus_port_is_shown_and_set() {
    let mut desk = Desk::new();
    let shown = |desk: &mut Desk| desk.type_in("modbus\r");
    let start = r#"{"what":"modbus","address":1,"baud":19200,"parity":"even","stop_bits":1,"echo":"off","pauses":"tolerant","locked":false}"#;
    assert_eq!(shown(&mut desk), format!("{start}\r\n"));
    for line in [
        "modbus address 17",
        "modbus baud 115200 parity none",
        "modbus stop_bits 2",
        "set modbus echo detect pauses strict locked on",
    ] {
        assert_eq!(desk.type_in(&format!("{line}\r")), "{\"done\":true}\r\n", "{line}");
    }
    let end = r#"{"what":"modbus","address":17,"baud":115200,"parity":"none","stop_bits":2,"echo":"detect","pauses":"strict","locked":true}"#;
    assert_eq!(shown(&mut desk), format!("{end}\r\n"));
    desk.rest.modbus = None;
    assert_eq!(shown(&mut desk), "{\"error\":{\"kind\":\"absent\",\"what\":\"modbus\"}}\r\n");
}

#[test]
fn help_is_an_object_for_each_command() {
    let mut desk = Desk::new();
    let help = desk.type_in("help\r");
    assert_eq!(help.lines().count(), 26);
    assert!(help.lines().all(|line| line.starts_with("{\"command\":\"") && line.ends_with("\"}")), "{help}");
    let zero = desk.type_in("help zero\r");
    assert!(zero.starts_with(r#"{"command":"zero","usage":"SLOT","help":""#), "{zero}");
    assert_eq!(desk.type_in("help nothing\r"), "{\"error\":{\"kind\":\"unknown_command\"}}\r\n");
}

#[test]
fn ctrl_c_of_a_program_stops_tasks_and_drops_the_line() {
    let mut desk = Desk::new();
    desk.type_in("json on\r");
    assert_eq!(desk.type_in("t7 scan\r"), "");
    desk.rest.now = Instant::from_millis(1_000);
    let said = desk.stream();
    assert!(said.starts_with(r#"{"progress":"t7","done":"#) && said.ends_with(",\"of\":101}\r\n"), "{said}");
    assert_eq!(desk.type_in("rebo\x03version\r").matches("9.8.7").count(), 1);
    assert_eq!(desk.rest.orders[1..], [Order::Cancel(Bus::T7), Order::Cancel(Bus::Isu)]);
}

/// Every line of a program has an answer, the first and the last one, too.
#[test]
fn a_program_that_begins_and_ends_is_told_so() {
    let mut desk = Desk::new();
    desk.stream();
    assert_eq!(desk.type_in("json on\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.type_in("json on\r"), "{\"done\":true}\r\n");
    assert_eq!(desk.type_in("json on off\r").matches("\"error\"").count(), 1);
    let said = desk.type_in("json off\r");
    assert!(said.starts_with("{\"done\":true}\r\n") && said.contains("clino> "), "{said}");
    // A person is answered as a person, and asks for the other form.
    assert!(desk.type_in("json off\r").contains("done\r\n"));
    let said = desk.type_in("json on\r");
    assert!(said.ends_with("{\"done\":true}\r\n"), "{said}");
}

/// In a stream, too, Ctrl-C drops what was sent of a line.
#[test]
fn ctrl_c_in_a_stream_drops_the_line() {
    let mut desk = Desk::new();
    desk.type_in("json on\nwatch\nt7 zero 5 --yes\x03\n");
    assert_eq!(desk.rest.orders, []);
}

/// What is wrong with the gateway is the first line of the stream, and said again within 100 ms of a change, and once a
/// second.
#[test]
fn the_stream_begins_with_a_summary_and_tells_its_changes() {
    let mut desk = Desk::new();
    let summaries = |text: &str| {
        text.lines().filter(|line| line.starts_with(r#"{"summary":"#)).map(str::to_owned).collect::<Vec<_>>()
    };
    let first = desk.stream();
    let expected = r#"{"summary":["t7_bus_dead","isu_bus_dead","slot_fault"],"enabled":2,"online":0,"ok":0}"#;
    assert!(first.starts_with("{\"stream\":\"started\",\"version\":\"9.8.7\","), "{first}");
    assert!(
        first.lines().next().is_some_and(|line| line.ends_with(",\"prompt\":\"Enter or Ctrl-C\"}")),
        "{first}"
    );
    assert_eq!(first.lines().nth(1), Some(expected));
    // Nothing has changed.
    desk.rest.now = Instant::from_micros(900_000);
    assert_eq!(summaries(&desk.stream()), [""; 0]);
    desk.rest.now = Instant::from_micros(1_000_000);
    assert_eq!(summaries(&desk.stream()), [expected]);
    // One slot fewer, and no ISU any more.
    desk.rest.order(Order::Slot { slot: 1, config: SlotConfig::OFF }).unwrap();
    desk.rest.now = Instant::from_micros(1_050_000);
    assert_eq!(summaries(&desk.stream()), [""; 0]);
    desk.rest.now = Instant::from_micros(1_100_000);
    let changed = r#"{"summary":["t7_bus_dead","slot_fault"],"enabled":1,"online":0,"ok":0}"#;
    assert_eq!(summaries(&desk.stream()), [changed]);
    // `list` has it, too, for programs and for people.
    let listed = desk.type_in("list\n");
    assert!(
        listed.ends_with(&format!("{changed}\r\n")) || listed.ends_with(&format!("{changed}\n")),
        "{listed}"
    );
    desk.rest.order(Order::Slot { slot: 0, config: SlotConfig::OFF }).unwrap();
    let listed = desk.type_in("list\n");
    assert!(listed.contains(r#"{"summary":[],"enabled":0,"online":0,"ok":0}"#), "{listed}");
}

#[test]
fn people_are_told_what_is_wrong_and_nothing_while_all_is_well() {
    let mut desk = Desk::with_person();
    assert!(desk.type_in("list\r").contains("signals: t7_bus_dead isu_bus_dead slot_fault"));
    for slot in 0..2 {
        desk.rest.order(Order::Slot { slot, config: SlotConfig::OFF }).unwrap();
    }
    assert!(!desk.type_in("list\r").contains("signals"));
}

//! What an order does besides what it says is told before it is done; *done* means done.

use clino_bus::Instant;
use clino_gateway::Bus;

use crate::desk::Desk;

/// T7s 5, 6 and 7, ISUs 3 and 4.
fn crowded(mut desk: Desk) -> Desk {
    for line in ["slot 2 t7 6\r", "slot 3 t7 7\r", "slot 4 t7 7 -a 1\r", "slot 5 isu 4\r"] {
        let said = desk.type_in(line);
        assert!(said.contains("done"), "{said}");
    }
    desk.rest.orders.clear();
    desk
}

#[test]
fn each_question_names_its_own_consequence() {
    for (line, told) in [
        ("t7 zero 5", "soft zeros of its slots are cleared"),
        ("t7 offset 5 100", "angles of its axis move"),
        ("t7 direction 5 reversed", "counts the other way"),
        ("t7 damping 5 500", "all its axes average over this time"),
        ("t7 range 5 unidirectional", "all its axes then use this range"),
        ("t7 address 5 9", "its slots follow it; only save keeps that over a restart"),
        ("t7 address 5 6", "slot 2 already reads the new address"),
        ("t7 baud 5 57600", "the bus changes to 57600 bit/s, too; only save keeps that over a restart"),
        ("t7 baud 5 57600", "2 other nodes of the bus stay at its present bit rate and will not answer"),
        ("t7 baud 9 57600", "3 other nodes"),
        ("isu zero 3", "at its PWM output, too"),
        ("isu null 3 100", "all its angles move"),
        ("isu address 3 9", "its slots follow it"),
        ("isu address 3 4", "slot 5 already reads the new address"),
        ("isu repair 3", "it restarts"),
    ] {
        let mut desk = crowded(Desk::with_person());
        let asked = desk.type_in(&format!("{line}\r"));
        assert!(asked.contains("this writes to the sensor's memory; "), "{asked}");
        assert!(asked.contains(told) && asked.ends_with(". Go on? y/N "), "{line}: {asked}");
        assert_eq!(desk.rest.orders, [], "{line}");
    }
    // There is no other node, or it is no change.
    let alone = Desk::with_person().type_in("t7 baud 5 57600\r");
    assert!(alone.contains("57600") && !alone.contains("will not answer"), "{alone}");
    let same = crowded(Desk::with_person()).type_in("t7 baud 5 115200\r");
    assert!(same.contains("Go on?") && !same.contains("will not answer"), "{same}");
    let one = crowded(Desk::with_person());
    let mut one = one;
    one.type_in("slot 2 off\r");
    let asked = one.type_in("t7 baud 5 57600\r");
    assert!(asked.contains("1 other node of the bus stays at"), "{asked}");
}

#[test]
fn a_program_is_told_in_the_refusal_and_in_the_answer() {
    let mut desk = crowded(Desk::new());
    assert_eq!(
        desk.type_in("t7 baud 5 57600\r"),
        concat!(
            r#"{"error":{"kind":"unconfirmed","why":"2 other nodes of the bus stay at its present bit rate and will not "#,
            "answer; irreversible, needs --yes\",\"silenced\":2}}\r\n"
        )
    );
    assert_eq!(
        desk.type_in("isu address 3 4\r"),
        concat!(
            r#"{"error":{"kind":"unconfirmed","why":"slot 5 already reads the new address; "#,
            "irreversible, needs --yes\",\"slot\":5}}\r\n"
        )
    );
    assert_eq!(desk.rest.orders, []);
    let said = desk.type_in("t7 baud 5 57600 --yes\r");
    assert!(said.starts_with(r#"{"hint":{"kind":"silenced","why":"2 other nodes of the bus stay"#), "{said}");
    assert!(said.ends_with("\"silenced\":2}}\r\n"), "{said}");
    assert_eq!(desk.rest.orders.len(), 1);
    // No other node is concerned: there is no note.
    assert_eq!(Desk::new().type_in("t7 baud 5 57600 --yes\r"), "");
}

#[test]
fn done_is_said_when_it_is_and_accepted_before() {
    let done = "{\"done\":true}\r\n";
    assert_eq!(Desk::new().type_in("bus t7 -g 100\r"), done);
    // A request is out: the change waits for its end.
    let mut desk = Desk::new();
    desk.rest.now = Instant::from_micros(1_000);
    let mut sent = false;
    desk.rest.gateway.poll(Bus::T7, desk.rest.now, |action| {
        sent |= matches!(action, clino_gateway::Action::Send(_));
    });
    assert!(sent);
    assert_eq!(desk.type_in("bus t7 -b 57600 -g 100\r"), "{\"accepted\":true}\r\n");
    // It is told as it will be.
    assert!(desk.type_in("bus t7\r").starts_with(r#"{"bus":"t7","baud":57600,"guard_us":100,"#));
    assert_eq!(desk.rest.gateway.timing(Bus::T7).serial.baud, 115_200);
    // A task stops at its next safe point, and says so itself.
    let mut desk = Desk::new();
    assert_eq!(desk.type_in("cancel\r"), done);
    desk.type_in("t7 info 5\r");
    assert_eq!(desk.type_in("cancel\r"), "{\"accepted\":true}\r\n");
    let mut person = Desk::with_person();
    person.rest.gateway.poll(Bus::T7, Instant::from_micros(1_000), |_| {});
    let said = person.type_in("bus t7 -g 100\r");
    assert!(said.contains("\r\naccepted\r\n"), "{said}");
}

#[test]
fn a_bit_rate_is_busy_while_a_task_needs_it_and_the_rest_is_not() {
    let mut desk = Desk::new();
    desk.type_in("t7 info 5\r");
    assert_eq!(desk.type_in("bus t7 -b 57600\r"), "{\"error\":{\"kind\":\"busy\"}}\r\n");
    let said = desk.type_in("bus t7 -g 300\r");
    assert!(said.contains("done") || said.contains("accepted"), "{said}");
    assert!(desk.type_in("bus t7\r").starts_with(r#"{"bus":"t7","baud":115200,"guard_us":300,"#));
}

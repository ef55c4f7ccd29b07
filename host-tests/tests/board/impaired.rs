//! What the board does to the lines of the console and of the Modbus port reaches the shipped image, and the log of receptions
//! tells what arrived.

use clino_board::reception::Reception;
use clino_host_tests::{modbus, run};

const MS: u64 = 1_000_000;
/// A character of ten bits at 115200 bit/s, ns.
const CHARACTER: u64 = 86_806;

/// Bytes and flags.
fn seen(receptions: &[Reception]) -> Vec<(u8, &'static str)> {
    let flags = |seen: &Reception| match (seen.framing, seen.noise, seen.parity, seen.overrun) {
        (false, false, false, false) => "",
        (true, false, false, false) => "FE",
        (false, true, false, false) => "NF",
        (false, false, true, false) => "PE",
        (false, false, false, true) => "ORE",
        _ => "several",
    };
    receptions.iter().map(|reception| (reception.byte(), flags(reception))).collect()
}

#[test]
fn the_console_receives_what_is_left_of_a_line() {
    let ran = run(r#"
        duration = "300ms"
        typed = [{ at = "100ms", line = "0123456789", gaps = [{ before = 9, length = "3ms" }] }]
        [console]
        impairment = [
            { effect = "lost", character = 1 },
            { effect = "doubled", character = 2 },
            { effect = { inserted = 0x1b }, character = 3 },
            { effect = { flipped = 0x40 }, character = 4 },
            { effect = "framing_error", character = 5 },
            { effect = "noise", character = 6 },
            { effect = "overrun", character = 7 },
        ]
    "#);
    let received = &ran.received.console;
    assert_eq!(
        seen(received),
        [
            (b'0', ""),
            (b'2', ""),
            (b'2', ""),
            (0x1b, ""),
            (b'3', ""),
            (b't', ""),
            (b'5', "FE"),
            (b'6', "NF"),
            (b'7', ""),
            // Lost in the receiver.
            (b'8', "ORE"),
            (b'9', ""),
            (b'\r', ""),
        ]
    );
    let at: Vec<u64> = received.iter().map(|reception| reception.at).collect();
    // The pause stands before the last digit, whatever was added before it.
    let pause = at[10] - at[9];
    assert!((2 * MS..3 * MS + 2 * CHARACTER).contains(&pause), "{pause} ns");
    assert_eq!(ran.impaired.console.len(), 7);
    let log = String::from_utf8(ran.bus_log).expect("text");
    for line in ["console impaired   gateway 4 34 flipped=040", "console received   gateway 35 framing_error"]
    {
        assert!(log.contains(line), "{line}");
    }
}

#[test]
fn the_console_hears_its_own_output_after_a_delay() {
    let ran = run(r#"
        duration = "200ms"
        [console]
        echo = { delay = "50ms" }
    "#);
    let first = ran.lines.first().expect("the gateway prints a line without being asked");
    let heard: Vec<u8> = ran.received.console.iter().map(Reception::byte).collect();
    let text = first.text.as_bytes();
    assert_eq!(heard.get(..text.len()), Some(text));
    // The centre of the first stop bit: nine and a half bits after the beginning of the line.
    let delay = ran.received.console[0].at - first.began - 19 * CHARACTER / 20;
    assert!(delay.abs_diff(50 * MS) < CHARACTER, "{delay} ns");
}

#[test]
fn the_modbus_port_receives_what_is_left_of_a_request() {
    let request = modbus::request(&[3, 0, 0x20, 0, 2], 100);
    let ran = run(&format!(
        r#"
        duration = "300ms"
        {request}
        gaps = [{{ before = 5, length = "1ms" }}]
        [modbus]
        impairment = [
            {{ effect = "parity_error", character = 1 }},
            {{ effect = {{ replaced = 0x21 }}, character = 3 }},
        ]
        "#
    ));
    let bytes = modbus::frame(&[3, 0, 0x20, 0, 2]);
    let mut expected: Vec<(u8, &str)> = bytes.iter().map(|&byte| (byte, "")).collect();
    expected[1].1 = "PE";
    expected[3].0 = 0x21;
    assert_eq!(seen(&ran.received.modbus), expected);
    // Eleven bits at 19200 bit/s, and the pause.
    let at = |index: usize| ran.received.modbus[index].at;
    assert!((at(5) - at(4)).abs_diff(572_917 + MS) < 1_000);
    assert!((at(6) - at(5)).abs_diff(572_917) < 1_000);
    let [exchange] = &modbus::exchanges(&ran.bus_log)[..] else { panic!("one request") };
    assert!(exchange.answer.is_none(), "{exchange:?}");
}

#[test]
fn random_impairments_are_the_same_each_time() {
    let scenario = |seed: u32| {
        run(&format!(
            r#"
            seed = {seed}
            duration = "400ms"
            typed = [{{ at = "100ms", line = "counters" }}, {{ at = "150ms", line = "version" }}]
            [console]
            impairment = [{{ effect = "bit_error", rate = 0.2 }}]
            "#
        ))
    };
    let (first, again, other) = (scenario(1), scenario(1), scenario(2));
    assert!(!first.impaired.console.is_empty());
    assert_eq!((&first.received, &first.bus_log), (&again.received, &again.bus_log));
    assert_ne!(first.impaired, other.impaired);
}

//! Alarms on the shipped image: set at the console, reported in the stream and over Modbus, acknowledged through both doors,
//! their settings kept over a reset.

use clino_host_tests::{Ran, modbus, run};

const MS: u64 = 1_000_000;

/// Function 4.
fn read(first: u16, quantity: u8) -> [u8; 5] {
    let [high, low] = first.to_be_bytes();
    [0x04, high, low, 0x00, quantity]
}

/// Function 16 to the command block: command, target, value.
fn command(code: u8, target: u8, value: u8) -> [u8; 14] {
    [0x10, 0x1F, 0x00, 0x00, 0x04, 0x08, 0x00, code, 0x00, target, 0x00, 0x00, 0x00, value]
}

const ACKNOWLEDGE: u8 = 10;
/// `alarm_0_31` and `alarm_32_47`: every slot in one read.
const BITMAP: u16 = 0x001C;
/// The alarms of slot 0.
const STATES: u16 = 0x2000;

fn scenario(duration_ms: u64, sensors: &str, lines: &[(u64, &str)], requests: &[(&[u8], u64)]) -> Ran {
    let typed: String =
        lines.iter().map(|(at, line)| format!("[[typed]]\nat = \"{at}ms\"\nline = \"{line}\"\n")).collect();
    let requests: String = requests.iter().map(|(pdu, at)| modbus::request(pdu, *at)).collect();
    let modbus = if requests.is_empty() { String::new() } else { format!("[modbus]\n{requests}") };
    run(&format!("duration = \"{duration_ms}ms\"\n{sensors}\n{typed}{modbus}"))
}

/// The lines about alarms: when, name, slot, state, extreme.
fn alarms(ran: &Ran) -> Vec<(u64, String, u64, String, Option<f64>)> {
    let lines = ran
        .lines
        .iter()
        .filter(|line| line.text.starts_with("{\"alarm\":") && line.text.contains("\"name\""));
    let told = lines.map(|line| {
        let object: serde_json::Value = serde_json::from_str(&line.text).expect("an object");
        let text = |key: &str| object[key].as_str().expect("a word").to_owned();
        let slot = object["alarm"].as_u64().expect("a slot");
        (line.at / MS, text("name"), slot, text("state"), object["extreme"].as_f64())
    });
    told.collect()
}

#[test]
fn a_bridge_that_tilts_too_far_is_reported_until_it_is_acknowledged() {
    // 1°/s from 0° on: 3° at 3 s.
    let requests: [(&[u8], u64); 8] = [
        (&read(BITMAP, 4), 2_500),
        (&read(BITMAP, 4), 4_500),
        (&read(STATES, 16), 4_600),
        (&command(ACKNOWLEDGE, 1, 0), 4_700),
        (&read(STATES, 1), 4_800),
        (&command(ACKNOWLEDGE, 0, 0), 4_900),
        (&read(STATES, 1), 5_000),
        (&command(ACKNOWLEDGE, 48, 0), 5_100),
    ];
    let ran = scenario(
        5_500,
        "t7 = [{ address = 1, motion.ramp.rate = 1.0 }]",
        &[(300, "set 0 alarm high high 3 delay 0.5 latch on")],
        &requests,
    );
    assert!(ran.all_well, "{}", ran.summary);
    let told = alarms(&ran);
    let [(at, ref alarm, slot, ref state, extreme), (_, _, _, ref then, _)] = told[..] else {
        panic!("{told:?}")
    };
    assert_eq!((alarm.as_str(), slot, state.as_str()), ("high", 0, "active"));
    // Beyond 3° at 3 s by the sensor's time, half a second of delay; the sensor began to turn before the gateway started.
    assert!((3_300..3_900).contains(&at), "{told:?}");
    assert!(extreme.is_some_and(|angle| (3.4..3.7).contains(&angle)), "{told:?}");
    assert_eq!(then, "acknowledged");

    let exchanges = modbus::exchanges(&ran.bus_log);
    let registers = |index: usize| exchanges[index].registers().expect("registers");
    assert_eq!(registers(0), [0, 0, 0, 0]);
    assert_eq!(registers(1), [0, 1, 0, 0], "slot 0, and no other");
    let states = registers(2);
    assert_eq!(states[0], 0x0011, "high is active and not acknowledged");
    let (age, highest) = (u32::from(states[3]), u32::from(states[10]) << 16 | u32::from(states[11]));
    assert!(age <= 1 && (4_000..5_000).contains(&highest), "{states:04X?}");
    assert!(states[4..10].iter().all(|&word| word == 0xFFFF), "the others were not raised: {states:04X?}");
    assert_eq!([registers(4)[0], registers(6)[0]], [0x0011, 0x0001], "another slot's, then its own");
    let refused = exchanges[7].answer.as_ref().expect("an answer");
    assert_eq!(refused.bytes[1..3], [0x90, 3], "there is no slot 48");
}

#[test]
fn a_sensor_that_is_unplugged_raises_no_value_and_what_was_raised_stays() {
    let ran = scenario(
        9_000,
        "t7 = [{ address = 1, motion.constant = 15.0, unplugged = [{ from = \"2s\", until = \"5s\" }] }]",
        &[
            (300, "set 0 -- alarm both high 10 low -10"),
            (400, "set 0 no_value 1"),
            (4_000, "alarms"),
            (7_500, "alarms"),
        ],
        &[],
    );
    let told = alarms(&ran);
    let stream: Vec<_> =
        told.iter().map(|(_, alarm, _, state, _)| (alarm.as_str(), state.as_str())).collect();
    assert_eq!(
        stream,
        [
            ("high", "active"),
            ("no_value", "active"),
            // `alarms`, while there is no value, and when it is back.
            ("high", "active"),
            ("no_value", "active"),
            ("no_value", "quiet"),
            ("high", "active"),
        ],
        "{told:?}"
    );
    assert!((3_000..3_300).contains(&told[1].0), "{told:?}");
    assert!((5_000..7_200).contains(&told[4].0), "{told:?}");
    // No value looks like one meanwhile.
    assert!(ran.all_well, "{}", ran.summary);
}

#[test]
fn settings_of_alarms_are_kept_over_a_reset_and_states_are_not() {
    let ran = scenario(
        4_000,
        "t7 = [{ address = 1, motion.constant = 15.0 }]",
        &[
            (300, "set 0 alarm high high 10 hysteresis 0.5 latch on"),
            (500, "acknowledge"),
            (700, "save"),
            (1_500, "reboot --yes"),
            (2_500, "show 0"),
            (2_700, "alarms"),
        ],
        &[],
    );
    let shown = ran.lines.iter().find(|line| line.text.starts_with("{\"config\":0")).expect("an answer");
    for part in [r#""alarm":"high""#, r#""high_deg":10"#, r#""hysteresis_deg":0.5"#, r#""latch":true"#] {
        assert!(shown.text.contains(part), "{part}: {}", shown.text);
    }
    let told = alarms(&ran);
    let stream: Vec<_> =
        told.iter().map(|(_, alarm, _, state, _)| (alarm.as_str(), state.as_str())).collect();
    // Raised, acknowledged; raised anew after the reset, and listed.
    assert_eq!(
        stream,
        [("high", "active"), ("high", "acknowledged"), ("high", "active"), ("high", "active")]
    );
    assert!(told[2].0 > 1_500, "{told:?}");
}

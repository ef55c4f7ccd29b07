//! The Modbus port on lines that bring back what the gateway sends, that make pauses, that add zeros: at the shipped image.
//! Which cases there are is tried out in `crates/modbus/tests` (`echo.rs`, `adapters.rs`, `altered.rs`); here, some of each.

use std::fmt::Write as _;

use clino_host_tests::modbus::{self, Exchange};
use clino_host_tests::run;

/// The retries of slot 0; the first of its settings; the command register; command, outcome and sequence of the last one.
const RETRIES: [u8; 2] = [0x10, 0x09];
const SETTINGS: [u8; 2] = [0x10, 0x00];
const COMMAND: [u8; 2] = [0x1F, 0x00];
const PROGRESS: [u8; 2] = [0x1F, 0x08];

/// Runs requests at these times (ms) with more of a scenario; what was exchanged.
fn exchanged(more: &str, requests: &[(u64, Vec<u8>)], ms: u64) -> Vec<Exchange> {
    let mut text = format!("duration = \"{ms}ms\"\n");
    text += more;
    for (at, bytes) in requests {
        let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        write!(text, "[[modbus.request]]\nat = \"{at}ms\"\nbytes = \"{}\"\n", bytes.join(" "))
            .expect("memory");
    }
    modbus::exchanges(&run(&text).bus_log)
}

/// These functions and data, each with address and checksum.
fn requests(pdus: &[&[u8]]) -> Vec<Vec<u8>> {
    pdus.iter().map(|pdu| modbus::frame(pdu)).collect()
}

fn timed(requests: Vec<Vec<u8>>, first: u64, every: u64) -> Vec<(u64, Vec<u8>)> {
    (0..).map(|n| first + n * every).zip(requests).collect()
}

fn answer(exchange: &Exchange) -> &[u8] {
    &exchange.answer.as_ref().unwrap_or_else(|| panic!("no answer: {exchange:02X?}")).bytes
}

/// Echo storm, row 8 of the issue: all that the gateway sends comes back, at once or up to half a second later. Each
/// request is answered by one frame; what was written stays, and what was commanded is done once.
#[test]
fn an_echo_provokes_nothing() {
    let [r, s] = RETRIES;
    let [c, d] = COMMAND;
    let [p, q] = PROGRESS;
    let asked = requests(&[
        &[4, 0, 0x0C, 0, 4],
        &[6, r, s, 0, 3],
        &[6, r, s, 0, 4],
        &[16, r, s, 0, 1, 2, 0, 5],
        &[6, r, s, 0, 6],
        &[6, 0, 0, 0, 0],
        &[8, 0, 0, 0xA5, 0x37],
        &[8, 0, 13, 0, 0],
        &[6, c, d, 0, 3],
        &[43, 14, 2, 0],
        &[4, 0x0F, 0, 0, 1],
        &[3, r, s, 0, 1],
        &[3, p, q, 0, 3],
    ]);
    // The last ones with the echoes of three requests on their way, none of which meets a request.
    for (delay, every) in [
        ("0us", 190),
        ("300us", 190),
        ("2ms", 190),
        ("5ms", 190),
        ("90ms", 190),
        ("500ms", 700),
        ("500ms", 190),
    ] {
        let more = format!("[modbus]\necho = {{ delay = \"{delay}\" }}\n");
        let count = asked.len() as u64;
        // A second more: what an echo provokes comes later.
        let ran = exchanged(&more, &timed(asked.clone(), 200, every), 200 + count * every + 1_000);
        // With an answer more than requests, `exchanges` has not come back.
        assert_eq!(ran.len(), asked.len(), "{delay}");
        for (exchange, asked) in ran.iter().zip(&asked) {
            let answer = answer(exchange);
            assert_eq!(answer[1] & 0x7F, asked[1], "{delay}: {answer:02X?}");
        }
        assert_eq!(ran[11].registers(), Some(vec![6]), "{delay}: the last value stays");
        assert_eq!(ran[12].registers(), Some(vec![3, 2, 1]), "{delay}: one command, done");
    }
}

/// A frame with the bit of an exception in its function, as the issue has it, and others that are no requests.
#[test]
fn answers_are_not_answered() {
    let mut frames = vec![vec![0x01, 0x84, 0x01, 0x82, 0xC0]];
    let answers: [&[u8]; 7] = [
        &[0x84, 1],
        &[0x83, 0, 0, 0, 1],
        &[0xFF, 0],
        &[3, 2, 0, 5],
        &[4, 8, 0x12, 0x34, 0x56, 0x78, 0x42, 0xF6, 0xE9, 0x79],
        &[16, 0x10, 0, 0, 4],
        &[43, 14, 1, 0x82, 0, 0, 1, 0, 1, b'x'],
    ];
    frames.extend(requests(&answers));
    frames.push(modbus::frame(&[8, 0, 15, 0, 0]));
    let ran = exchanged("", &timed(frames, 200, 50), 1_000);
    let (last, others) = ran.split_last().expect("exchanges");
    assert!(others.iter().all(|exchange| exchange.answer.is_none()), "{others:02X?}");
    // All of them are counted: nothing was sent to them.
    assert_eq!(answer(last)[2..6], [0, 15, 0, 8]);
}

/// Row 13: zeros behind a frame, which its checksum cannot see.
#[test]
fn zeros_cost_no_read_and_reach_no_write() {
    let [r, s] = RETRIES;
    let read = modbus::frame(&[4, 0, 0x0C, 0, 4]);
    assert_eq!(read, [0x01, 0x04, 0x00, 0x0C, 0x00, 0x04, 0x31, 0xCA], "as the issue has it");
    let (mut frames, mut writes) = (Vec::new(), 0);
    for zeros in [1, 2, 4, 30] {
        let zeros = vec![0; zeros];
        frames.push([&read[..], &zeros].concat());
        for pdu in [&[6, r, s, 0, 9][..], &[16, r, s, 0, 1, 2, 0, 9], &[8, 0, 10, 0, 0]] {
            frames.push([&modbus::frame(pdu)[..], &zeros].concat());
            writes += 1;
        }
    }
    frames.extend(requests(&[&[3, r, s, 0, 1], &[8, 0, 15, 0, 0], &[6, r, s, 0, 2], &[3, r, s, 0, 1]]));
    let ran = exchanged("", &timed(frames, 200, 60), 1_700);
    for exchange in &ran[..16] {
        let is_read = exchange.request.bytes[1] == 4;
        let expected = is_read.then_some(&[0x12, 0x34, 0x56, 0x78, 0x42, 0xF6, 0xE9, 0x79][..]);
        let found = exchange.answer.as_ref().map(|answer| &answer.bytes[3..11]);
        assert_eq!(found, expected, "{:02X?}", exchange.request.bytes);
    }
    let before = ran[16].registers().expect("retries");
    assert_ne!(before, [9]);
    assert_eq!(answer(&ran[17])[4..6], [0, writes]);
    assert_eq!(ran[19].registers(), Some(vec![2]), "without zeros, it works");
}

/// USB adapters, row 14: a request cut at every byte, with pauses up to t3.5, at three bit rates.
#[test]
fn pauses_within_a_request() {
    let [a, b] = SETTINGS;
    // MODBUS over Serial Line V1.02, section 2.5.1.1, for eleven bits a character; µs.
    for (baud, t3_5, every) in [(9_600, 4_010, 60), (19_200, 2_005, 35), (115_200, 1_750, 20)] {
        let mut text = format!(
            "typed = [{{ at = \"100ms\", line = \"modbus baud {baud}\" }}]\n[modbus]\nbaud = {baud}\n"
        );
        let mut at = 300;
        let mut asked = 0;
        for pdu in [&[4, 0, 0x0C, 0, 4][..], &[16, a, b, 0, 2, 4, 0, 1, 0, 1]] {
            let frame = modbus::frame(pdu);
            let bytes: Vec<String> = frame.iter().map(|byte| format!("{byte:02x}")).collect();
            for cut in 1..frame.len() {
                // 1.1 ms and 0.84 ms are the issue's.
                for pause in [300, 840, 1_100, t3_5 * 3 / 4, t3_5 - 60] {
                    write!(
                        text,
                        "[[modbus.request]]\nat = \"{at}ms\"\nbytes = \"{}\"\n\
                         gaps = [{{ before = {cut}, length = \"{pause}us\" }}]\n",
                        bytes.join(" ")
                    )
                    .expect("memory");
                    at += every;
                    asked += 1;
                }
            }
        }
        let ran = run(&format!("duration = \"{at}ms\"\n{text}"));
        // A long pause is two frames to this test's eye: only the answers count.
        let exchanges = modbus::exchanges(&ran.bus_log);
        let answers: Vec<u8> =
            exchanges.iter().filter_map(|exchange| Some(exchange.answer.as_ref()?.bytes[1])).collect();
        assert_eq!(answers.len(), asked, "{baud}");
        assert!(answers.iter().all(|function| [4, 16].contains(function)), "{baud}: {answers:?}");
    }
}

/// Row 22: what the image says of itself has no object without a text.
#[test]
fn no_identification_object_is_empty() {
    let mut frames = requests(&[&[43, 14, 1, 0], &[43, 14, 2, 0], &[43, 14, 3, 0]]);
    frames.extend((0..8).map(|object| modbus::frame(&[43, 14, 4, object])));
    let ran = exchanged("", &timed(frames, 200, 100), 1_500);
    let mut there = Vec::new();
    for exchange in &ran[..3] {
        let bytes = answer(exchange);
        assert_eq!((bytes[1], bytes[4], bytes[5]), (43, 0x82, 0), "regular, nothing follows");
        let (mut objects, mut at) = (Vec::new(), 8);
        while at < bytes.len() - 2 {
            let length = usize::from(bytes[at + 1]);
            assert!(length > 0, "object {}: {bytes:02X?}", bytes[at]);
            objects.push(bytes[at]);
            at += 2 + length;
        }
        assert_eq!((at, objects.len()), (bytes.len() - 2, usize::from(bytes[7])));
        there = objects;
    }
    assert!(there.starts_with(&[0, 1, 2]), "basic: {there:?}");
    for (object, exchange) in (0..).zip(&ran[3..]) {
        let bytes = answer(exchange);
        match there.contains(&object) {
            true => assert!(bytes[1] == 43 && bytes[9] > 0, "{bytes:02X?}"),
            false => assert_eq!(bytes[1..3], [0xAB, 2]),
        }
    }
}

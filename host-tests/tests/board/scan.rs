//! Sensors found and identified through the shipped image's Modbus port, by registers alone.

use clino_host_tests::{modbus, run};

/// Function 16 to the command block: command, target, value.
fn command(code: u8, target: u8, value: u8) -> [u8; 14] {
    [0x10, 0x1F, 0x00, 0x00, 0x04, 0x08, 0x00, code, 0x00, target, 0x00, 0x00, 0x00, value]
}

/// Function 4.
fn read(first: u16, quantity: u8) -> [u8; 5] {
    let [high, low] = first.to_be_bytes();
    [0x04, high, low, 0x00, quantity]
}

const SCAN: u8 = 7;
const INFO: u8 = 8;
const CANCEL: u8 = 5;
const OUTCOME: u16 = 0x1F08;
const RESULT: u16 = 0x09C0;
const WINDOW: u16 = 0x0A00;
/// Registers of a block of the window.
const BLOCK: usize = 16;

fn wide(words: &[u16]) -> u32 {
    u32::from(words[0]) << 16 | u32::from(words[1])
}

/// Six characters in three registers of four.
fn text(words: &[u16]) -> String {
    let bytes: Vec<u8> = words[..3].iter().flat_map(|word| word.to_be_bytes()).collect();
    String::from_utf8(bytes).expect("ASCII")
}

#[test]
fn sensors_are_found_and_identified_over_modbus_alone() {
    // The serial number of a simulated T7 is its address.
    let addresses = [1, 2, 7, 100];
    let requests = [
        (&command(SCAN, 0, 0)[..], 500),
        // While it goes on, and when it is over.
        (&read(WINDOW, 80), 900),
        (&read(OUTCOME, 3), 3_400),
        (&read(RESULT, 8), 3_500),
        (&read(WINDOW, 80), 3_600),
        (&command(INFO, 0, 0), 3_800),
        (&read(OUTCOME, 3), 4_300),
        (&read(RESULT, 48), 4_400),
        (&command(INFO, 3, 0), 4_500),
        (&read(OUTCOME, 3), 8_000),
        (&read(RESULT, 48), 8_100),
        // The window is still there; another scan clears it, and is stopped.
        (&read(WINDOW, 16), 8_200),
        (&command(SCAN, 0, 0), 8_300),
        (&read(WINDOW, 80), 8_340),
        (&command(CANCEL, 0, 0), 8_600),
        (&read(RESULT, 8), 8_800),
        // A PWM input is no sensor to be asked, the ISU bus none to be scanned.
        (&command(INFO, 4, 0), 8_900),
        (&command(SCAN, 1, 0), 9_000),
    ];
    let requests: String = requests.into_iter().map(|(pdu, at)| modbus::request(pdu, at)).collect();
    let t7s =
        addresses.map(|address| format!("{{ address = {address}, motion.constant = 12.5 }}")).join(", ");
    let ran = run(&format!(
        r#"
        seed = 1
        duration = "9200ms"
        t7 = [{t7s}]
        isu = [{{ address = 1, motion.constant = 90.0 }}]
        [modbus]
        {requests}
        "#
    ));
    let exchanges = modbus::exchanges(&ran.bus_log);
    let registers =
        |index: usize| exchanges[index].registers().unwrap_or_else(|| panic!("{:?}", exchanges[index]));

    let found = |words: &[u16], scan: u16| {
        let blocks = words.chunks(BLOCK).take_while(|block| block[0] != 0);
        let found = blocks.map(|block| {
            assert_eq!((block[0], block[1]), (scan, 1), "{block:?}");
            assert_eq!((wide(&block[4..]), text(&block[8..])), (115_200, "T7-1  ".to_owned()));
            assert_eq!(text(&block[12..]), "0.32  ");
            (block[2], wide(&block[6..]))
        });
        found.collect::<Vec<_>>()
    };
    let truth: Vec<_> = addresses.iter().map(|&address| (address, u32::from(address))).collect();
    let early = found(&registers(1), 1);
    assert!(!early.is_empty() && early.len() < truth.len() && truth.starts_with(&early), "{early:?}");
    assert_eq!(registers(2), [u16::from(SCAN), 2, 1], "done");
    // Sequence, no writes, the scan, four found; four devices, no suspects, 101 addresses, complete.
    assert_eq!(registers(3), [1, 0xFFFF, 1, 4, 4, 0, 101, 1]);
    assert_eq!(found(&registers(4), 1), truth);

    assert_eq!(registers(6), [u16::from(INFO), 2, 2]);
    let t7 = registers(7);
    assert_eq!((t7[0], t7[2], t7[3]), (2, 1, 4), "the scan is as it was");
    assert_eq!((wide(&t7[10..]), text(&t7[12..]), text(&t7[16..])), (1, "T7-1  ".into(), "0.32  ".into()));
    assert_eq!(t7[19..30], [1_000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], "damping, range, directions, offsets");
    assert!(t7[4..10].iter().all(|&word| word == 0xFFFF), "{t7:?}");

    assert_eq!(registers(9), [u16::from(INFO), 2, 3]);
    let isu = registers(10);
    assert_eq!((isu[0], isu[8]), (3, 1), "address");
    assert_eq!(
        (wide(&isu[38..]), wide(&isu[40..]), isu[43]),
        (90_000, 0, 1),
        "angle, null position, checksum"
    );
    assert_eq!(isu[42] & 1, 0, "no auto-shutoff");
    assert_eq!((wide(&isu[10..]), isu[19]), (u32::MAX, 0xFFFF), "an ISU has no serial number to read");

    assert_eq!(registers(11)[..3], [1, 1, 1]);
    let fresh = registers(13);
    assert!(
        fresh.chunks(BLOCK).all(|block| [0, 4].contains(&block[0])),
        "nothing of the first scan: {fresh:?}"
    );
    assert!(found(&fresh, 4).len() < truth.len());
    let stopped = registers(15);
    assert_eq!((stopped[0], stopped[2], stopped[7]), (5, 4, 0), "not complete");
    for refused in [16, 17] {
        let answer = exchanges[refused].answer.as_ref().expect("an answer");
        assert_eq!(answer.bytes[1..3], [0x90, 3], "{answer:?}");
    }
    // The angles went on, and nothing was written to a sensor.
    assert!(ran.slot(0).filter(|spoken| spoken.is_ok()).count() > 50);
    assert!(ran.t7.polls.iter().all(|poll| poll.request.len() == 3));
}

//! Modbus masters: stock pymodbus, and `mbpoll` as `docs/quick-start-virtual.md` has it.

use std::fs::OpenOptions;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use clino_host_tests::modbus::frame;
use clino_testkit::programs::{Mbpoll, said, skipped};

use super::bench::{angle, truth};
use super::board::Board;
use super::scripts::run;

/// The list that SCADA people import.
fn csv() -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/modbus.csv");
    path.to_str().expect("a path that is text").to_owned()
}

/// What the script printed, and whether the board was as fast as real time.
fn with_master(script: &str) -> (String, bool) {
    let board = Board::start(script);
    let (csv, truth) = (csv(), truth());
    let mut arguments = vec![board.modbus.as_str(), &board.console, &csv];
    arguments.extend(truth.iter().map(String::as_str));
    let printed = run(script, &arguments);
    (printed, board.stop())
}

/// The timeout that people leave as it is, ms.
const USUAL_TIMEOUT: u32 = 1_000;

#[test]
fn pymodbus_reads_the_block_and_knows_who_it_is() {
    let (printed, in_real_time) = with_master("block.py");
    let longest = printed.split("longest answer ").nth(1).and_then(|rest| rest.split(" ms").next());
    let longest: u32 = longest.and_then(|number| number.parse().ok()).expect("the longest answer");
    assert!(longest < USUAL_TIMEOUT || !in_real_time, "96 registers after {longest} ms");
}

#[test]
fn pymodbus_changes_settings_and_is_refused_what_must_not_be() {
    with_master("settings.py");
}

#[test]
fn pymodbus_finds_every_number_of_the_list() {
    with_master("map.py");
}

/// `mbpoll`, if it can be had.
fn mbpoll() -> Option<&'static Mbpoll> {
    static MBPOLL: OnceLock<Result<Mbpoll, String>> = OnceLock::new();
    MBPOLL.get_or_init(|| Mbpoll::get(Path::new(env!("CARGO_TARGET_TMPDIR")))).as_ref().map_or_else(
        |why| {
            skipped("mbpoll", &format!("it is not installed, and could not be downloaded\n{why}"));
            None
        },
        Some,
    )
}

/// Runs `mbpoll` with these arguments; number and value of each register it shows.
fn poll(mbpoll: &Mbpoll, arguments: &str, port: &str) -> Vec<(u16, String)> {
    // As patient as it can be: the machine may be busy with other tests.
    let line = "-m rtu -a 1 -b 19200 -P even -o 10 -1";
    let mut command = mbpoll.command();
    command.args(line.split(' ')).args(arguments.split(' ')).arg(port);
    let output = command.output().expect("mbpoll runs");
    assert!(output.status.success(), "{command:?}: {}", said(&output));
    let shown = String::from_utf8_lossy(&output.stdout);
    let rows = shown.lines().filter_map(|line| line.strip_prefix('[')?.split_once("]:"));
    rows.map(|(number, value)| (number.parse().expect("a number"), value.trim().to_owned())).collect()
}

/// A program may have the Modbus port open while the gateway is still starting, which takes longer the busier the computer
/// is: what it sends then waits for the gateway.
#[test]
fn a_request_from_before_the_gateway_has_started_is_answered() {
    // The test patterns of the header.
    let request = frame(&[3, 0, 12, 0, 4]);
    let expected = frame(&[3, 8, 0x12, 0x34, 0x56, 0x78, 0x42, 0xF6, 0xE9, 0x79]);
    let length = expected.len();
    let board = Board::start("early");
    let mut port = OpenOptions::new().read(true).write(true).open(&board.modbus).expect("it opens");
    port.write_all(&request).expect("it is written");
    let (sender, answer) = channel();
    thread::spawn(move || {
        let mut answer = vec![0; length];
        sender.send(port.read_exact(&mut answer).map(|()| answer))
    });
    let answer = answer.recv_timeout(Duration::from_secs(60)).expect("an answer").expect("bytes");
    assert_eq!(answer, expected);
    board.stop();
}

#[test]
fn mbpoll_reads_angles_as_the_quick_start_says() {
    let Some(mbpoll) = mbpoll() else { return };
    let board = Board::start("mbpoll");
    let test = poll(mbpoll, "-t 4:hex -r 13 -c 4", &board.modbus);
    assert_eq!(
        test.iter().map(|(_, word)| word.as_str()).collect::<Vec<_>>(),
        ["0x1234", "0x5678", "0x42F6", "0xE979"]
    );
    // The last to come is the ISU's, which has a new angle every 533 ms.
    let deadline = Instant::now() + Duration::from_secs(120);
    while poll(mbpoll, "-t 4 -r 26 -c 1", &board.modbus) != [(26, "6".to_owned())] {
        assert!(Instant::now() < deadline, "six slots are right");
    }
    // 32 angles and 32 ages in one read.
    let block = poll(mbpoll, "-t 4:hex -r 33 -c 96", &board.modbus);
    assert_eq!(
        (block.len(), block.first().map(|row| row.0), block.last().map(|row| row.0)),
        (96, Some(33), Some(128))
    );
    let word =
        |at: usize| u16::from_str_radix(block[at].1.trim_start_matches("0x"), 16).expect("hexadecimal");
    let angles = poll(mbpoll, "-t 4:int -B -r 33 -c 32", &board.modbus);
    assert_eq!(angles.len(), 32);
    for (slot, (_, shown)) in angles.iter().enumerate() {
        let mdeg: i32 = shown.parse().expect("a number");
        let same = i32::from(word(2 * slot) as i16) << 16 | i32::from(word(2 * slot + 1));
        let age = word(64 + slot);
        match angle(slot) {
            Some((true_angle, tolerance)) => {
                let tolerance = tolerance + 0.000_5;
                assert!(
                    (f64::from(mdeg) / 1e3 - true_angle).abs() <= tolerance,
                    "slot {slot}: {mdeg}, {true_angle}"
                );
                assert!(
                    (f64::from(same) / 1e3 - true_angle).abs() <= tolerance,
                    "slot {slot}: {same}, {true_angle}"
                );
                assert!(age < 1_500, "slot {slot}: {age} ms");
            }
            None => assert_eq!((mdeg, same, age), (i32::MIN, i32::MIN, 0xFFFF), "slot {slot}"),
        }
    }
    // Register 4131 is slot 1's address: it reads the T7 at address 5 then.
    let arguments = "-m rtu -a 1 -b 19200 -P even -o 10 -t 4 -r 4131";
    let written = mbpoll.command().args(arguments.split(' ')).arg(&board.modbus).arg("5").output();
    let written = written.expect("mbpoll runs");
    assert!(written.status.success(), "{}", said(&written));
    assert_eq!(poll(mbpoll, "-t 4 -r 4131 -c 1", &board.modbus), [(4131, "5".to_owned())]);
    board.stop();
}

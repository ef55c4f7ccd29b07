//! What the words after an address do.

use std::time::Duration;

use super::port::Port;
use super::server::Server;
use super::{ASK_3, ASK_5, SAYS_5};

const SILENCE: Duration = Duration::from_millis(1_200);

#[test]
fn an_isu_with_rx_low_prints_lines() {
    let server = Server::start("--isu 3,ascii,angle=-4.31 --pty");
    let mut port = Port::open(&server.path());
    let mut lines = port.read(18);
    // The terminal may have been opened in the middle of a line.
    let end = lines.iter().position(|&byte| byte == b'\n').expect("a line") + 1;
    lines.rotate_left(end);
    assert_eq!(lines.as_slice(), b"-  4.31\r\n".repeat(2));
}

#[test]
fn an_isu_in_hard_error_says_so_until_told_otherwise() {
    let server = Server::start("--isu 3,hard-error --pty");
    let mut port = Port::open(&server.path());
    assert_eq!(port.ask(&ASK_3, 4), [0x02, 0xF1, 0x34, 0x25]);
    assert_eq!(port.ask(&[0x01, 0x30, 0x30], 3), [0x01, 0x31, 0x31]);
    assert_eq!(port.ask(&ASK_3, 6)[..3], [0x04, 0x35, 0x58]);
}

#[test]
fn a_fault_befalls_every_so_manieth_answer() {
    let server = Server::start("--t7 5,angle=12.345,fault=silent/3 --pty");
    let mut port = Port::open(&server.path());
    for number in 1..=6 {
        port.send(&ASK_5);
        if number % 3 == 0 {
            assert_eq!(port.read_within(1, SILENCE), b"", "answer {number}");
        } else {
            assert_eq!(port.read(SAYS_5.len()), SAYS_5, "answer {number}");
        }
    }
}

#[test]
fn a_flash_that_fails_stores_nothing() {
    let server = Server::start("--t7 5,flash=erase-fails,damping=1000 --pty");
    let mut port = Port::open(&server.path());
    assert_eq!(port.ask(&[0x05, 0x04, 0x8B, 0x01, 0xF4, 0x77], 5), [0x05, 0x03, 0x8B, 0x07, 0x66]);
    assert_eq!(port.ask(&[0x05, 0x01, 0x8A], 6), [0x05, 0x04, 0x8A, 0x03, 0xE8, 0x82]);
}

#[test]
fn an_angle_moves_and_a_device_is_who_it_is_told_to_be() {
    let server = Server::start("--t7 5,angle=ramp:-100:10,model=t7-3,serial=25033,angle0=45 --pty");
    let mut port = Port::open(&server.path());
    let information = port.ask(&[0x05, 0x01, 0x8E], 22);
    assert_eq!(information[3..7], [0x00, 0x00, 0x61, 0xC9]);
    assert_eq!(&information[13..19], b"T7-3  ");
    assert_eq!(port.ask(&[0x05, 0x01, 0x81], 8)[3..7], 45_000_i32.to_be_bytes());
    let [first, second] = [0, 1].map(|_| {
        let answer = port.ask(&ASK_5, 8);
        std::thread::sleep(Duration::from_millis(100));
        i32::from_be_bytes(answer[3..7].try_into().unwrap())
    });
    assert!(first >= -100_000 && second >= first + 1_000, "{first} {second}");
}

#[test]
fn bit_errors_spoil_what_is_said() {
    let server = Server::start("--t7 5,angle=12.345 --bit-error-rate 1 --pty");
    let mut port = Port::open(&server.path());
    port.send(&ASK_5);
    // With every bit inverted there is no start bit.
    assert_eq!(port.read_within(1, SILENCE), b"");
}

#[test]
fn what_is_said_is_told_on_standard_error() {
    let server = Server::start("--t7 5,angle=12.345 --t7 5 --pty --verbose");
    let mut port = Port::open(&server.path());
    port.send(&ASK_5);
    // A second look at the bus, after the collision.
    port.read_until_silent(SILENCE);
    assert_eq!(port.ask(&[0x05, 0x01, 0x8C], 5), [0x05, 0x03, 0x8C, 0x00, 0x6C]);
    drop(port);
    let notes = server.notes();
    for part in [
        "t7 bus: t7-1 5 (serial 1001)",
        "t7 program: 05 01 83",
        "t7 t7-1 5 (serial 1002): 05 06 83",
        "t7-1 5 (serial 1001) and t7-1 5 (serial 1002) talk at once",
        "t7 program: 05 01 8C",
    ] {
        assert!(notes.contains(part), "{part} in: {notes}");
    }
}

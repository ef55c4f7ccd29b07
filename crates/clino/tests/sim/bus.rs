//! What is true of a pair of wires, seen through the terminal: time, bit rates, collisions.

use std::time::{Duration, Instant};

use super::port::Port;
use super::server::Server;
use super::{ASK_5, SAYS_5};

/// A wait in which nothing must come. It is also more than the 500 ms after which a T7 gives up a false command.
const SILENCE: Duration = Duration::from_millis(1_200);

#[test]
fn an_answer_never_comes_early() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let mut port = Port::open(&server.path());
    // Three and eight characters of ten bits, and 2 ms between, without the half bit that is left at the end.
    let least = Duration::from_micros(2_000 + 11 * 10 * 1_000_000 / 115_200 - 10);
    for _ in 0..100 {
        let asked = Instant::now();
        assert_eq!(port.ask(&ASK_5, SAYS_5.len()), SAYS_5);
        assert!(asked.elapsed() >= least, "{:?}", asked.elapsed());
    }
}

#[test]
fn a_program_at_the_wrong_bit_rate_is_not_understood() {
    let server = Server::start("--t7 5,angle=12.345 --t7 6,baud=9600 --pty");
    let mut port = Port::open(&server.path());
    for wrong in [9_600, 57_600] {
        port.set_baud(wrong);
        port.send(&ASK_5);
        assert_eq!(port.read_within(1, SILENCE), b"", "{wrong}");
    }
    port.set_baud(115_200);
    assert_eq!(port.ask(&ASK_5, SAYS_5.len()), SAYS_5);
    port.set_baud(9_600);
    // What was said at another rate may be the beginning of a command for this one.
    assert_eq!(port.read_within(1, SILENCE), b"");
    assert_eq!(port.ask(&[0x06, 0x01, 0x8C], 5), [0x06, 0x03, 0x8C, 0x00, 0x6B]);
}

#[test]
fn a_change_of_the_bit_rate_is_followed() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let mut port = Port::open(&server.path());
    assert_eq!(port.ask(&[0x05, 0x03, 0x8F, 0x03, 0x66], 5), [0x05, 0x03, 0x8F, 0x00, 0x69]);
    // The device changes 10 ms after its answer.
    assert_eq!(port.read_within(1, SILENCE), b"");
    port.send(&ASK_5);
    assert_eq!(port.read_within(1, SILENCE), b"", "still at the old rate");
    port.set_baud(19_200);
    assert_eq!(port.ask(&ASK_5, SAYS_5.len()), SAYS_5);
}

#[test]
fn two_sensors_at_one_address_talk_over_each_other() {
    let server = Server::start("--t7 5,angle=12.345 --t7 5,angle=-77.7 --t7 6,angle=12.345 --pty");
    let mut port = Port::open(&server.path());
    let alone = port.ask(&[0x06, 0x01, 0x83], 8);
    assert_eq!(alone, [0x06, 0x06, 0x83, 0x00, 0x00, 0x30, 0x39, 0x08]);
    // Chance decides which sensor wins each bit, and depends on the time: one sensor wins all of them once in a million.
    let mut spoilt = 0;
    for _ in 0..5 {
        port.send(&ASK_5);
        let heard = port.read_until_silent(SILENCE);
        assert!(heard.starts_with(&SAYS_5[..3]), "what both say gets through: {heard:02X?}");
        let sum = heard.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
        spoilt += usize::from(heard.len() != 8 || sum != 0);
    }
    assert!(spoilt > 0);
    // By its serial number one of them gets an address of its own.
    let answer = port.ask(&[0x05, 0x08, 0x91, 0x04, 0x00, 0x00, 0x03, 0xEA, 0x09, 0x68], 5);
    assert_eq!(answer, [0x05, 0x03, 0x91, 0x00, 0x67]);
    assert_eq!(port.ask(&ASK_5, SAYS_5.len()), SAYS_5);
    assert_eq!(port.ask(&[0x09, 0x01, 0x8C], 5), [0x09, 0x03, 0x8C, 0x00, 0x68]);
}

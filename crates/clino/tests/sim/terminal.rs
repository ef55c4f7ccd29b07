//! What comes and goes at the terminal: opening, closing, settings.

use std::thread;
use std::time::Duration;

use rustix::termios::{InputModes, LocalModes, OutputModes};

use super::port::Port;
use super::server::Server;
use super::{ASK_3, ASK_5, SAYS_3, SAYS_5};

/// Long enough for the simulator to notice something, however busy the computer.
const A_WHILE: Duration = Duration::from_secs(1);

#[test]
fn it_is_raw_and_at_the_sensors_bit_rate_before_anyone_sets_it() {
    let server = Server::start("--t7 5 --isu 3 --pty");
    for baud in [115_200, 9_600] {
        let attributes = Port::open(&server.path()).attributes();
        assert_eq!((attributes.input_speed(), attributes.output_speed()), (baud, baud));
        let local = LocalModes::ECHO | LocalModes::ICANON | LocalModes::ISIG | LocalModes::IEXTEN;
        assert!(!attributes.local_modes.intersects(local), "{:?}", attributes.local_modes);
        let input = InputModes::ICRNL | InputModes::INLCR | InputModes::IXON | InputModes::ISTRIP;
        assert!(!attributes.input_modes.intersects(input), "{:?}", attributes.input_modes);
        assert!(!attributes.output_modes.contains(OutputModes::OPOST));
    }
}

#[test]
fn every_byte_passes_both_ways_unchanged() {
    let server = Server::start("--t7 127 --pty --echo");
    let mut port = Port::open(&server.path());
    // As commands, these are for other addresses.
    let all: Vec<u8> = (0..=255).collect();
    assert_eq!(port.ask(&all, all.len()), all);
}

#[test]
fn it_may_be_opened_and_closed_at_any_time() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let path = server.path();
    for _ in 0..20 {
        assert_eq!(Port::open(&path).ask(&ASK_5, SAYS_5.len()), SAYS_5);
        drop(Port::open(&path));
    }
    let mut first = Port::open(&path);
    drop(Port::open(&path));
    assert_eq!(first.ask(&ASK_5, SAYS_5.len()), SAYS_5, "another one has closed it");
}

#[test]
fn an_unread_answer_is_lost_for_the_next_program() {
    let server = Server::start("--t7 5,angle=12.345 --isu 3,angle=90 --pty");
    for (ask, says) in [(&ASK_5[..], &SAYS_5[..]), (&ASK_3, &SAYS_3)] {
        let path = server.path();
        for wait in [Duration::ZERO, Duration::from_millis(100)] {
            let mut port = Port::open(&path);
            port.send(ask);
            // Closed before the answer, or after it.
            thread::sleep(wait);
            drop(port);
            thread::sleep(A_WHILE);
            assert_eq!(Port::open(&path).ask(ask, says.len()), says);
        }
    }
}

#[test]
fn answers_wait_as_long_as_it_is_open() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let mut port = Port::open(&server.path());
    port.send(&ASK_5);
    thread::sleep(A_WHILE);
    port.send(&ASK_5);
    thread::sleep(A_WHILE);
    assert_eq!(port.read(2 * SAYS_5.len()), [SAYS_5, SAYS_5].concat());
}

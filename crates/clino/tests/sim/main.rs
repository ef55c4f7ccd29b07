//! `clino sim` as programs meet it: device paths on standard output, sensors behind them.
//!
//! Limits of time are generous: what is waited for comes when the computer gets around to it. Where nothing must come,
//! a wait is short, and followed by something that must.
#![cfg(target_os = "linux")]

mod attached;
mod bus;
mod options;
mod port;
mod pyserial;
mod server;
mod terminal;
mod usage;

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use server::Server;

/// Get Angle of axis 2 from address 5.
const ASK_5: [u8; 3] = [0x05, 0x01, 0x83];
/// The answer at 12.345°, `angle=12.345`.
const SAYS_5: [u8; 8] = [0x05, 0x06, 0x83, 0x00, 0x00, 0x30, 0x39, 0x09];
/// Read RAM 58H, two bytes, from address 3.
const ASK_3: [u8; 5] = [0x03, 0x34, 0x58, 0x02, 0x8E];
/// The answer at 90°, `angle=90`.
const SAYS_3: [u8; 6] = [0x04, 0x35, 0x58, 0x40, 0x00, 0xCD];

#[test]
fn each_bus_has_a_line_with_its_path_the_t7s_first() {
    let both = Server::start("--isu 3,angle=90 --t7 5,angle=12.345 --t7 6 --pty");
    let [t7, isu] = [0, 1].map(|_| both.path());
    assert!(t7.starts_with("/dev/") && isu.starts_with("/dev/") && t7 != isu, "{t7} {isu}");
    assert_eq!(port::Port::open(&t7).ask(&ASK_5, SAYS_5.len()), SAYS_5);
    assert_eq!(port::Port::open(&isu).ask(&ASK_3, SAYS_3.len()), SAYS_3);
    assert_eq!(both.stop(server::Signal::TERM), (Some(0), vec![]), "nothing but paths");
}

/// A signal may come at any instant of a simulator that works; without `retry_on_intr` three of a hundred ended it with an error.
#[test]
fn a_signal_ends_a_simulator_that_works_as_it_should() {
    for _ in 0..100 {
        let server = Server::start("--t7 5 --pty");
        let mut port = port::Port::open(&server.path());
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    // The other end may be gone already.
                    let _ = port.try_send(&ASK_5);
                    thread::sleep(Duration::from_micros(100));
                }
            });
            thread::sleep(Duration::from_millis(5));
            let ended = server.stop(server::Signal::TERM);
            is_over.store(true, Ordering::Relaxed);
            assert_eq!(ended, (Some(0), vec![]));
        });
    }
}

#[test]
fn one_bus_has_one_line_and_either_signal_ends_it() {
    for (line, signal) in
        [("--t7 5 --pty", server::Signal::TERM), ("--isu 14 --pty --verbose", server::Signal::INT)]
    {
        let server = Server::start(line);
        assert!(server.path().starts_with("/dev/"), "{line}");
        assert_eq!(server.stop(signal), (Some(0), vec![]), "{line}");
    }
}

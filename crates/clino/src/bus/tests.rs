//! The bus over a port that does what a pseudo-terminal cannot: errors of the receiver, a program that stands still.

use std::cell::RefCell;
use std::rc::Rc;
use std::thread;
use std::time::{Duration as SystemDuration, Instant as SystemInstant};

use clino_bus::T7;
use clino_codec::character::LineErrors;
use clino_codec::t7::{Address, Axis, Millidegrees, Request, Response};
use clino_commissioning::t7::{Cause, Failure, RESYNC};

use super::*;

const ASK: [u8; 3] = [0x05, 0x01, 0x83];
/// 12.345°.
const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0x00, 0x00, 0x30, 0x39, 0x09];
const LATENCY: SystemDuration = SystemDuration::from_millis(30);
/// What the computer may take for itself.
const BUSY: SystemDuration = SystemDuration::from_millis(400);

/// What was done with the port, in order.
#[derive(Debug, PartialEq, Eq)]
enum Done {
    Sent(Vec<u8>),
    Released,
    Baud(u32),
}

/// A port on a table.
struct Fake {
    done: Rc<RefCell<Vec<Done>>>,
    /// What comes back after each frame, and how long after it was handed over.
    answer: Vec<Character>,
    after: SystemDuration,
    /// How much longer than asked a wait takes.
    oversleep: SystemDuration,
    sent: Option<SystemInstant>,
    vanishes: bool,
}

impl Fake {
    fn saying(answer: Vec<Character>) -> (Self, Rc<RefCell<Vec<Done>>>) {
        let done = Rc::new(RefCell::new(Vec::new()));
        let [after, oversleep] = [SystemDuration::from_millis(3), SystemDuration::ZERO];
        (Self { done: Rc::clone(&done), answer, after, oversleep, sent: None, vanishes: false }, done)
    }
}

impl Port for Fake {
    fn receive(&mut self, wait: SystemDuration, heard: &mut Vec<Character>) -> Result<(), PortError> {
        if self.vanishes && self.sent.is_some() {
            return Err(PortError::new("fake", crate::port::Problem::Vanished));
        }
        let due = self.sent.map(|sent| sent + self.after);
        let until_due = due.map_or(wait, |due| due.saturating_duration_since(SystemInstant::now()));
        let is_wait = wait > SystemDuration::ZERO;
        thread::sleep(wait.min(until_due) + if is_wait { self.oversleep } else { SystemDuration::ZERO });
        // What comes during the wait ends it; what comes while the program stands still is there at the next look.
        if due.is_some_and(|due| due <= SystemInstant::now())
            && (!is_wait || self.oversleep == SystemDuration::ZERO)
        {
            self.sent = None;
            heard.extend(self.answer.iter().copied());
        }
        Ok(())
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), PortError> {
        self.sent = Some(SystemInstant::now());
        self.done.borrow_mut().push(Done::Sent(frame.to_vec()));
        Ok(())
    }

    fn sent(&mut self) -> Result<(), PortError> {
        self.done.borrow_mut().push(Done::Released);
        Ok(())
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), PortError> {
        self.done.borrow_mut().push(Done::Baud(baud));
        Ok(())
    }

    fn can_change_baud(&self) -> Result<(), PortError> {
        Ok(())
    }

    fn latency(&self) -> SystemDuration {
        LATENCY
    }
}

struct Deaf;

impl<E> Observer<E> for Deaf {
    fn event(&mut self, _: E) -> io::Result<()> {
        Ok(())
    }
    fn progress(&mut self, _: TaskProgress) {}
    fn stopping(&mut self) {}
}

fn bus(port: Fake, echo: EchoMode) -> Bus<T7> {
    let latency = port.latency();
    Bus::new(Box::new(port), Serial::T7_DEFAULT, Timing::t7, latency, echo)
}

fn ask(bus: &mut Bus<T7>) -> Result<Result<Response, Failure>, Broken> {
    let operation = AskT7::new(Address::new(5).unwrap(), Request::GetAngle(Axis::Two));
    bus.run(operation, &Stop::default(), &mut Deaf)
}

fn clean(bytes: &[u8]) -> Vec<Character> {
    bytes.iter().map(|&byte| Character::clean(byte)).collect()
}

fn is_answer(result: &Result<Response, Failure>) -> bool {
    matches!(result, Ok(Response::GetAngle { angle: Millidegrees(12_345), .. }))
}

#[test]
fn a_frame_goes_out_whole_and_its_end_is_told_once() {
    let (port, done) = Fake::saying(clean(&ANSWER));
    let mut bus = bus(port, EchoMode::Off);
    assert!(is_answer(&ask(&mut bus).unwrap()));
    assert_eq!(*done.borrow(), [Done::Sent(ASK.to_vec()), Done::Released]);
    assert_eq!((bus.counters().requests, bus.counters().good), (1, 1));
}

#[test]
fn an_answer_that_has_come_is_found_however_late_the_program_looks() {
    let (mut port, _) = Fake::saying(clean(&ANSWER));
    // Each wait takes ten times as long as the sensor may: the deadline has always passed.
    port.oversleep = LATENCY * 10;
    let mut bus = bus(port, EchoMode::Detect);
    assert!(is_answer(&ask(&mut bus).unwrap()));
    let counters = bus.counters();
    assert_eq!((counters.requests, counters.no_answer, counters.late), (1, 0, 0));
}

#[test]
fn an_echo_is_told_from_an_answer_in_every_mode() {
    for (echo, heard) in [
        (EchoMode::Detect, clean(&[&ASK[..], &ANSWER].concat())),
        (EchoMode::Expected, clean(&[&ASK[..], &ANSWER].concat())),
        (EchoMode::Detect, clean(&ANSWER)),
        (EchoMode::Off, clean(&ANSWER)),
        // Said to be absent, and there: the decoder passes over it.
        (EchoMode::Off, clean(&[&ASK[..], &ANSWER].concat())),
    ] {
        let (port, _) = Fake::saying(heard.clone());
        let mut bus = bus(port, echo);
        for _ in 0..3 {
            assert!(is_answer(&ask(&mut bus).unwrap()), "{echo:?} {heard:?}");
        }
        let is_known = echo != EchoMode::Off;
        let echoed = if is_known && heard.len() > ANSWER.len() { 9 } else { 0 };
        assert_eq!((bus.counters().echo, bus.counters().contention), (echoed, 0), "{echo:?} {heard:?}");
    }
}

fn kind(bus: &Bus<T7>) -> &'static str {
    diagnose(Make::T7, Asked::One, &bus.seen(), bus.counters()).kind
}

#[test]
fn what_the_receiver_says_leads_to_the_cause() {
    let flawed = |byte| Character { byte, errors: LineErrors::FRAMING };
    for (heard, expected) in [
        (vec![], "silence"),
        (clean(&ASK), "silence"),
        // The line is low when it should be idle.
        (vec![flawed(0), flawed(0)], "swapped"),
        // Something talks at another rate.
        (vec![flawed(0xE6), flawed(0x98), Character::clean(0x80), flawed(0xFE)], "wrong_rate"),
        // Two sensors at once.
        (clean(&[0x05, 0x06, 0x83, 0x00, 0x00, 0x34, 0x3B, 0x09]), "collision"),
    ] {
        let (port, _) = Fake::saying(heard.clone());
        let mut bus = bus(port, EchoMode::Detect);
        let result = ask(&mut bus).unwrap();
        assert!(matches!(result, Err(Failure { cause: Cause::NoAnswer { .. }, writes: 0 })), "{heard:?}");
        assert_eq!(kind(&bus), expected, "{heard:?} {:?}", bus.counters());
    }
}

#[test]
fn an_echo_that_is_expected_and_missing_is_named() {
    let (port, _) = Fake::saying(clean(&ANSWER));
    let mut bus = bus(port, EchoMode::Expected);
    assert!(ask(&mut bus).unwrap().is_err());
    assert_eq!(kind(&bus), "no_echo", "{:?}", bus.counters());
}

#[test]
fn a_port_that_vanishes_ends_the_operation() {
    let (mut port, _) = Fake::saying(vec![]);
    port.vanishes = true;
    match ask(&mut bus(port, EchoMode::Detect)) {
        Err(Broken::Port(error)) => assert_eq!(error.kind(), "port_vanished"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_user_who_wants_to_stop_waits_for_no_answer() {
    let (port, done) = Fake::saying(vec![]);
    let mut bus = bus(port, EchoMode::Detect);
    let stop = Stop::default();
    stop.ask();
    let began = SystemInstant::now();
    let operation = AskT7::new(Address::new(5).unwrap(), Request::GetAllData);
    let result = bus.run(operation, &stop, &mut Deaf).unwrap();
    assert!(matches!(result, Err(Failure { cause: Cause::Cancelled, .. })));
    bus.rest(RESYNC, &stop).unwrap();
    assert!(began.elapsed() < BUSY, "{:?}", began.elapsed());
    assert_eq!(*done.borrow(), []);
}

#[test]
fn another_rate_is_set_at_the_port_and_the_waits_follow() {
    let (port, done) = Fake::saying(clean(&ANSWER));
    let mut bus = bus(port, EchoMode::Detect);
    bus.set_serial(Serial { baud: 9_600 }).unwrap();
    assert!(is_answer(&ask(&mut bus).unwrap()));
    assert_eq!(done.borrow()[0], Done::Baud(9_600));
    assert_eq!((bus.serial().baud, bus.master.timing().serial.baud), (9_600, 9_600));
}

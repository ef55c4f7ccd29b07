//! Anything typed at the console: no panic, answers of a known length, text only, and nothing that cannot be undone without
//! a `y` or `--yes`.
//!
//! Input: whether every `y` is left out (odd), then what is typed. A byte that is no ASCII character lets time pass, too.
#![no_main]

#[allow(dead_code, reason = "made for the console's own tests")]
#[path = "../../crates/console/tests/console/desk.rs"]
mod desk;

use clino_bus::{Duration, Event};
use clino_gateway::order::Order;
use clino_gateway::{Action, Bus, task};
use desk::{Desk, Rest};
use libfuzzer_sys::fuzz_target;

/// The longest answer is the trace: 32 lines of 250 characters at most. Twice that.
const LONGEST_ANSWER: usize = 16_000;

fuzz_target!(|input: &[u8]| {
    let [settings, typed @ ..] = input else { return };
    let mut desk = Desk::new();
    let mut typist = Typist::default();
    for &byte in typed {
        if byte == b'y' && settings & 1 == 1 {
            continue;
        }
        let before = meant(&desk.rest);
        typist.types(byte);
        let printed = desk.type_bytes(&[byte]);
        assert!(printed.len() <= LONGEST_ANSWER, "{} characters at once", printed.len());
        if meant(&desk.rest) != before {
            typist.has_said_yes();
        }
        typist.reads(&printed);
        typist.ends(byte);
        if !byte.is_ascii() {
            later(&mut desk.rest, byte);
            let before = meant(&desk.rest);
            typist.reads(&desk.stream());
            assert_eq!(meant(&desk.rest), before, "time alone does nothing");
        }
    }
});

/// How often something was done that cannot be undone.
fn meant(rest: &Rest) -> usize {
    let writes = |order: &&Order| match order {
        Order::T7(task) => !matches!(task, task::t7::Task::Identify(_) | task::t7::Task::Sweep(_)),
        Order::Isu(task) => !matches!(task, task::isu::Task::Identify(_) | task::isu::Task::Reset(_)),
        Order::Slot { .. }
        | Order::Bus { .. }
        | Order::Console(_)
        | Order::Cancel(_)
        | Order::Acknowledge(_)
        | Order::ClearExtremes(_)
        | Order::ClearCounters => false,
    };
    let orders = rest.orders.iter().filter(writes).count();
    orders + rest.done.iter().filter(|done| **done != "save").count()
}

/// Time passes, up to 16 s; the sensors are silent.
fn later(rest: &mut Rest, byte: u8) {
    let step = u32::from(byte & 0x7F);
    rest.now = rest.now + Duration::from_millis(step * step);
    for bus in [Bus::T7, Bus::Isu] {
        let mut sent = false;
        rest.gateway.poll(bus, rest.now, |action| sent |= matches!(action, Action::Send(_)));
        if sent {
            rest.gateway.line(bus, Event::Released { at: rest.now });
        }
    }
    rest.publish();
}

/// What an observer of the input and the output knows.
#[derive(Default)]
struct Typist {
    /// Typed since the last line ended.
    line: Vec<u8>,
    ever_typed_y: bool,
    /// A question is open.
    is_asked: bool,
}

impl Typist {
    fn types(&mut self, byte: u8) {
        self.ever_typed_y |= byte == b'y';
        self.line.push(byte);
    }

    fn reads(&mut self, printed: &str) {
        match (printed.rfind("Go on? y/N "), printed.rfind("not done")) {
            (Some(asked), done) => self.is_asked = done.is_none_or(|done| done < asked),
            (None, Some(_)) => self.is_asked = false,
            (None, None) => {}
        }
    }

    fn ends(&mut self, byte: u8) {
        if matches!(byte, b'\r' | b'\n' | 0x03) {
            self.line.clear();
        }
    }

    /// Something was done just now: the line that ended said so.
    fn has_said_yes(&self) {
        let Some((b'\r' | b'\n', line)) = self.line.split_last() else {
            panic!("{:?} is no line", self.line.escape_ascii());
        };
        assert!(self.ever_typed_y);
        assert!(line.is_ascii(), "{:?} is damaged", line.escape_ascii());
        // What editing has made of a line is not followed here.
        if line.iter().any(u8::is_ascii_control) {
            return;
        }
        let unquoted: Vec<u8> = line.iter().copied().filter(|byte| !b"\"\\".contains(byte)).collect();
        let says_yes = unquoted.windows(5).any(|window| window == b"--yes");
        assert!(says_yes || self.is_asked && line == b"y", "{:?}", line.escape_ascii());
    }
}

//! A port that sends back whatever it receives: no output without end, and nothing changes.
//!
//! A Linux port whose echo was left on (`stty sane; cat`), a radio modem, two wires that touch. What the gateway writes comes
//! back after a delay, as it was or as a terminal driver makes it.

use std::collections::VecDeque;

use clino_bus::Instant;
use clino_console::Received;

use crate::desk::Desk;

const DELAYS_MS: [u64; 6] = [0, 1, 10, 100, 200, 500];
/// Characters on the wire in a millisecond, at 115200 bit/s.
const PER_MS: usize = 11;
/// Shorter than that of the image: there is no need to wait for it.
const IDLE_S: u32 = 4;
/// The main loop wakes up this often when nothing happens.
const ROUND_MS: u64 = 65;

/// What comes back of a character.
type Echo = fn(u8) -> Vec<u8>;

fn raw(byte: u8) -> Vec<u8> {
    vec![byte]
}

/// `stty sane`: CR becomes LF, which comes back as CR LF; control characters come back as `^X`.
fn cooked(byte: u8) -> Vec<u8> {
    match byte {
        b'\r' | b'\n' => b"\r\n".to_vec(),
        b'\t' => b"\t".to_vec(),
        0..0x20 | 0x7F => vec![b'^', byte ^ 0x40],
        _ => vec![byte],
    }
}

/// A gateway that talks to itself.
struct Loop {
    desk: Desk,
    echo: Echo,
    delay_ms: u64,
    now_ms: u64,
    /// On its way back, with the time of its arrival.
    back: VecDeque<(u64, u8)>,
    /// On its way out.
    out: VecDeque<u8>,
}

impl Loop {
    fn new(echo: Echo, delay_ms: u64) -> Loop {
        let (back, out) = (VecDeque::new(), VecDeque::new());
        Loop { desk: Desk::left_alone_after(IDLE_S), echo, delay_ms, now_ms: 0, back, out }
    }

    /// Types this as fast as the wire takes it, while everything comes back; returns what is printed until then.
    fn run(&mut self, typed: &str, until_ms: u64) -> String {
        let mut typed = VecDeque::from_iter(typed.bytes());
        let mut printed = String::new();
        while self.now_ms < until_ms {
            let is_busy = !(typed.is_empty() && self.out.is_empty() && self.back.is_empty());
            self.now_ms += if is_busy { 1 } else { ROUND_MS };
            self.desk.rest.now = Instant::from_micros(self.now_ms * 1_000);
            let mut is_polled = false;
            for _ in 0..PER_MS {
                let mut arrived = typed.pop_front();
                if arrived.is_none() && self.back.front().is_some_and(|&(at, _)| at <= self.now_ms) {
                    arrived = self.back.pop_front().map(|(_, byte)| byte);
                }
                if let Some(byte) = arrived {
                    self.desk.receive(Received::clean(byte));
                }
                // A stream's next line is made when the last is out.
                let said = if self.out.is_empty() && !is_polled {
                    let said = self.desk.step();
                    is_polled = said.is_empty();
                    said
                } else {
                    self.desk.printed()
                };
                printed += &said;
                self.out.extend(said.bytes());
                if let Some(byte) = self.out.pop_front() {
                    let at = self.now_ms + self.delay_ms;
                    self.back.extend((self.echo)(byte).into_iter().map(|byte| (at, byte)));
                }
            }
        }
        printed
    }
}

/// What is typed at the stream, and at a prompt.
const TYPED: [&str; 10] = [
    "",
    "\r",
    "\r\n\r\n",
    "nonsense\r",
    "version\r",
    "set 0 period 100\r",
    "\x03",
    "\x03help\r",
    "\x03bus t7\r",
    "\x03t7 zero 5\r",
];

fn is_statistics(line: &str) -> bool {
    ["stats", "line", "times", "bus_fault", "summary"]
        .iter()
        .any(|topic| line.starts_with(&format!("{{\"{topic}\"")))
}

#[test]
fn what_comes_back_ends_and_changes_nothing() {
    // What a stream prints in ten seconds.
    let mut quiet = Loop::new(|_| Vec::new(), 0);
    quiet.run("", 10_000);
    let alone = quiet.run("", 20_000).lines().count();
    for echo in [raw as Echo, cooked] {
        for delay_ms in DELAYS_MS {
            for typed in TYPED {
                let mut looped = Loop::new(echo, delay_ms);
                looped.run("", 2_500);
                let first = looped.run(typed, 10_000);
                let rest = looped.run("", 20_000);
                let what = || format!("{typed:?} after {delay_ms} ms\n{first}\n---\n{rest}");
                // Answers of a command and of what little was misunderstood; then what a stream prints without an echo.
                assert!(first.len() < 12_000, "{}", what());
                assert!(rest.lines().all(is_statistics), "{}", what());
                assert!(rest.lines().count() <= alone + 8, "{}", what());
                let set = usize::from(typed.starts_with("set"));
                let rest = &looped.desk.rest;
                assert_eq!((rest.orders.len(), rest.done.len()), (set, 0), "{}", what());
            }
        }
    }
}

/// The other way round: the prompt is there first, and the echo comes when a person opens the port.
#[test]
fn an_echo_at_a_prompt_that_was_left_ends_too() {
    let idle_ms = 1_000 * u64::from(IDLE_S);
    for echo in [raw as Echo, cooked] {
        for delay_ms in DELAYS_MS {
            for typed in ["", "\r", "a", "\x08", "a\x08b\x08", "nonsense\r"] {
                let mut looped = Loop::new(|_| Vec::new(), delay_ms);
                looped.run("\r", 1_000);
                looped.echo = echo;
                let first = looped.run(typed, 21 * idle_ms);
                let rest = looped.run("", 21 * idle_ms + 3_000);
                assert!(first.contains("{\"stream\":\"resumed\""), "{typed:?} {delay_ms}: {first}");
                assert!(rest.lines().count() >= 8, "{typed:?} {delay_ms}: {first}\n---\n{rest}");
                assert!(rest.lines().all(is_statistics), "{typed:?} {delay_ms}: {first}\n---\n{rest}");
                assert_eq!(looped.desk.rest.orders, []);
            }
        }
    }
}

/// When nothing comes back any more, Enter brings a prompt as ever.
#[test]
fn after_an_echo_enter_brings_a_prompt() {
    let mut looped = Loop::new(cooked, 100);
    looped.run("", 5_000);
    assert!(!looped.run("\r", 6_000).contains("clino> "));
    looped.echo = |_| Vec::new();
    looped.run("", 10_000);
    // A line that was cut short by that ends first.
    looped.run("\r", 10_100);
    assert!(looped.run("\r", 10_200).contains("clino> "));
    let counters = looped.run("counters\r", 11_000);
    let echoed = counters.split("echoed ").nth(1).expect("a count").trim_start();
    assert!(echoed.starts_with(|first: char| ('1'..='9').contains(&first)), "{counters}");
}

//! The emulated chip against its reference manual: a small firmware exercises core, clocks, timers, serial
//! ports, PWM inputs and resets, and leaves what it found in RAM.
//!
//! Needs the thumbv7em-none-eabihf target, so it does not run by itself:
//! `cargo test -p clino-board --test selftest -- --ignored`.

use clino_board::elf::Image;
use clino_board::pwm::{Cycle, Pulse};
use clino_board::wire::{Format, Received, Sent, Wire};
use clino_board::{Board, Ports};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Arc, Mutex, OnceLock};

const MS: u64 = 1_000_000;
const DONE: u32 = 0xd0e;

/// What happened on a line.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Event {
    Sent(Sent),
    Enable(u64, bool),
    Receiver(u64, Option<Format>),
}

/// A character to be heard, given from the end of the last one sent: (gap in ns, word, framing error).
type Reply = (u64, u16, bool);

/// A line that keeps a log and answers after `after` characters.
struct Scripted {
    log: Arc<Mutex<Vec<Event>>>,
    after: usize,
    replies: &'static [Reply],
    sent: usize,
    due: VecDeque<Received>,
    ready: VecDeque<Received>,
}

impl Scripted {
    fn new(after: usize, replies: &'static [Reply]) -> (Box<dyn Wire>, Arc<Mutex<Vec<Event>>>) {
        let log = Arc::new(Mutex::new(Vec::new()));
        let wire = Scripted {
            log: Arc::clone(&log),
            after,
            replies,
            sent: 0,
            due: VecDeque::new(),
            ready: VecDeque::new(),
        };
        (Box::new(wire), log)
    }
}

/// Bit times of a whole character, in halves.
fn halves(format: Format) -> u64 {
    2 + 2 * u64::from(format.data_bits) + u64::from(format.stop_halves)
}

impl Wire for Scripted {
    fn set_receiver(&mut self, now: u64, format: Option<Format>) {
        self.log.lock().unwrap().push(Event::Receiver(now, format));
    }

    fn send(&mut self, sent: Sent) {
        self.log.lock().unwrap().push(Event::Sent(sent));
        self.sent += 1;
        if self.sent != self.after {
            return;
        }
        let character = sent.format.bit_ps * halves(sent.format) / 2 / 1_000;
        let to_stop = sent.format.bit_ps * (3 + 2 * u64::from(sent.format.data_bits)) / 2 / 1_000;
        let mut at = sent.start + character;
        for (gap, word, framing_error) in self.replies {
            at += gap;
            let received =
                Received { at: at + to_stop, word: *word, framing_error: *framing_error, noise: false };
            self.due.push_back(received);
            at += character;
        }
    }

    fn drive_enable(&mut self, now: u64, high: bool) {
        self.log.lock().unwrap().push(Event::Enable(now, high));
    }

    fn next_event(&self) -> Option<u64> {
        self.due.front().map(|received| received.at)
    }

    fn advance(&mut self, now: u64) {
        while let Some(received) = self.due.pop_front_if(|received| received.at <= now) {
            self.ready.push_back(received);
        }
    }

    fn take_received(&mut self) -> Option<Received> {
        self.ready.pop_front()
    }
}

/// The self-test firmware, built once.
fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let crate_dir = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("selftest-firmware");
        let target_dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("selftest");
        let status = Command::new(env!("CARGO"))
            .current_dir(&crate_dir)
            .args(["build", "--release", "--target", "thumbv7em-none-eabihf", "--target-dir"])
            .arg(&target_dir)
            .status()
            .expect("cargo runs");
        assert!(status.success(), "the self-test firmware does not build: is the thumb target installed?");
        Image::read(&target_dir.join("thumbv7em-none-eabihf/release/board-selftest")).expect("an image")
    })
}

/// Everything one run leaves behind.
struct Run {
    board: Board,
    t7: Vec<Event>,
    isu: Vec<Event>,
    console: Vec<Event>,
    modbus: Vec<Event>,
    rtt: Vec<u8>,
}

impl Run {
    fn result(&self, slot: usize) -> u32 {
        let base = image().symbol("RESULTS").expect("the results' symbol");
        self.board.peek32(base + 4 * slot as u32).expect("RAM")
    }

    fn results(&self, first: usize, count: usize) -> Vec<u32> {
        (first..first + count).map(|slot| self.result(slot)).collect()
    }
}

/// Runs the firmware to its end, in slices of `slice` ns.
fn run(slice: u64) -> Run {
    let (t7, t7_log) = Scripted::new(3, &[(200_000, 0x11, false), (0, 0x22, true), (5_000, 0x33, false)]);
    let (isu, isu_log) = Scripted::new(1, &[(100_000, 0xa1, false), (0, 0xa2, false), (0, 0xa3, false)]);
    let (console, console_log) = Scripted::new(usize::MAX, &[]);
    // 8E1: the ninth bit is the parity bit. 0x07 has three ones: parity bit 1.
    let (modbus, modbus_log) =
        Scripted::new(1, &[(100_000, 0x107, false), (0, 0x007, false), (0, 0x003, true)]);
    let mut turn = 0;
    let pwm1 = move |_| {
        turn += 1;
        Cycle::Pulse { period: 100_000 + 1_237 * (turn % 3), high: 1_000 + 6_001 * (turn % 7) }
    };
    let pwm2 = |_| Cycle::Pulse { period: 33_333_333 / 100, high: 9_999 };
    let ports = Ports { t7, isu, console, modbus, pwm: [Box::new(pwm1), Box::new(pwm2)] };
    let mut board = Board::new(image(), ports).expect("a board");
    let mut rtt = Vec::new();
    let stage = image().symbol("RESULTS").expect("the results' symbol");
    while board.peek32(stage) != Some(DONE) {
        let until = board.now() / slice * slice + 2 * slice;
        if let Err(stopped) = board.run_until(until) {
            panic!("{stopped}");
        }
        rtt.extend(board.take_rtt());
        assert!(board.now() < 3_000 * MS, "stage {:?}, pc {:#x}", board.peek32(stage), board.pc());
    }
    let read = |log: &Arc<Mutex<Vec<Event>>>| log.lock().unwrap().clone();
    let (t7, isu) = (read(&t7_log), read(&isu_log));
    Run { board, t7, isu, console: read(&console_log), modbus: read(&modbus_log), rtt }
}

#[test]
#[ignore]
fn explore() {
    let from = std::time::Instant::now();
    let run = run(MS);
    println!("{:?} virtual {} {:?}", from.elapsed(), run.board.now(), run.board.stats());
    for i in 0..64 {
        println!("{i}: {0} {0:#x}", run.result(i));
    }
    println!("{:#?}\n{:#?}\n{:#?}\n{:#?}", run.t7, run.isu, run.console, run.modbus);
    println!("rtt {} {:?}", run.rtt.len(), &run.board.pwm_log(0)[..4]);
}

//! The emulated chip against its reference manual: a small firmware exercises core, clocks, timers, serial
//! ports, PWM inputs and resets, and leaves what it found in RAM.
//!
//! Needs the thumbv7em-none-eabihf target, so it is not part of the default run:
//! `cargo test -p clino-board --test selftest -- --ignored`.

mod reset_values;
#[cfg(target_os = "linux")]
mod served;
mod trials;

use clino_board::elf::Image;
use clino_board::modbus::{Answer, Framing, ModbusLine};
use clino_board::pwm::{Cycle, Pulse};
use clino_board::{Board, BoardModel, Ports};
use clino_segment::wire::{Format, Received, Sent, Wire};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
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
    fn answering(after: usize, replies: &'static [Reply]) -> (Box<dyn Wire>, Log) {
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
        if !self.sent.is_multiple_of(self.after) {
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
        while self.due.front().is_some_and(|received| received.at <= now) {
            self.ready.extend(self.due.pop_front());
        }
    }

    fn take_received(&mut self) -> Option<Received> {
        self.ready.pop_front()
    }
}

/// The self-test firmware, read once.
fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| Image::read(&elf(), BoardModel::default()).expect("an image"))
}

/// Where its image is.
fn elf() -> PathBuf {
    built().join("board-selftest")
}

/// Where the images are, built once.
fn built() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let crate_dir = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("selftest-firmware");
        // The workspace's own, `CARGO_TARGET_TMPDIR` is below it: what other firmware has built there is not built again.
        let target_dir = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a folder");
        let status = Command::new(env!("CARGO"))
            .current_dir(&crate_dir)
            .args(["build", "--release", "--target", "thumbv7em-none-eabihf", "--target-dir"])
            .arg(target_dir)
            .status()
            .expect("cargo runs");
        assert!(status.success(), "the self-test firmware does not build: is the thumb target installed?");
        target_dir.join("thumbv7em-none-eabihf/release")
    })
}

/// Everything one run leaves behind.
#[derive(Debug, PartialEq, Eq)]
struct Findings {
    results: Vec<u32>,
    t7: Vec<Event>,
    isu: Vec<Event>,
    console: Vec<Event>,
    modbus: Vec<Event>,
    pwm: [Vec<Pulse>; 2],
    rtt: Vec<u8>,
}

type Log = Arc<Mutex<Vec<Event>>>;

/// What the firmware wants on its pins, and the logs of the T7, ISU, console and Modbus lines.
fn ports() -> (Ports, [Log; 4]) {
    let (t7, t7_log) =
        Scripted::answering(3, &[(200_000, 0x11, false), (0, 0x22, true), (5_000, 0x33, false)]);
    let (isu, isu_log) =
        Scripted::answering(1, &[(100_000, 0xa1, false), (0, 0xa2, false), (0, 0xa3, false)]);
    let (console, console_log) = Scripted::answering(usize::MAX, &[]);
    // 8E1: the ninth bit makes the number of ones even. 0x007 lacks it; 0x003 has a low stop bit.
    let (modbus, modbus_log) =
        Scripted::answering(1, &[(100_000, 0x107, false), (0, 0x007, false), (0, 0x003, true)]);
    let mut turn = 0;
    let pwm1 = move |_| {
        turn += 1;
        Cycle::Pulse { period: 100_000 + 1_237 * (turn % 3), high: 1_000 + 6_001 * (turn % 7) }
    };
    let pwm2 = |_| Cycle::Pulse { period: 333_333, high: 9_999 };
    let ports = Ports { t7, isu, console, modbus, pwm: [Box::new(pwm1), Box::new(pwm2)] };
    (ports, [t7_log, isu_log, console_log, modbus_log])
}

/// Runs the firmware for 400 ms, which is to its end and beyond, in slices of `slice` ns.
fn run(slice: u64) -> Findings {
    const END: u64 = 400 * MS;
    let (ports, [t7, isu, console, modbus]) = ports();
    let mut board = Board::new(image(), ports).expect("a board");
    let mut rtt = Vec::new();
    let mut until = 0;
    while until < END {
        until = (until + slice).min(END);
        if let Err(stopped) = board.run_until(until) {
            panic!("{stopped}");
        }
        rtt.extend(board.take_rtt());
    }
    let base = image().symbol("RESULTS").expect("the results' symbol");
    let read = |log: Log| log.lock().unwrap().clone();
    Findings {
        results: (0..68).map(|slot| board.peek32(base + 4 * slot).expect("RAM")).collect(),
        t7: read(t7),
        isu: read(isu),
        console: read(console),
        modbus: read(modbus),
        pwm: [board.pwm_log(0), board.pwm_log(1)],
        rtt,
    }
}

/// One run that most tests share.
fn findings() -> &'static Findings {
    static FINDINGS: OnceLock<Findings> = OnceLock::new();
    FINDINGS.get_or_init(|| run(MS))
}

fn result(slot: usize) -> u32 {
    findings().results[slot]
}

/// The characters among `events`.
fn sent(events: &[Event]) -> Vec<Sent> {
    let character = |event: &Event| if let Event::Sent(sent) = event { Some(*sent) } else { None };
    events.iter().filter_map(character).collect()
}

/// End of the last stop bit, rounded up to a nanosecond.
fn end(sent: Sent) -> u64 {
    sent.start + (sent.format.bit_ps * halves(sent.format)).div_ceil(2_000)
}

#[test]
#[ignore = "needs the thumb target"]
fn the_firmware_gets_to_its_end() {
    assert_eq!(result(0), DONE);
}

#[test]
#[ignore = "needs the thumb target"]
fn clocks_follow_the_clock_tree() {
    assert_eq!(findings().results[1..4], [168_000_000, 42_000_000, 84_000_000]);
    // 1000 ticks of TIM4 at 1 MHz are 168 000 core cycles, give or take the polling loop.
    assert!((167_960..=168_040).contains(&result(4)), "{}", result(4));
}

#[test]
#[ignore = "needs the thumb target"]
fn compare_and_update_interrupts_come_on_the_cycle() {
    let (compares, latest, earliest, updates) = (result(5), result(6), result(7), result(8));
    // Two wraps of 65 536 µs with a compare every 137 µs, each armed a little after the last.
    assert_eq!(updates, 2);
    assert!((930..=957).contains(&compares), "{compares}");
    // Compare to the first look at the counter: entry and prologue, some 50 cycles, with a spread of one
    // instruction of the interrupted loop.
    assert!(latest < 80 && latest - earliest < 12, "{earliest}..{latest} cycles");
}

#[test]
#[ignore = "needs the thumb target"]
fn pended_interrupts_nest_by_priority() {
    // TIM4 pends EXTI0 (lower), which runs after it and is preempted by TIM2 (higher) pended in its middle.
    assert_eq!(result(9), 0x12354);
}

#[test]
#[ignore = "needs the thumb target"]
fn a_masked_interrupt_ends_sleep_and_is_taken_later() {
    let (woke_at, woke_for, ran, slept) = (result(10), result(11), result(12), result(13));
    assert_eq!(woke_at, woke_for);
    assert_eq!(ran, 1, "the handler runs once, after the critical section");
    assert!((83_000..84_200).contains(&slept), "{slept} cycles of sleep are not 500 µs");
}

#[test]
#[ignore = "needs the thumb target"]
fn an_interrupted_it_block_goes_on_where_it_was() {
    let (executed, stack, interrupts) = (result(20), result(21), result(22));
    // 20 000 turns of some 12 cycles are 1.4 ms, with an interrupt every 7 µs.
    assert!(interrupts > 150, "{interrupts}");
    assert_eq!((executed, stack), (0, 0));
}

#[test]
#[ignore = "needs the thumb target"]
fn a_transmitter_sends_an_idle_character_first_and_chains_without_a_gap() {
    let characters = sent(&findings().console);
    assert_eq!(characters.iter().map(|sent| sent.word).collect::<Vec<_>>(), b"ok\n".map(u16::from));
    // 42 MHz / 115200 truncates to 364 clocks per bit.
    let bit_ps = 364_000_000 / 42;
    assert!(characters.iter().all(|sent| sent.format.bit_ps.abs_diff(bit_ps) <= 1));
    let Some(Event::Receiver(enabled, Some(_))) = findings().console.first() else { panic!("not enabled") };
    assert_eq!(characters[0].start.abs_diff(enabled + bit_ps / 100), 0);
    assert!(characters[1].start.abs_diff(end(characters[0])) <= 1);
    assert!(characters[2].start.abs_diff(end(characters[1])) <= 1);
    // TXE and TC clear while two characters are under way, both set at the end.
    assert_eq!(result(14), 0x0000_00c0);
}

#[test]
#[ignore = "needs the thumb target"]
fn drive_enable_frames_what_interrupts_send() {
    let events: Vec<_> = findings().t7.iter().filter(|e| !matches!(e, Event::Receiver(..))).collect();
    let [Event::Enable(up, true), .., Event::Enable(down, false)] = events[..] else {
        panic!("DE does not frame the characters: {events:?}")
    };
    let characters = sent(&findings().t7);
    assert_eq!(characters.iter().map(|sent| sent.word).collect::<Vec<_>>(), [0x41, 0x42, 0x43]);
    let lead = characters[0].start - up;
    assert!(lead < 8_681, "{lead} ns from DE to the start bit");
    let tail = down.checked_sub(end(characters[2])).expect("DE falls after the last stop bit");
    assert!(tail < 1_000, "{tail} ns from the last stop bit to DE low");
}

#[test]
#[ignore = "needs the thumb target"]
fn received_characters_carry_their_flags() {
    const RXNE: u32 = 0x20 << 16;
    const PE: u32 = 0x01 << 16;
    const FE: u32 = 0x02 << 16;
    const ORE: u32 = 0x08 << 16;
    assert_eq!(findings().results[16..20], [3, RXNE | 0x11, RXNE | FE | 0x22, RXNE | 0x33]);
    // The first was not read: the other two are lost, and only the overrun flag reports them.
    assert_eq!(findings().results[24..27], [1, RXNE | ORE | 0xa1, 0]);
    assert_eq!(findings().results[28..32], [3, RXNE | 0x107, RXNE | PE | 0x007, RXNE | FE | 0x003]);
    // Even parity goes out too.
    assert_eq!(sent(&findings().modbus)[0].word, 0x107);
}

#[test]
#[ignore = "needs the thumb target"]
fn pwm_inputs_capture_every_edge_to_the_tick() {
    for (channel, first) in [(0, 32), (1, 48)] {
        let captured: Vec<_> =
            findings().results[first..first + 16].chunks(2).map(|pair| (pair[0], pair[1])).collect();
        let log = &findings().pwm[channel];
        // 84 MHz: an edge falls into a tick of 11.9 ns, so a length may be one tick short of its ceiling.
        let fits = |ticks: u32, ns: u64| (u64::from(ticks) * 1_000).abs_diff(ns * 84) < 1_000;
        let matches = |pulses: &[Pulse]| {
            pulses.iter().zip(&captured).all(|(pulse, (period, high))| {
                fits(*period, pulse.next_rising - pulse.rising) && fits(*high, pulse.falling - pulse.rising)
            })
        };
        let found = log.windows(captured.len()).filter(|pulses| matches(pulses)).count();
        assert!(found >= 1, "channel {channel}: {captured:?} is nowhere in the log");
    }
}

#[test]
#[ignore = "needs the thumb target"]
fn a_pin_reads_its_level_while_a_timer_has_it() {
    // Both levels of both channels.
    assert_eq!(result(67), 0b1111);
}

#[test]
#[ignore = "needs the thumb target"]
fn resets_leave_their_cause() {
    // RCC_CSR from bit 25 on: power-on, pin and brown-out; software and pin; watchdog and pin.
    assert_eq!(findings().results[64..67], [0b000_0111, 0b000_1010, 0b001_0010]);
}

#[test]
#[ignore = "needs the thumb target"]
fn the_log_channel_loses_nothing() {
    // 200 frames, each ended by a zero byte and one more at the start, through a ring of 1 KiB.
    let ends = findings().rtt.iter().filter(|byte| **byte == 0).count();
    assert_eq!(ends, 201);
    assert!(findings().rtt.len() > 1_024);
}

#[test]
#[ignore = "needs the thumb target"]
fn the_same_run_in_other_slices_is_the_same_run() {
    assert_eq!(run(7_777_777), *findings());
}

#[test]
#[ignore = "needs the thumb target"]
fn a_modbus_master_gets_its_answer_with_parity_behind_de() {
    // 8E1 at 19200: 11 bits of 52.083 µs.
    const CHARACTER: u64 = 572_917;
    const REQUEST: [u8; 8] = [0x01, 0x04, 0x00, 0x00, 0x00, 0x02, 0x71, 0xcb];
    const AT: u64 = 450 * MS;
    let line = ModbusLine::new("master", Framing::default());
    let master = line.master();
    let mut board = Board::new(image(), Ports { modbus: Box::new(line), ..ports().0 }).expect("a board");
    board.run_until(AT - 10 * MS).unwrap();
    assert_eq!(board.peek32(image().symbol("RESULTS").expect("the results' symbol")), Some(DONE));
    // What the earlier stages said.
    master.lock().take_answers();
    master.lock().send(AT, &REQUEST);
    board.run_until(AT + 50 * MS).unwrap();
    let answers = master.lock().take_answers();
    let [Answer { began, ended, bytes, spoilt, de_high: Some(high), de_low: Some(low) }] = &answers[..]
    else {
        panic!("no answer behind DE: {answers:?}")
    };
    assert_eq!((&bytes[..], *spoilt), (&REQUEST[..], 0));
    // The line is idle one character after the last stop bit; the flag comes up to one more later.
    let idle = AT + 9 * CHARACTER;
    assert!((idle..idle + CHARACTER + 20_000).contains(began), "{began} after {idle}");
    assert!((ended - began).abs_diff(8 * CHARACTER) < 10_000, "{began}..{ended}");
    assert!((high..=&(high + 52_083)).contains(&began), "DE at {high}, start bit at {began}");
    assert!(low + 1_000 >= *ended && low - ended.min(low) < 5_000, "stop bit at {ended}, DE at {low}");
}

//! What a start reports of the previous run, for every way a run can end.

use clino_recovery::{
    Clock, Crash, FAST_MS, FaultStatus, Journal, Mode, MonitoredTask, Registers, ResetSource, Start,
    StartCause, Uptime, WORDS,
};
use proptest::prelude::*;

/// A board: what its memory holds.
struct Board {
    memory: [u32; WORDS],
}

impl Board {
    fn new() -> Board {
        Board { memory: [0xA5A5_A5A5; WORDS] }
    }

    fn start(&mut self, reset: ResetSource) -> Start {
        self.start_after(reset, None)
    }

    fn start_after(&mut self, reset: ResetSource, uptime_ms: Option<u32>) -> Start {
        let (journal, start) = Journal::begin(Journal::from_words(&self.memory), reset, uptime_ms);
        self.memory = journal.to_words();
        start
    }

    fn change(&mut self, change: impl FnOnce(&mut Journal)) {
        let mut journal = Journal::from_words(&self.memory).expect("a board that has started has a journal");
        change(&mut journal);
        self.memory = journal.to_words();
    }

    /// Crashes after so long, and starts again.
    fn crash(&mut self, crash: Crash, uptime_ms: u32) -> Start {
        Journal::note(&mut self.memory, &crash, uptime_ms);
        self.start(ResetSource::Software)
    }
}

const REGISTERS: Registers = Registers { pc: 0x0801_2345, lr: 0x0801_0001, sp: 0x1000_1F00, exception: 22 };

#[test]
fn the_first_start_is_the_first() {
    let mut board = Board::new();
    let start = board.start(ResetSource::PowerOn);
    assert_eq!(start, Start { cause: StartCause::PowerOn, boots: 1, ..Start::default() });
    // Power comes again: what the memory holds by chance is nothing.
    assert_eq!(board.start(ResetSource::PowerOn).boots, 1);
}

#[test]
fn a_memory_that_was_written_over_is_no_journal_and_no_start_fails_for_it() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    board.crash(Crash::panic("src/bus.rs", 117), 40_000);
    for word in 0..WORDS {
        for bit in 0..32 {
            let mut spoilt = Board { memory: board.memory };
            spoilt.memory[word] ^= 1 << bit;
            assert_eq!(Journal::from_words(&spoilt.memory), None, "word {word}, bit {bit}");
            let start = spoilt.start(ResetSource::Software);
            assert_eq!((start.cause, start.boots, start.crash), (StartCause::Software, 1, None));
        }
    }
}

#[test]
fn what_is_known_of_a_crash_is_told_by_the_next_start_and_the_ones_after() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    board.start(ResetSource::Pin);
    let start = board.crash(Crash::stalled(MonitoredTask::T7Bus, REGISTERS), 31_000);
    assert_eq!((start.cause, start.boots, start.crashes), (StartCause::Stalled, 3, 1));
    let crash = start.crash.expect("it is reported");
    assert_eq!((crash.boot, crash.uptime_ms, crash.registers), (2, 31_000, Some(REGISTERS)));
    assert_eq!((crash.task(), crash.line()), (Some(MonitoredTask::T7Bus), None));
    let later = board.start(ResetSource::Software);
    assert_eq!((later.cause, later.boots, later.crash), (StartCause::Software, 4, Some(crash)));
}

#[test]
fn a_panic_keeps_the_end_of_its_files_name() {
    let crash = Crash::panic("crates/gateway/src/agenda.rs", 42);
    assert_eq!((crash.file(), crash.line()), (Some("ay/src/agenda.rs"), Some(42)));
    assert_eq!(Crash::panic("a.rs", 1).file(), Some("a.rs"));
    assert_eq!(Crash::panic("", 1).file(), None);
}

#[test]
fn faults_are_told_apart_by_the_status_registers() {
    // Bits as in the ARMv7-M Architecture Reference Manual, B3.2.15.
    for (cfsr, cause, address) in [
        (0x0000_0001, StartCause::MemoryFault, 0),
        (0x0000_0082, StartCause::MemoryFault, 0x11),
        (0x0000_8200, StartCause::BusFault, 0x22),
        (0x0000_0400, StartCause::BusFault, 0),
        (0x0001_0000, StartCause::UsageFault, 0),
        (0x0200_0000, StartCause::UsageFault, 0),
        (0x0000_1000, StartCause::StackOverflow, 0),
        (0x0000_0010, StartCause::StackOverflow, 0),
        (0, StartCause::HardFault, 0),
    ] {
        let fault = FaultStatus::new(cfsr, 0x4000_0000, 0x11, 0x22);
        assert_eq!((fault.cause(false), fault.address), (cause, address), "{cfsr:#010x}");
    }
    let anywhere = FaultStatus::new(0x0000_0400, 0, 0, 0);
    assert_eq!(anywhere.cause(true), StartCause::StackOverflow, "the stack pointer says so");
}

#[test]
fn a_watchdog_reset_without_a_known_cause_is_a_crash() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    let start = board.start_after(ResetSource::Watchdog, Some(77_000));
    let crash = start.crash.expect("it is reported");
    assert_eq!((start.cause, start.crashes), (StartCause::Watchdog, 1));
    assert_eq!((crash.boot, crash.uptime_ms, crash.registers), (1, 77_000, None));
}

#[test]
fn of_two_crashes_in_one_start_the_first_is_kept() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    Journal::note(&mut board.memory, &Crash::panic("a.rs", 1), 5);
    let start = board.crash(Crash::panic("b.rs", 2), 6);
    assert_eq!(start.crash.and_then(|crash| crash.line()), Some(1));
}

#[test]
fn three_fast_crashes_in_a_row_lead_to_safe_mode_and_six_to_nothing_stored() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    let modes: Vec<Mode> = (0..8).map(|_| board.crash(Crash::panic("a.rs", 1), FAST_MS - 1).mode).collect();
    let expected =
        [Mode::Normal, Mode::Normal, Mode::Safe, Mode::Safe, Mode::Safe, Mode::Bare, Mode::Bare, Mode::Bare];
    assert_eq!(modes, expected);
    // A requested restart, or power off and on.
    assert_eq!(board.start(ResetSource::Software).mode, Mode::Normal);
}

#[test]
fn a_slow_crash_ends_the_row() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    for _ in 0..2 {
        board.crash(Crash::panic("a.rs", 1), 10);
    }
    assert_eq!(board.crash(Crash::panic("a.rs", 1), FAST_MS).mode, Mode::Normal);
    for _ in 0..2 {
        assert_eq!(board.crash(Crash::panic("a.rs", 1), 10).mode, Mode::Normal);
    }
    assert_eq!(board.crash(Crash::panic("a.rs", 1), 10).mode, Mode::Safe);
}

#[test]
fn safe_mode_ends_by_itself_and_one_more_fast_crash_brings_it_back() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    for _ in 0..3 {
        board.start_after(ResetSource::Watchdog, Some(100));
    }
    board.change(Journal::retry);
    let start = board.start(ResetSource::Software);
    assert_eq!((start.mode, start.cause), (Mode::Normal, StartCause::Software));
    assert_eq!(board.crash(Crash::panic("a.rs", 1), 10).mode, Mode::Safe);
    board.change(Journal::retry);
    board.start(ResetSource::Software);
    assert_eq!(board.crash(Crash::panic("a.rs", 1), FAST_MS).mode, Mode::Normal);
}

#[test]
fn a_crystal_that_has_stopped_is_not_trusted_until_a_requested_restart() {
    let mut board = Board::new();
    board.start(ResetSource::PowerOn);
    let start = board.crash(Crash::clock_failed(None), 100);
    assert_eq!(
        (start.clock, start.mode, start.cause),
        (Clock::Fallback, Mode::Normal, StartCause::ClockFailed)
    );
    assert_eq!(board.crash(Crash::panic("a.rs", 1), FAST_MS).clock, Clock::Fallback);
    assert_eq!(board.start_after(ResetSource::Watchdog, None).clock, Clock::Fallback);
    assert_eq!(board.start(ResetSource::Software).clock, Clock::Crystal);
}

#[test]
fn an_uptime_that_does_not_fit_its_copy_is_none() {
    assert_eq!(Uptime::from_words(Uptime(1_234).to_words()), Some(Uptime(1_234)));
    assert_eq!(Uptime::from_words([1_234, !1_235]), None);
}

proptest! {
    #[test]
    fn every_journal_is_read_as_it_was_written(
        file in "[a-z/]{0,30}\\.rs", line: u32, cfsr: u32, hfsr: u32, address: u32,
        pc: u32, lr: u32, sp: u32, exception in 0u16..512, uptime: u32, kind in 0..4,
    ) {
        let registers = Registers { pc, lr, sp, exception };
        let crash = match kind {
            0 => Crash::panic(&file, line),
            1 => Crash::fault(FaultStatus::new(cfsr, hfsr, address, address), Some(registers), false),
            2 => Crash::stalled(MonitoredTask::Storage, registers),
            _ => Crash::clock_failed(None),
        };
        let mut board = Board::new();
        board.start(ResetSource::PowerOn);
        Journal::note(&mut board.memory, &crash, uptime);
        let told = board.start(ResetSource::Software).crash;
        prop_assert_eq!(told, Some(Crash { boot: 1, uptime_ms: uptime, ..crash }));
    }

    #[test]
    fn no_memory_makes_a_start_fail(words: [u32; WORDS], uptime: Option<u32>) {
        let (journal, start) = Journal::begin(Journal::from_words(&words), ResetSource::BrownOut, uptime);
        prop_assert_eq!(start.boots, 1);
        prop_assert_eq!(Journal::from_words(&journal.to_words()), Some(journal));
    }
}

proptest! {
    #[test]
    fn the_first_crash_of_a_start_is_told_whatever_the_memory_holds(
        spoilt in any::<Option<u8>>(),
        boots in 0_u32..4,
        before in any::<Option<u32>>(),
        line in any::<u32>(),
        uptime_ms in any::<u32>(),
    ) {
        let mut board = Board::new();
        (0..boots).for_each(|_| _ = board.start(ResetSource::Pin));
        let first = Crash::stalled(MonitoredTask::Modbus, Registers { pc: 2, lr: 3, sp: 4, exception: 17 });
        if let Some(uptime_ms) = before {
            Journal::note(&mut board.memory, &first, uptime_ms);
        }
        if let Some(word) = spoilt {
            board.memory[usize::from(word) % WORDS] ^= 0x0001_0000;
        }
        let second = Crash::panic("src/uart.rs", line);
        Journal::note(&mut board.memory, &second, uptime_ms);
        // What was there counts if it was a journal: if anything was noted in it, and nothing has spoilt it since.
        let boot = if spoilt.is_none() { boots } else { 0 };
        let (crash, uptime_ms) = match before.filter(|_| spoilt.is_none()) {
            Some(before) => (first, before),
            None => (second, uptime_ms),
        };
        let start = board.start(ResetSource::Software);
        prop_assert_eq!(start.crash, Some(Crash { boot, uptime_ms, ..crash }));
        prop_assert_eq!(start.boots, boot + 1);
    }
}

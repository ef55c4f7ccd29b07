//! Small programs on the board: time, and the report of a fault.

use super::*;
use crate::ports::Ports;

const STACK: u32 = 0x2000_1000;
const RESET: u32 = 0x0800_0011;
const HARD_FAULT: u32 = 0x0800_001d;
const B_SELF: u32 = 0xe7fe;
const UDF: u32 = 0xde00;
const MS: Ns = 1_000_000;

/// A board with a program of four vectors, three words at the reset vector and a word for HardFault.
fn board(program: [u32; 3], hard_fault: u32) -> Board {
    let [a, b, c] = program;
    Board::new(&Image::of_words(&[STACK, RESET, 0, HARD_FAULT, a, b, c, hard_fault]), Ports::open()).unwrap()
}

#[test]
fn an_idle_program_runs_on() {
    let mut board = board([B_SELF, 0, 0], B_SELF);
    board.run_until(3 * MS).unwrap();
    assert_eq!(board.pc(), RESET - 1);
    // 16 MHz from the internal oscillator: 48 000 cycles.
    assert_eq!(board.stats().awake_cycles / 100, 480);
    assert!(board.now().abs_diff(3 * MS) < 1_000, "{}", board.now());
}

#[test]
fn a_fault_is_reported_with_the_place_it_happened_at() {
    let mut board = board([UDF, 0, 0], B_SELF);
    let Err(Stopped::Faulted { at, fault, frame }) = board.run_until(100 * MS) else { panic!("not noticed") };
    assert!(at <= 2 * MS, "{at}");
    assert_eq!((fault.exception, fault.lockup), (3, false));
    assert_eq!(frame[6], Some(RESET - 1));
}

#[test]
fn an_access_to_nothing_tells_its_address() {
    // ldr r0, [pc, #4]; ldr r0, [r0]; the literal is an address of the FSMC, which is not there.
    let mut board = board([0x6800_4801, 0, 0xa000_0000], B_SELF);
    let Err(Stopped::Faulted { fault, .. }) = board.run_until(100 * MS) else { panic!("not noticed") };
    assert_eq!(fault.bfar, 0xa000_0000);
}

#[test]
fn a_fault_within_the_handler_is_a_lockup() {
    let mut board = board([UDF, 0, 0], UDF);
    let Err(Stopped::Faulted { fault, .. }) = board.run_until(100 * MS) else { panic!("not noticed") };
    assert!(fault.lockup);
}

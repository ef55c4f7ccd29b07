//! Small programs with an injected fault, and the reaction of the core.

use super::*;
use crate::elf::Image;
use crate::incident::{Event, ResetCause};
use crate::{Board, Fault, Ports, Stopped};

const MS: Ns = 1_000_000;
const STACK: u32 = 0x2000_1000;
/// RAM below this address does not exist.
const RAM: u32 = 0x2000_0000;

/// The vectors, then the program at `CODE`, then the ingredients of all faults.
const CODE: u32 = 0x0800_0200;
/// `wfe`-less idling that is no branch to itself: `nop; b` to it.
const IDLE: u32 = 0xe7fd_bf00;
/// `b` to itself, `udf 0`.
const B_SELF: u16 = 0xe7fe;
const UDF: u16 = 0xde00;
/// `push {r4, lr}`, `ldr r2, [r1]`.
const PUSH: u16 = 0xb510;
const LOAD: u16 = 0x680a;

/// `program` at `CODE`; the handlers of NMI and HardFault are `handler`, right after it.
fn image(stack: u32, program: &[u32], handler: u16) -> Image {
    let mut words = vec![0; 128];
    let after = CODE + 4 * program.len() as u32;
    words[0] = stack;
    words[1] = CODE | 1;
    words[3] = after | 1;
    words[11] = (after + 4) | 1;
    words.extend(program);
    words.push(u32::from(handler) | u32::from(B_SELF) << 16);
    // The handler of SVCall, which is not to be reached by accident: at another address than HardFault's.
    words.push(u32::from(B_SELF) | u32::from(UDF) << 16);
    words.push(u32::from(PUSH) | u32::from(LOAD) << 16);
    Image::of_words(&words).with_symbol("_stack_end", RAM)
}

fn board(image: &Image) -> Board {
    Board::new(image, Ports::open()).unwrap()
}

/// Plants `what` into an idle program after 5 ms; the fault that the core is in at the end, if any.
fn planted(what: What) -> (Board, Option<Fault>) {
    let image = image(STACK, &[IDLE], B_SELF);
    let mut board = board(&image);
    let injection = Injection { at: 5 * MS, what, level: Level::Main, times: 1, again: 0 };
    board.inject(injection, &image).unwrap();
    let fault = match board.run_until(20 * MS) {
        Ok(()) => None,
        Err(Stopped::Faulted { fault, .. }) => Some(fault),
        Err(other) => panic!("{other}"),
    };
    let [incident, ..] = board.incidents()[..] else { panic!("nothing was planted") };
    let Event::Planted { what: done, level: Level::Main, pc, .. } = incident.event else {
        panic!("{incident}")
    };
    assert_eq!(done, what);
    assert!((5 * MS..5 * MS + 1_000).contains(&incident.at), "{incident}");
    assert!((CODE..CODE + 4).contains(&pc), "{incident}");
    (board, fault)
}

#[test]
fn a_level_that_hangs_stays_where_it_is() {
    for what in [What::Hang, What::MaskedHang] {
        let (board, fault) = planted(what);
        assert_eq!((fault, board.pc()), (None, CODE + 4), "{what}");
        // Time is not lost: 20 ms at 16 MHz.
        assert!(board.stats().awake_cycles.abs_diff(320_000) < 16, "{what}");
    }
}

#[test]
fn faults_leave_the_status_that_the_architecture_names() {
    const FORCED: u32 = 1 << 30;
    // CFSR: IBUSERR; PRECISERR and BFARVALID; UNDEFINSTR.
    for (what, cfsr) in [(What::BusFault, 0x100), (What::DataFault, 0x8200), (What::UsageFault, 0x1_0000)] {
        let fault = planted(what).1.expect("a fault");
        assert_eq!((fault.exception, fault.lockup), (3, false), "{what}");
        assert_eq!((fault.cfsr, fault.hfsr), (cfsr, FORCED), "{what}");
        assert!(what != What::DataFault || fault.bfar == 0x0a00_0000);
    }
}

#[test]
fn a_full_stack_takes_neither_a_push_nor_the_frame_of_the_fault() {
    let fault = planted(What::StackOverflow).1.expect("a fault");
    // PRECISERR with its address for the push, STKERR for the frame of HardFault, which runs all the same.
    assert_eq!((fault.exception, fault.lockup, fault.cfsr), (3, false, 0x9200));
    assert!((RAM - 8..RAM).contains(&fault.bfar), "{:#x}", fault.bfar);
}

#[test]
fn a_bit_turns_and_the_program_goes_on() {
    let (board, fault) = planted(What::Flip { address: RAM + 0x102, bit: 7 });
    assert_eq!((fault, board.peek32(RAM + 0x100)), (None, Some(0x0080_0000)));
    assert!((CODE..CODE + 4).contains(&board.pc()));
}

#[test]
fn what_an_image_does_not_contain_cannot_be_planted() {
    let image = image(STACK, &[IDLE], B_SELF);
    let injection = Injection { at: 0, what: What::Panic, level: Level::Main, times: 1, again: 0 };
    let refused = board(&image).inject(injection, &image).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "panic cannot be planted: the image does not contain a panic function of core"
    );
}

#[test]
fn an_exception_whose_frame_cannot_be_stacked_is_a_hard_fault() {
    // svc 0, with the stack pointer at the lower end of RAM.
    let image = image(RAM, &[0xbf00_df00, IDLE], B_SELF);
    let mut board = board(&image);
    let Err(Stopped::Faulted { fault, .. }) = board.run_until(10 * MS) else { panic!("no fault") };
    assert_eq!((fault.exception, fault.lockup, fault.cfsr), (3, false, 0x1000));
    assert_eq!(board.pc(), CODE + 8);
}

/// Starts the watchdog with its reset values: 4 · 4096 periods of the low-speed oscillator. Then an undefined instruction.
const WATCHED: [u32; 5] = [
    0x4903_4802, // ldr r0, [pc, #8]; ldr r1, [pc, #12]
    0xde00_6001, // str r1, [r0]; udf 0
    0,
    0x4000_3000,
    0x0000_cccc,
];

#[test]
fn a_locked_up_core_waits_for_the_watchdog() {
    let mut board = board(&image(STACK, &WATCHED, UDF));
    board.run_until(700 * MS).unwrap();
    let [lockup, reset, again] = board.incidents()[..] else { panic!("{:?}", board.incidents()) };
    assert_eq!((lockup.event, reset.event), (Event::Lockup, Event::Reset(ResetCause::Watchdog)));
    assert!(lockup.at < 10_000, "{lockup}");
    // 16 384 periods of 32 kHz.
    assert!(reset.at.abs_diff(512 * MS) < MS, "{reset}");
    assert!(again.event == Event::Lockup && again.at - reset.at < 10_000, "{again}");
}

#[test]
fn a_fault_is_planted_again_after_the_reset_that_it_brought() {
    let [begin, _, _, registers, key] = WATCHED;
    // str r1, [r0]; nop
    let program = [begin, 0xbf00_6001, IDLE, registers, key];
    let image = image(STACK, &program, B_SELF);
    let mut board = board(&image);
    let injection =
        Injection { at: 5 * MS, what: What::MaskedHang, level: Level::Main, times: 2, again: 20 * MS };
    board.inject(injection, &image).unwrap();
    board.run_until(1_700 * MS).unwrap();
    let [first, reset, second, _, third] = board.incidents()[..] else { panic!("{:?}", board.incidents()) };
    assert!(first.at.abs_diff(5 * MS) < 1_000 && second.at.abs_diff(reset.at + 20 * MS) < 1_000);
    // Twice is enough: the third reset is the watchdog's own, which is not fed.
    assert_eq!(third.event, Event::Reset(ResetCause::Watchdog));
}

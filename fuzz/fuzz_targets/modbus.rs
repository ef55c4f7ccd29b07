//! Any characters and silences on the Modbus port: an answer to every whole request for us, to nothing else, never to a
//! broadcast, nor to what may be an echo more than once; every answer has a right checksum.
//!
//! Input: pieces of traffic. Each begins with its kind: single characters, with the silence before each and what the
//! receiver says of it, or a frame with a right checksum.
#![no_main]

#[path = "../../crates/modbus/tests/common/mod.rs"]
mod common;

use clino_bus::Instant;
use clino_codec::character::LineErrors;
use clino_gateway::Bus;
use clino_modbus::binding::Binding;
use common::board::Board;
use common::traffic::{
    BETWEEN, BROKEN, CHARACTER, Heard, WITHIN, check, frames, is_for_us, may_be_echo, play,
};
use common::{ADDRESS, Bench, SETTINGS, sealed};
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;

/// To everybody.
const BROADCAST: u8 = 0;

fuzz_target!(|input: &[u8]| {
    let mut input = Unstructured::new(input);
    let mut traffic = Vec::new();
    while !input.is_empty() && piece(&mut traffic, &mut input).is_ok() {}
    let board = Board::new();
    let mut bench = Bench::at(Binding::new(&board), SETTINGS, CHARACTER, BETWEEN);
    let frames = frames(&traffic);
    for (index, frame) in frames.iter().enumerate() {
        let answers = play(frame, &mut bench);
        let asked = usize::from(is_for_us(frame, SETTINGS.pauses));
        let echo = may_be_echo(frame, &frames[..index]);
        assert!(answers.len() == asked || echo && answers.is_empty(), "{frame:02X?}");
        answers.iter().for_each(|(_, answer)| check(answer, frame));
        if *bench.server.settings() != SETTINGS {
            // The port's settings have changed: no side understands this traffic any more.
            return;
        }
        meanwhile(&board, bench.now);
        bench.host.poll();
        if board.deferred.borrow_mut().pop().is_some() {
            bench.host.done(true);
        }
    }
});

fn piece(traffic: &mut Vec<Heard>, input: &mut Unstructured<'_>) -> Result<()> {
    let kind: u8 = input.arbitrary()?;
    if kind & 1 == 0 {
        let [silence, byte, errors]: [u8; 3] = input.arbitrary()?;
        traffic.push(Heard { silence: span(silence), byte, errors: flags(errors) });
        return Ok(());
    }
    let address = match kind >> 1 & 7 {
        0 => BROADCAST,
        1 => input.arbitrary()?,
        _ => ADDRESS,
    };
    let length = usize::from(input.arbitrary::<u8>()?).min(input.len());
    let pdu = input.bytes(length)?;
    let first = span(u8::MAX);
    traffic.extend(sealed(&[&[address], pdu].concat()).into_iter().enumerate().map(|(index, byte)| Heard {
        silence: if index == 0 { first } else { 0 },
        byte,
        errors: LineErrors::NONE,
    }));
    Ok(())
}

/// Silences that leave no doubt what they are: within a frame, too long for that, between frames.
fn span(code: u8) -> u64 {
    match code {
        0..200 => u64::from(code) * WITHIN / 200,
        200..220 => BROKEN + u64::from(code),
        220.. => BETWEEN + CHARACTER + u64::from(code),
    }
}

fn flags(code: u8) -> LineErrors {
    match code {
        0xFF => LineErrors::FRAMING,
        0xFE => LineErrors::PARITY,
        0xFD => LineErrors::OVERRUN,
        0xFC => LineErrors::NOISE,
        _ => LineErrors::NONE,
    }
}

/// The rest of the gateway runs.
fn meanwhile(board: &Board, now: u64) {
    board.now.set(board.now.get().max(Instant::from_micros(now)));
    board.cycle(500_000);
    let mut gateway = board.gateway.borrow_mut();
    for bus in [Bus::T7, Bus::Isu] {
        gateway.poll(bus, board.now.get(), |_| {});
    }
}

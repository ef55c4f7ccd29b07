//! Runs one operation `COUNT` times: `clino-codec-bench decode|frame COUNT`.
//!
//! The difference between two counts, divided by the difference of their instructions, is the cost of one
//! operation: start-up, and the loop around the first one, cancel out.

use std::hint::black_box;

use clino_codec::character::Character;
use clino_codec::checks::Checks;
use clino_codec::t7::{Address, Answer, AnswerDecoder, Axis, DecodeProgress, Request};

/// The answer of section 2.1.4 of the T7 guide.
const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let operation = arguments.next().expect("an operation");
    let count: u32 = arguments.next().and_then(|count| count.parse().ok()).expect("a count");
    match operation.as_str() {
        "decode" => decode(count),
        "frame" => frame(count),
        other => panic!("no operation {other}"),
    }
}

/// Decodes a complete answer.
fn decode(count: u32) {
    for _ in 0..count {
        black_box(&Answer::decode(black_box(&ANSWER)));
    }
}

/// Finds an answer in a stream, character by character, and decodes it.
fn frame(count: u32) {
    let address = Address::new(5).expect("an address");
    let mut decoder = AnswerDecoder::new(Request::GetAngle(Axis::Two).expected(address), Checks::ALL);
    for _ in 0..count {
        for &byte in black_box(&ANSWER) {
            match &decoder.push(Character::clean(byte)) {
                DecodeProgress::More => {}
                done => _ = black_box(done),
            }
        }
    }
}

//! Every good answer in a stream comes out, and nothing else does.
//!
//! Input: address, command, then pairs of a receiver error code (mostly none) and a byte.
#![no_main]

use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::Checks;
use clino_codec::t7::{Address, AnswerDecoder, DecodeProgress, Expected, Opcode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let [address, command, stream @ ..] = input else { return };
    let (Some(address), Some(opcode)) = (Address::of_request(*address), Opcode::new(*command)) else {
        return;
    };
    let expected = Expected { address, opcode };
    let characters: Vec<Character> = stream
        .chunks_exact(2)
        .map(|pair| {
            let errors = if pair[0] == 0xFF { LineErrors::FRAMING } else { LineErrors::NONE };
            Character { byte: pair[1], errors }
        })
        .collect();

    // The oracle: windows of the right size that pass every check, from left to right, no byte used twice.
    let size = expected.size();
    let mut wanted = Vec::new();
    let mut free = 0;
    for end in size..=characters.len() {
        let window = &characters[end - size..end];
        let bytes: Vec<u8> = window.iter().map(|character| character.byte).collect();
        let clean = window.iter().all(|character| character.errors.is_none());
        if end - size >= free
            && clean
            && let Ok(answer) = expected.check(&bytes, Checks::ALL)
        {
            wanted.push(answer);
            free = end;
        }
    }

    let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
    let mut seen = Vec::new();
    for &character in &characters {
        if let DecodeProgress::Frame(answer) = decoder.push(character) {
            seen.push(answer);
        }
    }
    loop {
        match decoder.idle() {
            DecodeProgress::More => break,
            DecodeProgress::Frame(answer) => seen.push(answer),
            DecodeProgress::Bad(_) => {}
        }
    }
    assert_eq!(seen, wanted);
    assert_eq!(decoder.pending(), 0);
    assert!(decoder.discarded() as usize + seen.len() * size <= characters.len());
});

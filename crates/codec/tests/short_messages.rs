//! ISU: messages in a build without `long-messages`. They carry 32 bytes; what is longer is refused as a whole.
//!
//! `cargo test -p clino-codec --no-default-features --test short_messages`; `cargo xtask test` runs it.
#![cfg(not(feature = "long-messages"))]

mod common;

use clino_codec::checks::Checks;
use clino_codec::isu::{
    Address, Answer, AnswerDecoder, Data, DecodeError, DecodeProgress, EncodeError, Frame, MAX_DATA,
    MAX_WORDS, Request, Response, Words,
};
use common::{clean, isu_frame};
use proptest::prelude::*;

/// Length byte, head, address, 32 bytes, checksum.
const LONGEST: usize = 36;
/// Address 3 says 180°.
const ANGLE: [u8; 6] = [0x04, 0x35, 0x58, 0x80, 0x00, 0x0D];

fn module() -> Address {
    Address::new(3).unwrap()
}

fn counting(bytes: usize) -> Vec<u8> {
    (0..bytes as u8).collect()
}

fn frames(decoder: &mut AnswerDecoder, bytes: &[u8]) -> Vec<Answer> {
    let mut seen = Vec::new();
    for character in clean(bytes) {
        if let DecodeProgress::Frame(answer) = decoder.push(character) {
            seen.push(answer);
        }
        assert!(decoder.pending() <= LONGEST);
    }
    loop {
        match decoder.idle() {
            DecodeProgress::More => return seen,
            DecodeProgress::Frame(answer) => seen.push(answer),
            DecodeProgress::Bad(_) => {}
        }
    }
}

#[test]
fn values_carry_sixteen_words() {
    assert_eq!((MAX_DATA, MAX_WORDS), (32, 16));
    assert!(Data::new(&[0; 32]).is_some() && Data::new(&[0; 33]).is_none());
    assert!(Words::new(&[0; 16]).is_some() && Words::new(&[0; 17]).is_none());
    assert!(size_of::<Answer>() <= 56 && size_of::<Request>() <= 56 && size_of::<Frame>() <= 48);
}

#[test]
fn what_calls_for_more_is_not_asked() {
    let refused = |request: Request| request.encode(module()).unwrap_err();
    let count = |count, max| EncodeError::Count { count, max };
    assert_eq!(refused(Request::ReadRam { start: 0, count: 33 }), count(33, 32));
    assert_eq!(refused(Request::ReadEeprom { start: 0, count: 17 }), count(17, 16));
    assert!(Request::ReadRam { start: 0, count: 32 }.encode(module()).is_ok());
    assert!(Request::ReadEeprom { start: 0, count: 16 }.encode(module()).is_ok());
}

/// The longest write that the document allows: 48H to 57H.
#[test]
fn the_longest_documented_write_fits() {
    let words: Vec<u16> = (0x0101..0x0111).collect();
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
    let frame =
        Request::WriteEeprom { start: 0x48, words: Words::new(&words).unwrap() }.encode(module()).unwrap();
    assert_eq!(frame.as_bytes(), isu_frame(0x3A, &[&[0x48], &bytes[..]].concat()));
    assert_eq!(frame.as_bytes().len(), LONGEST);
    assert!(Request::decode(frame.as_bytes()).is_ok());
}

/// Not cut: half a message is none.
#[test]
fn a_whole_message_that_is_too_long_is_refused() {
    for bytes in 1..=253 {
        let whole = isu_frame(0x35, &[&[7], &counting(bytes)[..]].concat());
        match Answer::decode(&whole) {
            Ok(Answer { response: Response::ReadRam { start: 7, data }, .. }) => {
                assert!(bytes <= 32 && data.as_slice() == counting(bytes), "{bytes}");
            }
            other => {
                assert_eq!(other, Err(DecodeError::Size { received: bytes + 4, expected: LONGEST as u16 }));
                assert!(bytes > 32, "{bytes}");
            }
        }
    }
    let write = isu_frame(0x3A, &[&[0x48], &counting(34)[..]].concat());
    assert_eq!(Request::decode(&write), Err(DecodeError::Size { received: 38, expected: LONGEST as u16 }));
}

#[test]
fn the_longest_answer_is_found() {
    let whole = isu_frame(0x35, &[&[1], &counting(32)[..]].concat());
    let request = Request::ReadRam { start: 1, count: 32 };
    let mut decoder = AnswerDecoder::new(request.expected(module()), Checks::ALL);
    assert_eq!(frames(&mut decoder, &whole), [Answer::decode(&whole).unwrap()]);
}

/// Another module's answer to another master, of any length, does not cost ours.
#[test]
fn an_answer_behind_a_long_foreign_one_is_found() {
    for head in [0x55, 0x59, 0x35, 0x39] {
        for bytes in (2..=252).step_by(2) {
            let foreign = isu_frame(head, &[&[0xA0], &vec![0; bytes][..]].concat());
            let mut decoder = AnswerDecoder::new(Request::READ_ANGLE.expected(module()), Checks::ALL);
            let seen = frames(&mut decoder, &[&foreign[..], &ANGLE].concat());
            assert_eq!(seen, [Answer::decode(&ANGLE).unwrap()], "{head:02X} {bytes}");
        }
    }
}

proptest! {
    #[test]
    fn any_stream_is_accounted_for(
        bytes in prop::collection::vec(prop_oneof![any::<u8>(), Just(0x35), Just(0xFF), 30_u8..40], 0..600),
    ) {
        let mut decoder = AnswerDecoder::new(Request::READ_ANGLE.expected(module()), Checks::ALL);
        for answer in frames(&mut decoder, &bytes) {
            prop_assert!(answer.response.function().is_none() || answer.angle_word().is_some());
        }
        prop_assert_eq!(decoder.pending(), 0);
    }
}

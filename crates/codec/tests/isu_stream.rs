//! ISU: finding answers in a stream.

mod common;

use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::Checks;
use clino_codec::isu::{
    Address, Answer, AnswerDecoder, DecodeError, DecodeProgress, DeviceError, Differs, Function, Request,
    Response,
};
use common::{clean, hex, isu_frame};

/// Address 3 says 180°.
const GOOD: [u8; 6] = [0x04, 0x35, 0x58, 0x80, 0x00, 0x0D];

fn decoder(request: Request, number: u8) -> AnswerDecoder {
    AnswerDecoder::new(request.expected(Address::new(number).unwrap()), Checks::ALL)
}

/// Everything that came out, end of transmission included.
fn run(decoder: &mut AnswerDecoder, bytes: &[u8]) -> Vec<Result<Answer, DecodeError>> {
    let mut seen = Vec::new();
    let mut note = |progress| match progress {
        DecodeProgress::More => false,
        DecodeProgress::Frame(answer) => {
            seen.push(Ok(answer));
            true
        }
        DecodeProgress::Bad(error) => {
            seen.push(Err(error));
            true
        }
    };
    for character in clean(bytes) {
        note(decoder.push(character));
    }
    while note(decoder.idle()) {}
    seen
}

#[test]
fn the_answer_is_found_at_its_last_byte() {
    let mut decoder = decoder(Request::READ_ANGLE, 3);
    for character in clean(&GOOD[..5]) {
        assert_eq!(decoder.push(character), DecodeProgress::More);
    }
    assert_eq!(decoder.pending(), 5);
    let DecodeProgress::Frame(answer) = decoder.push(Character::clean(GOOD[5])) else { panic!() };
    assert_eq!(answer.angle_word(), Some(0x8000));
    assert_eq!((decoder.pending(), decoder.discarded()), (0, 0));
    assert_eq!(decoder.expected().function(), Function::ReadRam);
}

/// Two frames of other nodes have begun, and beginnings of the answer in both. Silence ends the first; then the second has
/// answers among its bytes that were there before it was looked at.
#[test]
fn answers_in_foreign_frames_one_in_another_are_found() {
    let bytes = [
        &[0x20, 0x25, 0x58][..],
        &GOOD[..4],
        &GOOD[..4],
        &[0x00, 0x00],
        &GOOD[..4],
        &GOOD[..4],
        &[0xFE, 0x15],
        &GOOD[..4],
        &[0x00, 0x00],
        &GOOD[..2],
        &GOOD,
        &GOOD,
    ];
    let seen = run(&mut decoder(Request::READ_ANGLE, 3), &bytes.concat());
    let found: Vec<_> = seen.iter().filter_map(|seen| seen.as_ref().ok()?.angle_word()).collect();
    assert_eq!(found, [0x8000; 2], "{seen:?}");
}

#[test]
fn the_longest_answer_fits() {
    let content: Vec<u8> = (0..=252).collect();
    let bytes = isu_frame(0x35, &[&[1], &content[..]].concat());
    assert_eq!(bytes.len(), 257);
    let mut decoder = decoder(Request::ReadRam { start: 1, count: 253 }, 3);
    let seen = run(&mut decoder, &bytes);
    let [Ok(Answer { response: Response::ReadRam { start: 1, data }, .. })] = &seen[..] else { panic!() };
    assert_eq!(data.as_slice(), content);
}

#[test]
fn error_answers_belong_to_the_transaction_in_flight() {
    for (bytes, error) in [
        (hex("01 FF FF"), DeviceError::InvalidFunctionCode),
        (hex("01 FD FD"), DeviceError::InvalidChecksum),
        (hex("02 F1 04 F5"), DeviceError::HardwareError { command_byte: 0x04 }),
    ] {
        for stray in [&[][..], &[0x00], &[0xFF, 0xFF], &[0x35], &[0x10, 0x45]] {
            let mut decoder = decoder(Request::READ_ANGLE, 3);
            let seen = run(&mut decoder, &[stray, &bytes].concat());
            let answer = Answer { address: Address::RESERVED, response: Response::Error(error) };
            assert_eq!(seen, [Ok(answer)], "{stray:02X?}");
            assert_eq!(decoder.discarded() as usize, stray.len());
        }
        let mut damaged = bytes.clone();
        let last = damaged.len() - 1;
        damaged[last] ^= 1;
        let seen = run(&mut decoder(Request::READ_ANGLE, 3), &damaged);
        assert!(matches!(seen[..], [Err(DecodeError::Checksum { .. })]));
    }
}

#[test]
fn stray_characters_never_costs_a_good_answer() {
    let command = hex("03 34 58 02 8E");
    for stray in
        [&[0x00][..], &[0x04], &[0x04, 0x35], &[0x35; 5], &command, &[0xFE, 0x15], &[0x04, 0x35, 0x58]]
    {
        let mut decoder = decoder(Request::READ_ANGLE, 3);
        let seen = run(&mut decoder, &[stray, &GOOD].concat());
        assert_eq!(seen.last(), Some(&Answer::decode(&GOOD)), "{stray:02X?}");
    }
    // The host's own command, heard as an echo, is discarded.
    let mut decoder = decoder(Request::READ_ANGLE, 3);
    assert_eq!(run(&mut decoder, &[&command[..], &GOOD].concat()), [Answer::decode(&GOOD)]);
    assert_eq!(decoder.discarded(), 5);
}

#[test]
fn a_good_answer_comes_out_at_once_while_a_longer_foreign_one_seems_to_arrive() {
    let mut decoder = decoder(Request::READ_ANGLE, 3);
    let bytes = [&[0xFE, 0x15][..], &GOOD].concat();
    let (&last, first) = bytes.split_last().unwrap();
    for character in clean(first) {
        assert_eq!(decoder.push(character), DecodeProgress::More);
    }
    assert!(matches!(decoder.push(Character::clean(last)), DecodeProgress::Frame(_)));
    assert_eq!(decoder.discarded(), 2);
}

#[test]
fn foreign_answers_are_reported_with_their_sender() {
    let foreign = |request, number| {
        let seen = run(&mut decoder(request, number), &GOOD);
        match seen[..] {
            [Err(DecodeError::Foreign { address, function: Function::ReadRam, differs })] => {
                assert_eq!(address.get(), 3);
                differs
            }
            _ => panic!("{seen:?}"),
        }
    };
    assert_eq!(foreign(Request::READ_ANGLE, 4), Differs::Address);
    assert_eq!(foreign(Request::ResetModule, 3), Differs::Function);
    assert_eq!(foreign(Request::ResetModule, 4), Differs::Both);
    // Asked as 0, an answer from any module is right.
    assert_eq!(run(&mut decoder(Request::READ_ANGLE, 0), &GOOD), [Answer::decode(&GOOD)]);
    // A damaged foreign answer is discarded.
    let mut damaged = GOOD;
    damaged[5] ^= 1;
    let mut decoder = decoder(Request::READ_ANGLE, 4);
    assert_eq!(run(&mut decoder, &damaged), []);
    assert_eq!(decoder.discarded(), 6);
}

#[test]
fn an_answer_about_other_memory_is_reported() {
    let other = isu_frame(0x35, &[0x59, 0x80, 0x00]);
    let seen = run(&mut decoder(Request::READ_ANGLE, 3), &[&other[..], &GOOD].concat());
    let memory = DecodeError::Memory { received: (0x59, 2), expected: (0x58, 2) };
    assert_eq!(seen, [Err(memory), Answer::decode(&GOOD)]);
}

#[test]
fn a_wrong_length_byte_is_reported() {
    let longer = isu_frame(0x35, &[0x58, 1, 2, 3]);
    let length = DecodeError::Length { length: 5, function: Function::ReadRam };
    let seen = run(&mut decoder(Request::READ_ANGLE, 3), &longer);
    assert_eq!(seen, [Err(length)]);
    let checks = Checks { length: false, ..Checks::ALL };
    let expected = Request::READ_ANGLE.expected(Address::new(3).unwrap());
    let seen = run(&mut AnswerDecoder::new(expected, checks), &longer);
    assert!(matches!(seen[..], [Ok(_)]), "{seen:?}");
}

#[test]
fn with_the_command_layer_off_other_functions_are_taken() {
    let expected = Request::READ_ANGLE.expected(Address::new(3).unwrap());
    let checks = Checks { command: false, ..Checks::ALL };
    let reset = isu_frame(0x33, &[]);
    let seen = run(&mut AnswerDecoder::new(expected, checks), &reset);
    assert_eq!(seen, [Answer::decode(&reset)]);
}

#[test]
fn a_receiver_error_makes_the_frame_dirty_but_not_the_next() {
    for position in 0..GOOD.len() {
        let mut decoder = decoder(Request::READ_ANGLE, 3);
        let mut last = DecodeProgress::More;
        for (index, byte) in GOOD.into_iter().enumerate() {
            let errors = if index == position { LineErrors::OVERRUN } else { LineErrors::NONE };
            last = decoder.push(Character { byte, errors });
        }
        assert_eq!(last, DecodeProgress::Bad(DecodeError::LineErrors { errors: LineErrors::OVERRUN }));
        assert_eq!(run(&mut decoder, &GOOD), [Answer::decode(&GOOD)]);
    }
    let expected = Request::READ_ANGLE.expected(Address::new(3).unwrap());
    let mut tolerant = AnswerDecoder::new(expected, Checks { line_errors: false, ..Checks::ALL });
    let dirty = GOOD.map(|byte| tolerant.push(Character { byte, errors: LineErrors::NOISE }));
    assert!(matches!(dirty[5], DecodeProgress::Frame(_)));
    // On a dirty line even an intact foreign frame is not believed.
    let mut decoder = decoder(Request::READ_ANGLE, 4);
    for byte in GOOD {
        assert_eq!(decoder.push(Character { byte, errors: LineErrors::NOISE }), DecodeProgress::More);
    }
    assert_eq!(decoder.idle(), DecodeProgress::More);
    assert_eq!(decoder.discarded(), 6);
}

// A module may answer a command for address 0 with its own address, or with 0: the document does not say.
#[test]
fn asked_any_every_module_is_heard() {
    let mut decoder = decoder(Request::READ_ANGLE, 0);
    let frames: Vec<_> = [0, 1, 14].map(|number| isu_frame(number << 4 | 5, &[0x58, 0x80, 0x00])).concat();
    let seen = run(&mut decoder, &frames);
    let senders: Vec<u8> = seen.iter().map(|answer| answer.unwrap().address.get()).collect();
    assert_eq!(senders, [0, 1, 14]);
}

#[test]
fn a_restarted_decoder_is_as_good_as_new() {
    let address = Address::new(0).unwrap();
    let mut decoder =
        AnswerDecoder::new(Request::ReadEeprom { start: 0, count: 8 }.expected(address), Checks::ALL);
    for byte in [0x12, 0x09, 0x00] {
        assert!(matches!(decoder.push(Character::clean(byte)), DecodeProgress::More));
    }
    decoder.restart(Request::READ_ANGLE.expected(address));
    assert_eq!((decoder.pending(), decoder.discarded()), (0, 0));
    let answer = [0x04, 0x05, 0x58, 0x80, 0x00, 0xDD];
    let found = answer.map(|byte| matches!(decoder.push(Character::clean(byte)), DecodeProgress::Frame(_)));
    assert_eq!(found, [false, false, false, false, false, true]);
}

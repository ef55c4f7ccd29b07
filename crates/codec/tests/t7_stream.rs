//! T7: finding answers in a stream, and listening to both directions.

mod common;

use clino_codec::angle::Range;
use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::Checks;
use clino_codec::t7::{
    Address, Answer, AnswerDecoder, Axis, Command, DecodeError, DecodeProgress, Differs, Expected, Opcode,
    Request, SniffProgress, Sniffed, Sniffer, Status,
};
use common::{clean, hex, t7_frame};

const GOOD: [u8; 8] = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];

fn decoder(number: u8, opcode: Opcode) -> AnswerDecoder {
    let address = Address::new(number).unwrap();
    AnswerDecoder::new(Expected { address, opcode }, Checks::ALL)
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
fn every_documented_answer_is_found_at_its_last_byte() {
    for bytes in common::frames("t7", "response") {
        let answer = Answer::decode(&bytes).unwrap();
        let mut decoder = decoder(5, answer.response.opcode());
        assert_eq!(decoder.expected().opcode, answer.response.opcode());
        let (&last, first) = bytes.split_last().unwrap();
        for character in clean(first) {
            assert_eq!(decoder.push(character), DecodeProgress::More);
        }
        assert_eq!(decoder.pending(), first.len());
        assert_eq!(decoder.push(Character::clean(last)), DecodeProgress::Frame(answer));
        assert_eq!((decoder.pending(), decoder.discarded()), (0, 0));
    }
}

#[test]
fn stray_characters_is_counted_and_costs_nothing() {
    for stray in
        [&[0x00][..], &[0xFF, 0xFF], &[0x05], &[0x05, 0x06], &[0x05, 0x05, 0x05], &[0x7E, 0x01, 0x83]]
    {
        let mut decoder = decoder(5, Opcode::GetAngle2);
        let seen = run(&mut decoder, &[stray, &GOOD].concat());
        assert_eq!(seen, [Answer::decode(&GOOD)], "{stray:02X?}");
        assert_eq!(decoder.discarded() as usize, stray.len());
    }
}

#[test]
fn a_good_answer_comes_out_at_its_last_byte_even_while_a_longer_foreign_one_seems_to_arrive() {
    // The header of another device's 34 bytes, and then the answer.
    let mut decoder = decoder(5, Opcode::GetAngle2);
    for character in clean(&[0x09, 0x20, 0x87]) {
        assert_eq!(decoder.push(character), DecodeProgress::More);
    }
    for character in clean(&GOOD[..7]) {
        assert_eq!(decoder.push(character), DecodeProgress::More);
    }
    assert!(matches!(decoder.push(Character::clean(GOOD[7])), DecodeProgress::Frame(_)));
    assert_eq!(decoder.discarded(), 3);
}

#[test]
fn reports_that_take_their_turn_do_not_cost_an_answer_meanwhile() {
    // Found by fuzzing: while damaged answers are reported, one a character, two good ones arrive; the first
    // of them then lies in the middle of what seems to be another device's 34 bytes.
    let mut decoder = decoder(5, Opcode::SetAddress);
    let bytes =
        hex("5F 20 87 FF FF 01 89 05 03 91 00 00 00 67 05 03 91 FF FF F9 89 FF 5F 05 20 87 FF FF 89 \
         05 03 91 00 67 05 03 91 00 67");
    let good = run(&mut decoder, &bytes).into_iter().filter(Result::is_ok).count();
    assert_eq!(good, 2);
}

#[test]
fn a_truncated_answer_does_not_cost_the_next() {
    for cut in 1..GOOD.len() {
        let mut decoder = decoder(5, Opcode::GetAngle2);
        let seen = run(&mut decoder, &[&GOOD[..cut], &GOOD].concat());
        assert_eq!(seen.last(), Some(&Answer::decode(&GOOD)), "cut after {cut}");
    }
}

#[test]
fn a_damaged_answer_is_reported_once_with_both_checksums() {
    let mut damaged = GOOD;
    damaged[5] ^= 0x10;
    let mut decoder = decoder(5, Opcode::GetAngle2);
    let seen = run(&mut decoder, &damaged);
    assert_eq!(seen, [Err(DecodeError::Checksum { received: 0x27, computed: 0x17 })]);
    assert_eq!(decoder.discarded(), 0);
}

#[test]
fn foreign_answers_are_reported_with_their_sender() {
    let foreign = |number, opcode| {
        let mut decoder = decoder(number, opcode);
        let seen = run(&mut decoder, &GOOD);
        assert_eq!(decoder.discarded(), 0);
        match seen[..] {
            [Err(DecodeError::Foreign { address, opcode: Opcode::GetAngle2, differs })] => {
                assert_eq!(address.get(), 5);
                differs
            }
            _ => panic!("{seen:?}"),
        }
    };
    assert_eq!(foreign(6, Opcode::GetAngle2), Differs::Address);
    assert_eq!(foreign(5, Opcode::GetAllData), Differs::Command);
    assert_eq!(foreign(6, Opcode::GetAllData), Differs::Both);

    // A damaged foreign answer is discarded.
    let mut damaged = GOOD;
    damaged[7] ^= 1;
    let mut decoder = decoder(6, Opcode::GetAngle2);
    assert_eq!(run(&mut decoder, &damaged), []);
    assert_eq!(decoder.discarded(), 8);
}

#[test]
fn a_foreign_answer_does_not_cost_the_wanted_one() {
    let foreign = t7_frame(9, 0x83, &[0, 0, 0, 1], true);
    let mut decoder = decoder(5, Opcode::GetAngle2);
    let seen = run(&mut decoder, &[&foreign[..], &GOOD].concat());
    assert!(matches!(seen[..], [Err(DecodeError::Foreign { .. }), Ok(_)]), "{seen:?}");
    assert_eq!(decoder.discarded(), 0);
}

#[test]
fn a_wrong_length_byte_is_reported() {
    let mut wrong = GOOD;
    wrong[1] = 0x07;
    let mut decoder = decoder(5, Opcode::GetAngle2);
    let seen = run(&mut decoder, &[&wrong[..], &GOOD].concat());
    assert_eq!(seen, [Err(DecodeError::Length { received: 7, expected: 6 }), Answer::decode(&GOOD)]);
}

#[test]
fn a_receiver_error_makes_the_frame_dirty_but_not_the_next() {
    for position in 0..GOOD.len() {
        let mut decoder = decoder(5, Opcode::GetAngle2);
        let mut last = DecodeProgress::More;
        for (index, byte) in GOOD.into_iter().enumerate() {
            let errors = if index == position { LineErrors::FRAMING } else { LineErrors::NONE };
            last = decoder.push(Character { byte, errors });
        }
        assert_eq!(last, DecodeProgress::Bad(DecodeError::LineErrors { errors: LineErrors::FRAMING }));
        assert_eq!(run(&mut decoder, &GOOD), [Answer::decode(&GOOD)]);
    }
    // On a dirty line even an intact foreign frame is not believed.
    let mut decoder = decoder(6, Opcode::GetAngle2);
    for byte in GOOD {
        assert_eq!(decoder.push(Character { byte, errors: LineErrors::NOISE }), DecodeProgress::More);
    }
    assert_eq!(decoder.idle(), DecodeProgress::More);
    assert_eq!(decoder.discarded(), 8);
}

#[test]
fn layers_can_be_switched_off_one_by_one() {
    let all = Checks::ALL;
    let address = Address::new(6).unwrap();
    let expected = Expected { address, opcode: Opcode::GetAngle0 };
    let got = |checks, bytes: &[u8], errors| {
        let mut decoder = AnswerDecoder::new(expected, checks);
        let mut good = false;
        for &byte in bytes {
            good |= matches!(decoder.push(Character { byte, errors }), DecodeProgress::Frame(_));
        }
        good
    };
    let right = t7_frame(6, 0x81, &[0; 4], true);
    let other_device = t7_frame(7, 0x81, &[0; 4], true);
    let other_command = t7_frame(6, 0x83, &[0; 4], true);
    let other_length = [6, 9, 0x81, 0, 0, 0, 0, 0x70];
    let bad_sum = [6, 6, 0x81, 0, 0, 0, 0, 0];
    let far_value = t7_frame(6, 0x81, &[0x7F; 4], true);
    let (clean, dirty) = (LineErrors::NONE, LineErrors::NOISE);
    for (off, bytes, errors) in [
        (Checks { line_errors: false, ..all }, &right[..], dirty),
        (Checks { address: false, ..all }, &other_device[..], clean),
        (Checks { command: false, ..all }, &other_command[..], clean),
        (Checks { length: false, ..all }, &other_length[..], clean),
        (Checks { checksum: false, ..all }, &bad_sum[..], clean),
        (Checks { values: clino_codec::checks::ValueRange::Off, ..all }, &far_value[..], clean),
    ] {
        assert!(got(off, bytes, errors), "{off:?}");
        assert!(!got(all, bytes, errors), "{off:?}");
        assert!(got(Checks::NONE, bytes, errors), "{off:?}");
    }
    assert_eq!(Checks::default(), Checks::ALL);
}

#[test]
fn with_the_command_layer_off_silence_releases_what_hides_behind_a_damaged_header() {
    let address = Address::new(5).unwrap();
    let expected = Expected { address, opcode: Opcode::GetAngle2 };
    let mut decoder = AnswerDecoder::new(expected, Checks { command: false, ..Checks::ALL });
    let seen = run(&mut decoder, &[&[0x05, 0x20, 0x87][..], &GOOD].concat());
    assert_eq!(seen, [Answer::decode(&GOOD)]);
}

// T11
#[test]
fn asked_all_every_device_is_heard() {
    let expected = Request::GetAngle(Axis::Two).expected(Address::ALL);
    let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
    let frames: Vec<_> = [1, 2, 100, 127].map(|number| t7_frame(number, 0x83, &[0; 4], true)).concat();
    let seen = run(&mut decoder, &frames);
    let senders: Vec<u8> = seen.iter().map(|answer| answer.unwrap().address.get()).collect();
    assert_eq!(senders, [1, 2, 100, 127]);

    // Behind our own echo, and the answers to a Set command.
    let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
    assert_eq!(run(&mut decoder, &[&[126, 1, 0x83][..], &GOOD].concat()), [Answer::decode(&GOOD)]);
    let expected = Request::SetDamping { damping_ms: 125 }.expected(Address::ALL);
    let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
    let seen = run(&mut decoder, &[t7_frame(7, 0x8B, &[0], true), t7_frame(8, 0x8B, &[0], true)].concat());
    assert_eq!(seen.iter().map(|answer| answer.unwrap().address.get()).collect::<Vec<_>>(), [7, 8]);
}

// T1
#[test]
fn the_printed_length_of_get_all_angles_does_not_shorten_the_frame() {
    let printed = hex("05 0A 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC CC");
    let mut decoder = decoder(5, Opcode::GetAllAngles);
    let seen = run(&mut decoder, &printed);
    assert_eq!(seen, [Answer::decode(&printed)]);
    assert!(seen[0].unwrap().length_quirk);
}

fn sniff(sniffer: &mut Sniffer, bytes: &[u8]) -> Vec<Result<Sniffed, DecodeError>> {
    clean(bytes)
        .filter_map(|character| match sniffer.push(character) {
            SniffProgress::More => None,
            SniffProgress::Frame(message) => Some(Ok(message)),
            SniffProgress::Bad(error) => Some(Err(error)),
        })
        .collect()
}

#[test]
fn a_sniffer_follows_every_documented_exchange() {
    let mut sniffer = Sniffer::new(Checks::ALL);
    let vectors = common::vectors("t7");
    let mut asked = None;
    for vector in &vectors {
        let bytes = common::bytes_of(vector);
        if vector["name"] == "get_all_angles (correct length)" {
            // The same exchange twice: ask again.
            assert_eq!(sniff(&mut sniffer, &[5, 1, 0x80]), [Ok(Sniffed::Command(asked.unwrap()))]);
        }
        let seen = sniff(&mut sniffer, &bytes);
        if vector["kind"] == "command" {
            asked = Request::decode(&bytes).ok();
            assert_eq!(seen, [Ok(Sniffed::Command(asked.unwrap()))], "{vector}");
        } else {
            let answer = Answer::decode(&bytes).unwrap();
            assert_eq!(seen, [Ok(Sniffed::Answer { answer, to: asked })], "{vector}");
        }
    }
    assert_eq!(sniffer.discarded(), 0);
}

/// A command behind the beginning of an answer: while more may come it may be part of it; silence settles it.
#[test]
fn a_sniffer_finds_a_command_in_what_was_cut_off_when_the_line_is_silent() {
    let mut sniffer = Sniffer::new(Checks::ALL);
    assert_eq!(sniff(&mut sniffer, &[0x05, 0x06, 0x83, 0x05, 0x01, 0x83]), []);
    let asked = Command { address: Address::new(5).unwrap(), request: Request::GetAngle(Axis::Two) };
    assert_eq!(sniffer.idle(), SniffProgress::Frame(Sniffed::Command(asked)));
    assert_eq!((sniffer.idle(), sniffer.discarded()), (SniffProgress::More, 3));
}

#[test]
fn a_sniffer_tells_look_alikes_apart_by_their_order() {
    let command = [0x05, 0x03, 0x8D, 0x01, 0x6A];
    let asked = Command {
        address: Address::new(5).unwrap(),
        request: Request::SetAngleOutputRange(Range::Unidirectional),
    };
    let mut sniffer = Sniffer::new(Checks::ALL);
    assert_eq!(sniff(&mut sniffer, &command), [Ok(Sniffed::Command(asked))]);
    // Without a pause, the same bytes are its answer: "invalid command".
    let seen = sniff(&mut sniffer, &command);
    let [Ok(Sniffed::Answer { answer, to: Some(to) })] = seen[..] else { panic!("{seen:?}") };
    assert_eq!((answer.response.status(), to), (Some(Status::InvalidCommand), asked));
    // Then a command again; after a pause, the repeated command.
    assert_eq!(sniff(&mut sniffer, &command), [Ok(Sniffed::Command(asked))]);
    assert_eq!(sniffer.idle(), SniffProgress::More);
    assert_eq!(sniff(&mut sniffer, &command), [Ok(Sniffed::Command(asked))]);
    // Another device's answer is not the answer to it.
    let other = t7_frame(6, 0x81, &[0; 4], true);
    assert!(matches!(sniff(&mut sniffer, &other)[..], [Ok(Sniffed::Answer { to: None, .. })]));
}

#[test]
fn a_sniffer_hears_all_answers_to_a_command_to_all() {
    let mut sniffer = Sniffer::new(Checks::ALL);
    sniff(&mut sniffer, &[126, 1, 0x83]);
    for number in [3, 4, 5] {
        let seen = sniff(&mut sniffer, &t7_frame(number, 0x83, &[0; 4], true));
        assert!(matches!(seen[..], [Ok(Sniffed::Answer { to: Some(_), .. })]));
    }
    // No device answers as 126.
    assert_eq!(sniff(&mut sniffer, &t7_frame(126, 0x83, &[0; 4], true)), []);
}

#[test]
fn a_sniffer_reports_damage_and_goes_on() {
    let mut sniffer = Sniffer::new(Checks::ALL);
    let mut answer = GOOD;
    answer[6] ^= 1;
    let bytes = [&[0xFF][..], &[5, 1, 0x83], &answer, &[0x80, 0x80], &[5, 1, 0x83], &GOOD].concat();
    let seen = sniff(&mut sniffer, &bytes);
    assert!(
        matches!(
            seen[..],
            [
                Ok(Sniffed::Command(_)),
                Err(DecodeError::Checksum { received: 0x27, computed: 0x28 }),
                Ok(Sniffed::Command(_)),
                Ok(Sniffed::Answer { to: Some(_), .. }),
            ]
        ),
        "{seen:?}"
    );
    assert_eq!(sniffer.discarded(), 3);
    let dirty = Character { byte: 5, errors: LineErrors::OVERRUN };
    _ = sniffer.push(dirty);
    assert_eq!(
        sniff(&mut sniffer, &[1, 0x83]),
        [Err(DecodeError::LineErrors { errors: LineErrors::OVERRUN })]
    );
    // Unless that check is off.
    let mut tolerant = Sniffer::new(Checks { line_errors: false, ..Checks::ALL });
    _ = tolerant.push(dirty);
    assert!(matches!(sniff(&mut tolerant, &[1, 0x83])[..], [Ok(Sniffed::Command(_))]));
    // A command whose parameters make no sense.
    let seen = sniff(&mut sniffer, &t7_frame(5, 0x89, &[3, 0], true));
    assert!(matches!(seen[..], [Err(DecodeError::Value { .. })]), "{seen:?}");
}

#[test]
fn a_restarted_decoder_is_as_good_as_new() {
    let address = Address::new(5).unwrap();
    let mut decoder = AnswerDecoder::new(Request::GetDamping.expected(address), Checks::ALL);
    for byte in [0x05, 0x04, 0x8A, 0x03] {
        assert!(matches!(decoder.push(Character::clean(byte)), DecodeProgress::More));
    }
    decoder.restart(Request::GetAngle(Axis::Two).expected(address));
    assert_eq!((decoder.pending(), decoder.discarded()), (0, 0));
    let answer = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
    let found = answer.map(|byte| matches!(decoder.push(Character::clean(byte)), DecodeProgress::Frame(_)));
    assert_eq!(found, [false, false, false, false, false, false, false, true]);
}

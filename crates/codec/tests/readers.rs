//! Decoders whose checks are known to the compiler find what those with chosen checks find: every documented answer, whole,
//! with every byte changed, with receiver errors, and behind another.

mod common;

use clino_codec::DecodeProgress;
use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::{AllChecks, Check, Checks};
use clino_codec::t7::{Axis, BaudRate, Direction, Millidegrees, Request};
use clino_codec::{angle::Range, isu, t7};

/// A request for every command but *Set Address*.
const T7: [Request; 16] = [
    Request::GetAllAngles,
    Request::GetAngle(Axis::Zero),
    Request::GetAngle(Axis::One),
    Request::GetAngle(Axis::Two),
    Request::SetAngle { axis: Axis::Two, angle: Millidegrees(0) },
    Request::GetAllAngleOffsets,
    Request::SetAngleOffset { axis: Axis::Two, offset: Millidegrees(0) },
    Request::GetAllData,
    Request::GetAllDirections,
    Request::SetDirection { axis: Axis::Two, direction: Direction::Normal },
    Request::GetDamping,
    Request::SetDamping { damping_ms: 10 },
    Request::GetAngleOutputRange,
    Request::SetAngleOutputRange(Range::Unidirectional),
    Request::GetDeviceInformation,
    Request::SetBaudRate(BaudRate::B9600),
];

const ISU: [isu::Request; 4] = [
    isu::Request::READ_ANGLE,
    isu::Request::ReadEeprom { start: 0, count: 2 },
    isu::Request::ResetModule,
    isu::Request::ResetNullPosition,
];

/// What is heard: this frame behind stray characters and another, as it is and damaged in many ways.
fn heard(frame: &[u8], other: &[u8]) -> Vec<Vec<Character>> {
    let clean = |bytes: &[u8]| -> Vec<Character> { bytes.iter().copied().map(Character::clean).collect() };
    let mut all =
        vec![clean(frame), clean(&[other, frame].concat()), clean(&[&[0x00, 0xFF], frame, frame].concat())];
    // From the address that no device has, with the right sum.
    let mut from_all = frame.to_vec();
    (from_all[0], *from_all.last_mut().unwrap()) =
        (0x7E, frame[frame.len() - 1].wrapping_sub(0x7E_u8.wrapping_sub(frame[0])));
    all.push(clean(&from_all));
    for place in 0..frame.len() {
        for bits in [0x01, 0x04, 0x10, 0x80, 0xFF] {
            let mut damaged = frame.to_vec();
            damaged[place] ^= bits;
            all.push(clean(&[&damaged, frame].concat()));
            // Another byte makes the sum right again.
            let last = damaged.len() - 1;
            damaged[last] = damaged[last].wrapping_sub(damaged[place].wrapping_sub(frame[place]));
            all.push(clean(&damaged));
        }
        let mut flawed = clean(frame);
        flawed[place].errors = LineErrors::FRAMING;
        all.push(flawed);
    }
    all
}

/// Everything that comes out, and how many characters belong to nothing.
fn run<T, E>(
    characters: &[Character],
    mut push: impl FnMut(Option<Character>) -> DecodeProgress<T, E>,
) -> Vec<DecodeProgress<T, E>> {
    let mut seen: Vec<_> = characters.iter().map(|&character| push(Some(character))).collect();
    loop {
        let progress = push(None);
        let is_over = matches!(progress, DecodeProgress::More);
        seen.push(progress);
        if is_over {
            return seen;
        }
    }
}

#[test]
fn a_t7s_answer_is_read_as_it_was_asked_for() {
    let frames = common::frames("t7", "response");
    let mut found = 0;
    for (frame, other) in frames.iter().zip(frames.iter().cycle().skip(1)) {
        for request in T7 {
            let expected = request.expected(t7::Address::new(5).unwrap());
            for characters in heard(frame, other) {
                let mut any = t7::AnswerDecoder::new(expected, Checks::ALL);
                let mut asked = t7::AnswerDecoder::new(
                    t7::Request::GetDamping.expected(expected.address),
                    request.reader(),
                );
                asked.restart_with(expected, request.reader());
                let one = run(&characters, |next| match next {
                    Some(next) => any.push(next),
                    None => any.idle(),
                });
                let other = run(&characters, |next| match next {
                    Some(next) => asked.push(next),
                    None => asked.idle(),
                });
                assert_eq!(one, other, "{request:?}: {characters:?}");
                assert_eq!((any.discarded(), any.pending()), (asked.discarded(), asked.pending()));
                found += one.iter().filter(|progress| matches!(progress, DecodeProgress::Frame(_))).count();
            }
        }
    }
    assert!(found > 1_000, "{found}");
    // What reads angles alone refuses everything else, whatever it is told to wait for.
    let damping = t7::Request::GetDamping.expected(t7::Address::new(5).unwrap());
    let mut angles = t7::AnswerDecoder::new(damping, t7::Request::GetAngle(Axis::Two).reader());
    let answer = common::t7_frame(5, 0x8A, &[0, 10], true);
    let characters: Vec<Character> = answer.into_iter().map(Character::clean).collect();
    let seen = run(&characters, |next| match next {
        Some(next) => angles.push(next),
        None => angles.idle(),
    });
    assert!(seen.iter().any(|progress| matches!(progress, DecodeProgress::Bad(_))), "{seen:?}");
    assert!(!seen.iter().any(|progress| matches!(progress, DecodeProgress::Frame(_))), "{seen:?}");
}

#[test]
fn an_isus_answer_passes_all_checks_or_all_checks() {
    let frames = common::frames("isu", "response");
    let mut found = 0;
    for (frame, other) in frames.iter().zip(frames.iter().cycle().skip(1)) {
        for request in ISU {
            for address in [0, 3] {
                let expected = request.expected(isu::Address::new(address).unwrap());
                for characters in heard(frame, other) {
                    let mut chosen = isu::AnswerDecoder::new(expected, Checks::ALL);
                    let mut all = isu::AnswerDecoder::new(expected, AllChecks);
                    let one = run(&characters, |next| match next {
                        Some(next) => chosen.push(next),
                        None => chosen.idle(),
                    });
                    let other = run(&characters, |next| match next {
                        Some(next) => all.push(next),
                        None => all.idle(),
                    });
                    assert_eq!(one, other, "{request:?}: {characters:?}");
                    assert_eq!((chosen.discarded(), chosen.pending()), (all.discarded(), all.pending()));
                    found +=
                        one.iter().filter(|progress| matches!(progress, DecodeProgress::Frame(_))).count();
                }
            }
        }
    }
    assert!(found > 100, "{found}");
}

#[test]
fn a_request_that_changes_the_device_is_one_whose_command_does() {
    for request in T7 {
        assert_eq!(request.is_set(), request.opcode().is_set(), "{request:?}");
    }
}

/// Every check alone switched off, and all of them.
fn with_checks_off() -> [(Option<Check>, Checks); 6] {
    [
        (Some(Check::LineErrors), Checks { line_errors: false, ..Checks::ALL }),
        (Some(Check::Checksum), Checks { checksum: false, ..Checks::ALL }),
        (None, Checks { address: false, ..Checks::ALL }),
        (None, Checks { command: false, ..Checks::ALL }),
        (None, Checks { length: false, ..Checks::ALL }),
        (Some(Check::Checksum), Checks::NONE),
    ]
}

#[test]
fn a_check_that_is_off_refuses_nothing() {
    let (t7s, isus) = (common::frames("t7", "response"), common::frames("isu", "response"));
    for (off, checks) in with_checks_off() {
        let mut found = 0;
        for (frame, other) in t7s.iter().zip(t7s.iter().cycle().skip(1)) {
            for request in T7 {
                for address in [t7::Address::new(5).unwrap(), t7::Address::ALL] {
                    for characters in heard(frame, other) {
                        let mut decoder = t7::AnswerDecoder::new(request.expected(address), checks);
                        for progress in run(&characters, |next| match next {
                            Some(next) => decoder.push(next),
                            None => decoder.idle(),
                        }) {
                            match progress {
                                DecodeProgress::Bad(error) => assert_ne!(Some(error.failed_check()), off),
                                DecodeProgress::Frame(_) => found += 1,
                                DecodeProgress::More => {}
                            }
                        }
                    }
                }
            }
        }
        for (frame, other) in isus.iter().zip(isus.iter().cycle().skip(1)) {
            for request in ISU {
                for characters in heard(frame, other) {
                    let expected = request.expected(isu::Address::new(3).unwrap());
                    let mut decoder = isu::AnswerDecoder::new(expected, checks);
                    for progress in run(&characters, |next| match next {
                        Some(next) => decoder.push(next),
                        None => decoder.idle(),
                    }) {
                        match progress {
                            DecodeProgress::Bad(error) => assert_ne!(Some(error.failed_check()), off),
                            DecodeProgress::Frame(_) => found += 1,
                            DecodeProgress::More => {}
                        }
                    }
                }
            }
        }
        assert!(found > 1_000, "{checks:?}: {found}");
    }
}

#[test]
fn an_expectation_checks_what_is_whole_and_what_it_is_told_to() {
    let device = t7::Address::new(5).unwrap();
    assert!(Request::GetDamping.expected(device).check(&[0x05], Checks::ALL).is_err());
    let angle = isu::Request::READ_ANGLE.expected(isu::Address::ANY);
    let any_command = Checks { command: false, ..Checks::ALL };
    let mut others = 0;
    for frame in common::frames("isu", "response") {
        let function = isu::Answer::decode(&frame).unwrap().response.function();
        if function.is_some_and(|function| function != isu::Function::ReadRam) {
            assert!(angle.check(&frame, Checks::ALL).is_err() && angle.check(&frame, any_command).is_ok());
            others += 1;
        }
    }
    assert!(others >= 3, "{others}");
}

//! Decoders whose checks are known to the compiler find what those with chosen checks find: every documented answer, whole,
//! with every byte changed, with receiver errors, and behind another.

mod common;

use clino_codec::DecodeProgress;
use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::{AllChecks, Check, CheckSet, Checks};
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

/// All that is heard of a protocol's documented answers, each beside the next one.
fn all_heard(protocol: &str) -> Vec<Vec<Character>> {
    let frames = common::frames(protocol, "response");
    let others = frames.iter().cycle().skip(1);
    frames.iter().zip(others).flat_map(|(frame, other)| heard(frame, other)).collect()
}

/// A decoder of either protocol.
trait Decoder {
    type Answer;
    type Error;

    fn push(&mut self, character: Character) -> DecodeProgress<Self::Answer, Self::Error>;
    fn idle(&mut self) -> DecodeProgress<Self::Answer, Self::Error>;
    /// Characters that belong to nothing, and that may yet.
    fn rest(&self) -> (u32, usize);
}

impl<R: t7::AnswerReader> Decoder for t7::AnswerDecoder<R> {
    type Answer = t7::Answer;
    type Error = t7::DecodeError;

    fn push(&mut self, character: Character) -> t7::DecodeProgress {
        self.push(character)
    }

    fn idle(&mut self) -> t7::DecodeProgress {
        self.idle()
    }

    fn rest(&self) -> (u32, usize) {
        (self.discarded(), self.pending())
    }
}

impl<C: CheckSet> Decoder for isu::AnswerDecoder<C> {
    type Answer = isu::Answer;
    type Error = isu::DecodeError;

    fn push(&mut self, character: Character) -> isu::DecodeProgress {
        self.push(character)
    }

    fn idle(&mut self) -> isu::DecodeProgress {
        self.idle()
    }

    fn rest(&self) -> (u32, usize) {
        (self.discarded(), self.pending())
    }
}

/// What came of each character and of the silence behind them, and what belongs to nothing.
type Outcome<D> = (Vec<DecodeProgress<<D as Decoder>::Answer, <D as Decoder>::Error>>, (u32, usize));

fn run<D: Decoder>(mut decoder: D, characters: &[Character]) -> Outcome<D> {
    let mut seen: Vec<_> = characters.iter().map(|&character| decoder.push(character)).collect();
    loop {
        let progress = decoder.idle();
        let is_over = matches!(progress, DecodeProgress::More);
        seen.push(progress);
        if is_over {
            return (seen, decoder.rest());
        }
    }
}

fn frames<A, E>(seen: &[DecodeProgress<A, E>]) -> usize {
    seen.iter().filter(|progress| matches!(progress, DecodeProgress::Frame(_))).count()
}

#[test]
fn a_t7s_answer_is_read_as_it_was_asked_for() {
    let device = t7::Address::new(5).unwrap();
    let mut found = 0;
    for characters in all_heard("t7") {
        for request in T7 {
            let expected = request.expected(device);
            let mut asked = t7::AnswerDecoder::new(Request::GetDamping.expected(device), request.reader());
            asked.restart_with(expected, request.reader());
            let any = run(t7::AnswerDecoder::new(expected, Checks::ALL), &characters);
            assert_eq!(any, run(asked, &characters), "{request:?}: {characters:?}");
            found += frames(&any.0);
        }
    }
    assert!(found > 1_000, "{found}");
}

#[test]
fn what_reads_angles_alone_refuses_everything_else_whatever_it_is_told_to_wait_for() {
    let damping = Request::GetDamping.expected(t7::Address::new(5).unwrap());
    let answer = common::t7_frame(5, 0x8A, &[0, 10], true);
    let characters: Vec<Character> = answer.into_iter().map(Character::clean).collect();
    let (seen, _) = run(t7::AnswerDecoder::new(damping, Request::GetAngle(Axis::Two).reader()), &characters);
    assert!(seen.iter().any(|progress| matches!(progress, DecodeProgress::Bad(_))), "{seen:?}");
    assert_eq!(frames(&seen), 0, "{seen:?}");
}

#[test]
fn an_isus_answer_passes_all_checks_or_all_checks() {
    let mut found = 0;
    for characters in all_heard("isu") {
        for request in ISU {
            for address in [0, 3] {
                let expected = request.expected(isu::Address::new(address).unwrap());
                let chosen = run(isu::AnswerDecoder::new(expected, Checks::ALL), &characters);
                let all = run(isu::AnswerDecoder::new(expected, AllChecks), &characters);
                assert_eq!(chosen, all, "{request:?}: {characters:?}");
                found += frames(&chosen.0);
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

/// Every check alone switched off, and all of them; and what refuses nothing then.
const CHECKS_OFF: [(Option<Check>, Checks); 6] = [
    (Some(Check::LineErrors), Checks { line_errors: false, ..Checks::ALL }),
    (Some(Check::Checksum), Checks { checksum: false, ..Checks::ALL }),
    (None, Checks { address: false, ..Checks::ALL }),
    (None, Checks { command: false, ..Checks::ALL }),
    (None, Checks { length: false, ..Checks::ALL }),
    (Some(Check::Checksum), Checks::NONE),
];

#[test]
fn a_check_that_is_off_refuses_nothing() {
    let (t7s, isus) = (all_heard("t7"), all_heard("isu"));
    for (off, checks) in CHECKS_OFF {
        let (mut found, mut refused) = (0, Vec::new());
        for (characters, request) in t7s.iter().flat_map(|characters| T7.map(|request| (characters, request)))
        {
            for address in [t7::Address::new(5).unwrap(), t7::Address::ALL] {
                let (seen, _) = run(t7::AnswerDecoder::new(request.expected(address), checks), characters);
                found += frames(&seen);
                refused.extend(seen.iter().filter_map(|progress| match progress {
                    DecodeProgress::Bad(error) => Some(error.failed_check()),
                    _ => None,
                }));
            }
        }
        for (characters, request) in
            isus.iter().flat_map(|characters| ISU.map(|request| (characters, request)))
        {
            let expected = request.expected(isu::Address::new(3).unwrap());
            let (seen, _) = run(isu::AnswerDecoder::new(expected, checks), characters);
            found += frames(&seen);
            refused.extend(seen.iter().filter_map(|progress| match progress {
                DecodeProgress::Bad(error) => Some(error.failed_check()),
                _ => None,
            }));
        }
        assert!(refused.iter().all(|&check| Some(check) != off), "{checks:?}");
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

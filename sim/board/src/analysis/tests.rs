//! Logs written by hand, with figures worked out by hand.

use super::*;

const BIT_PS: u64 = 8_680_556;
const CHAR: Ns = 86_806;

/// A log under construction: a clock and what happened.
#[derive(Default)]
struct Story {
    now: Ns,
    events: Vec<LineEvent>,
}

impl Story {
    fn wait(mut self, time: Ns) -> Self {
        self.now += time;
        self
    }

    fn de(mut self, high: bool) -> Self {
        self.events.push(LineEvent::De { at: self.now, high });
        self
    }

    fn says(mut self, who: Talker, bytes: &[u8]) -> Self {
        for byte in bytes {
            let (start, end) = (self.now, self.now + CHAR);
            let fate = Fate::Clean;
            self.events.push(LineEvent::Char {
                who,
                start,
                end,
                word: u16::from(*byte),
                bit_ps: BIT_PS,
                fate,
            });
            if who != Talker::Gateway {
                self = self.hears(end - 4_340, *byte, false);
            }
            self.now = end;
        }
        self
    }

    fn hears(mut self, at: Ns, byte: u8, framing_error: bool) -> Self {
        self.events.push(LineEvent::Heard { at, word: u16::from(byte), framing_error, noise: false });
        self
    }

    /// A request with 1 µs of lead and 500 ns of tail.
    fn asks(self, bytes: &[u8]) -> Self {
        self.de(true).wait(1_000).says(Talker::Gateway, bytes).wait(500).de(false)
    }

    fn analysis(self, protocol: Protocol, end: Ns) -> Analysis {
        Analysis::of(&SegmentLog { nodes: vec!["a".into()], events: self.events }, protocol, 0..end)
    }
}

const NODE: Talker = Talker::Node(0);
// Section 2.1.4 of the T7 guide: Get Angle for Axis 2 of address 5, 20.190 degrees.
const ASK: [u8; 3] = [0x05, 0x01, 0x83];
const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0x00, 0x00, 0x4E, 0xDE, 0x46];

#[test]
fn a_good_poll_in_figures() {
    let story = Story::default().asks(&ASK).wait(2_000_000).says(NODE, &ANSWER).wait(90_000).asks(&ASK);
    let end = 2 * story.now;
    let analysis = story.analysis(Protocol::T7, end);
    let [first, second] = &analysis.polls[..] else { panic!("{:?}", analysis.polls) };
    assert_eq!((first.verdict, first.well_formed), (PollVerdict::Good, true));
    assert_eq!(first.request, ASK);
    assert_eq!(first.answer, ANSWER);
    assert_eq!(first.tail(), Some(500));
    assert_eq!(first.turnaround(), Some(90_000));
    assert!((first.lead_bits() - 1_000.0 / 8_680.556).abs() < 1e-9);
    assert_eq!((second.verdict, second.turnaround()), (PollVerdict::NoAnswer, None));
    // The run ended too soon after the second request to call it unanswered.
    let tally = Tally { polls: 1, good: 1, ..Tally::default() };
    assert_eq!(analysis.by_address[&5], tally);
    assert_eq!(analysis.total(), tally);
    assert_eq!(analysis.turnaround, Some(Extremes { min: 90_000, max: 90_000 }));
    assert_eq!(analysis.longest_de, 1_000 + 3 * CHAR + 500);
    assert!((analysis.utilisation - (14 * CHAR) as f64 / end as f64).abs() < 1e-9);
    assert_eq!(analysis.broken_rules(), Vec::<String>::new());
}

#[test]
fn the_last_request_is_unanswered_half_a_second_later() {
    let tally = |later: Ns| {
        let story = Story::default().asks(&ASK);
        let end = story.now + later;
        story.analysis(Protocol::T7, end).total()
    };
    assert_eq!(tally(499_000_000), Tally::default());
    assert_eq!(tally(501_000_000), Tally { polls: 1, no_answer: 1, ..Tally::default() });
}

#[test]
fn t7_answers_are_judged_by_the_document() {
    let judged = |request: &[u8], answer: &[u8]| {
        let story = Story::default().asks(request).wait(1_000_000).says(NODE, answer);
        story.analysis(Protocol::T7, 1_000_000_000).polls[0].verdict
    };
    assert_eq!(judged(&ASK, &ANSWER), PollVerdict::Good);
    // Behind a stray character.
    assert_eq!(judged(&ASK, &[&[0x05], &ANSWER[..]].concat()), PollVerdict::Good);
    for byte in 0..ANSWER.len() {
        for bit in 0..8 {
            let mut spoilt = ANSWER;
            spoilt[byte] ^= 1 << bit;
            assert_eq!(judged(&ASK, &spoilt), PollVerdict::BadAnswer, "byte {byte} bit {bit}");
        }
    }
    for length in 1..ANSWER.len() {
        assert_eq!(judged(&ASK, &ANSWER[..length]), PollVerdict::BadAnswer, "{length} bytes");
    }
    // Section 2.1.1: Get All Angles, with the length as printed in the example and as in the table.
    let tail = [0x80, 0, 2, 0x7D, 0xB2, 0xFF, 0xFF, 0x4E, 0xF8, 0, 0, 0x4E, 0xDE, 0x08, 0xFC];
    for (length, checksum) in [(0x0A, 0xCC), (0x10, 0xC6)] {
        let answer = [&[0x05, length][..], &tail, &[checksum]].concat();
        assert_eq!(judged(&[0x05, 0x01, 0x80], &answer), PollVerdict::Good, "{length:02x}");
    }
    // Section 2.1.5: Set Angle with status 0, and with status 3.
    let set = [0x05, 0x07, 0x84, 0x02, 0x00, 0x00, 0x29, 0x04, 0x41];
    assert_eq!(judged(&set, &[0x05, 0x03, 0x84, 0x00, 0x74]), PollVerdict::Good);
    assert_eq!(judged(&set, &[0x05, 0x03, 0x84, 0x03, 0x71]), PollVerdict::DeviceError);
}

#[test]
fn isu_answers_are_judged_by_the_document() {
    // Section 7: Read RAM 58H, 2 bytes, from address 0.
    let ask = [0x03, 0x04, 0x58, 0x02, 0x5E];
    let judged = |answer: &[u8]| {
        let story = Story::default().asks(&ask).wait(1_000_000).says(NODE, answer);
        story.analysis(Protocol::Isu, 1_000_000_000).polls[0].verdict
    };
    let answer = [0x04, 0x05, 0x58, 0x12, 0x34, 0x05 + 0x58 + 0x12 + 0x34];
    assert_eq!(judged(&answer), PollVerdict::Good);
    for byte in 1..answer.len() {
        let mut spoilt = answer;
        spoilt[byte] ^= 0x10;
        assert_eq!(judged(&spoilt), PollVerdict::BadAnswer, "byte {byte}");
    }
    // Section 4: invalid function, invalid checksum, hard error.
    for error in [&[0x01, 0xFF, 0xFF][..], &[0x01, 0xFD, 0xFD], &[0x02, 0xF1, 0x04, 0xF5]] {
        assert_eq!(judged(error), PollVerdict::DeviceError, "{error:02x?}");
    }
}

#[test]
fn requests_are_judged_too() {
    let well_formed = |protocol, request: &[u8]| {
        Story::default().asks(request).analysis(protocol, 1_000_000_000).polls[0].well_formed
    };
    assert!(well_formed(Protocol::T7, &ASK));
    assert!(well_formed(Protocol::T7, &[0x05, 0x07, 0x84, 0x02, 0x00, 0x00, 0x29, 0x04, 0x41]));
    assert!(!well_formed(Protocol::T7, &[0x05, 0x07, 0x84, 0x02, 0x00, 0x00, 0x29, 0x04, 0x42]));
    assert!(!well_formed(Protocol::T7, &[0x05, 0x02, 0x8C]));
    assert!(!well_formed(Protocol::T7, &[0x05, 0x01]));
    assert!(well_formed(Protocol::Isu, &[0x03, 0x04, 0x58, 0x02, 0x5E]));
    assert!(!well_formed(Protocol::Isu, &[0x03, 0x04, 0x58, 0x02, 0x5F]));
    assert!(!well_formed(Protocol::Isu, &[0x04, 0x05, 0x58, 0x12, 0x34, 0xA3]));
    let analysis = Story::default().asks(&[0x05]).analysis(Protocol::T7, 1_000_000_000);
    assert_eq!(analysis.malformed_requests, 1);
    assert_eq!(analysis.broken_rules().len(), 1);
}

#[test]
fn a_framing_error_spoils_an_answer_that_would_be_good() {
    let mut story = Story::default().asks(&ASK).wait(1_000_000).says(NODE, &ANSWER);
    let last = story.events.iter_mut().rev().find(|event| matches!(event, LineEvent::Heard { .. }));
    if let Some(LineEvent::Heard { framing_error, .. }) = last {
        *framing_error = true;
    }
    let analysis = story.analysis(Protocol::T7, 1_000_000_000);
    assert_eq!(analysis.polls[0].verdict, PollVerdict::BadAnswer);
    assert_eq!(analysis.framing_errors, 1);
}

#[test]
fn an_echo_is_no_answer() {
    let mut story = Story::default().de(true);
    for byte in ASK {
        let at = story.now + CHAR - 4_340;
        story = story.says(Talker::Gateway, &[byte]).hears(at, byte, false);
    }
    let analysis = story.wait(500).de(false).analysis(Protocol::T7, 1_000_000_000);
    assert_eq!(analysis.polls[0].verdict, PollVerdict::NoAnswer);
}

#[test]
fn broken_de_rules_are_found() {
    let rules = |story: Story| story.analysis(Protocol::T7, 1_000_000_000).broken_rules();
    let early = Story::default().de(true).wait(8_700).says(Talker::Gateway, &ASK).de(false);
    assert_eq!(rules(early), ["DE rose 1.00 bit times before a start bit, at most 1"]);
    let late = Story::default().de(true).says(Talker::Gateway, &ASK).wait(10_001).de(false);
    assert_eq!(rules(late), ["DE fell 10001 to 10001 ns after a stop bit, expected 0 to 10000 ns"]);
    let last = Story::default().de(true).wait(1_000).de(false).wait(1_000).de(true).wait(1_000);
    assert_eq!(
        rules(last),
        ["DE was high 1 times with nothing to send"],
        "the log ends too soon for the second"
    );
    let idle = Story::default().de(true).wait(1_000).de(false);
    assert_eq!(rules(idle), ["DE was high 1 times with nothing to send"]);
    let mut cut = Story::default().de(true).says(Talker::Gateway, &ASK);
    cut.now -= 10;
    let mut cut = cut.de(false);
    if let Some(LineEvent::Char { fate, .. }) = cut.events.get_mut(3) {
        *fate = Fate::Cut { at: 3 * CHAR - 10 };
    }
    let broken = rules(cut);
    assert_eq!(broken[0], "1 characters were cut or lost by DE");
    assert_eq!(broken[1], "DE fell -10 to -10 ns after a stop bit, expected 0 to 10000 ns");
}

#[test]
fn contentions_and_overlapping_characters_are_counted_once() {
    let mut story = Story::default().asks(&ASK).wait(1_000_000);
    let at = story.now;
    story = story.says(NODE, &[1, 2]);
    for event in story.events.clone() {
        if let LineEvent::Char { who: NODE, start, end, word, bit_ps, fate } = event {
            story.events.push(LineEvent::Char { who: Talker::Node(1), start, end, word, bit_ps, fate });
        }
    }
    let who = vec![NODE, Talker::Node(1)];
    story.events.push(LineEvent::Contention { from: at, until: story.now, who: who.clone(), fought: true });
    story.events.push(LineEvent::Contention { from: at + 9, until: story.now, who, fought: false });
    let analysis = story.analysis(Protocol::T7, 10 * CHAR * 10);
    assert_eq!(analysis.contentions, (2, 1));
    assert!((analysis.utilisation - 5.0 / 100.0).abs() < 1e-6, "{}", analysis.utilisation);
}

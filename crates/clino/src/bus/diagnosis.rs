//! The probable cause of a failure, from what the bus layer has counted, and what to do next, in order.

use clino_bus::line::EchoMode;
use clino_bus::{BusCounters, Duration};
use clino_codec::character::Character;

/// What was heard, besides what the master counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// What was said of the echo.
    pub echo: EchoMode,
    /// What was found out of it.
    pub has_echo: Option<bool>,
    /// What is allowed to the port.
    pub latency: Duration,
    /// Characters read.
    pub characters: u32,
    /// Frames that came back whole, byte by byte, and their characters.
    pub returned: u32,
    returned_characters: u32,
    /// How much of the last frame has come back, and the frame.
    matched: usize,
    frame: [u8; MAX_FRAME],
    length: usize,
}

/// The longest frame of the line.
const MAX_FRAME: usize = clino_bus::line::MAX_FRAME;

impl Seen {
    /// Nothing yet.
    pub const fn new(echo: EchoMode) -> Self {
        Self {
            echo,
            has_echo: None,
            latency: Duration::ZERO,
            characters: 0,
            returned: 0,
            returned_characters: 0,
            matched: 0,
            frame: [0; MAX_FRAME],
            length: 0,
        }
    }

    /// A frame goes out.
    pub fn sent(&mut self, frame: &[u8]) {
        self.matched = 0;
        self.length = frame.len().min(MAX_FRAME);
        self.frame.iter_mut().zip(frame).for_each(|(place, byte)| *place = *byte);
    }

    /// A character was read.
    pub fn heard(&mut self, character: Character) {
        self.characters = self.characters.wrapping_add(1);
        let fits = self.matched < self.length && self.frame.get(self.matched) == Some(&character.byte);
        // What did not begin like the frame is not its echo.
        self.matched = if fits { self.matched + 1 } else { usize::MAX };
        if fits && self.matched == self.length {
            self.returned = self.returned.wrapping_add(1);
            self.returned_characters = self.returned_characters.wrapping_add(self.length as u32);
        }
    }
}

/// The probable cause, and what to do next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// For programs.
    pub kind: &'static str,
    /// One sentence.
    pub cause: String,
    /// What to do, the most probable first.
    pub next: Vec<&'static str>,
}

/// What is asked on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Make {
    T7,
    Isu,
}

/// Who was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// One sensor.
    One,
    /// Every address.
    Scan,
    /// Every address at every bit rate.
    ScanAll,
}

/// Why nothing good came back, as far as it can be told.
pub fn diagnose(make: Make, asked: Asked, seen: &Seen, counters: &BusCounters) -> Diagnosis {
    let expects_echo = seen.echo == EchoMode::Expected;
    if expects_echo && counters.contention > 0 && seen.returned == 0 {
        return Diagnosis {
            kind: "no_echo",
            cause: "the adapter does not return what it sends, and --echo expected says that it does"
                .to_owned(),
            next: vec![
                "leave --echo out, so that it is found out",
                "check that the adapter sends: its TX lamp",
            ],
        };
    }
    if seen.echo == EchoMode::Off && seen.returned > 0 {
        return Diagnosis {
            kind: "echo",
            cause: "the adapter returns what it sends, and --echo off says that it does not".to_owned(),
            next: vec!["leave --echo out, so that it is found out, or give --echo expected"],
        };
    }
    if counters.good > 0 {
        return noise(counters);
    }
    // An echo may come too late to be known as one.
    let own = counters.echo.max(seen.returned_characters);
    let others = seen.characters.saturating_sub(own);
    if counters.late > 0 {
        return Diagnosis {
            kind: "late",
            cause: format!(
                "answers come, but later than the {} ms that this port is allowed",
                seen.latency.as_millis()
            ),
            next: vec!["allow more, such as --latency 100", "set the latency timer of the adapter to 1 ms"],
        };
    }
    if others == 0 {
        return silence(make, asked, seen);
    }
    // A character without a high stop bit; a line that is low for a whole one is the idle level upside down.
    if counters.breaks > 0 && counters.breaks.saturating_mul(2) >= counters.framing {
        return Diagnosis {
            kind: "swapped",
            cause: "the pair is low where it should be high: A and B are swapped, or it has no bias"
                .to_owned(),
            next: vec![
                "swap A and B at the adapter; makers do not agree on the names",
                "check ground and termination",
            ],
        };
    }
    if counters.framing > 0 {
        return Diagnosis {
            kind: "wrong_rate",
            cause: "characters have no stop bit: something sends at another bit rate".to_owned(),
            next: wrong_rate(make),
        };
    }
    if counters.checksum > 0 || counters.length > 0 || counters.discarded > 0 {
        return collision(make);
    }
    Diagnosis {
        kind: "foreign",
        cause: "something else than the sensor talks on this line".to_owned(),
        next: vec!["check that no other master is connected", "check that this port leads to the sensors"],
    }
}

/// Why a listener hears characters and no frame: `flawed` of them had no stop bit, `breaks` of these were zeros.
pub fn overheard(make: Make, asked: Asked, characters: usize, flawed: usize, breaks: usize) -> Diagnosis {
    let mut heard = Seen::new(EchoMode::Off);
    heard.characters = u32::try_from(characters).unwrap_or(u32::MAX);
    let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    // All bits inverted: the idle line is low, and reads as breaks between what is no character.
    if breaks > 0 && 2 * breaks >= flawed && flawed > 0 {
        let counters =
            BusCounters { breaks: count(flawed), framing: count(flawed), ..BusCounters::default() };
        return diagnose(make, asked, &heard, &counters);
    }
    if flawed > 0 {
        let counters = BusCounters { framing: count(flawed), ..BusCounters::default() };
        return diagnose(make, asked, &heard, &counters);
    }
    Diagnosis {
        kind: "foreign",
        cause: "characters come, and no frame of this protocol: another protocol or bit rate, or A and B are swapped".to_owned(),
        next: vec![
            "check that the sensors on this pair are of this make",
            "try the other bit rates with --baud: a T7 has one of five",
            "swap A and B at the adapter: makers do not agree on the names",
        ],
    }
}

/// Something answers, and is never understood.
pub fn collision(make: Make) -> Diagnosis {
    let alone = match make {
        Make::T7 => {
            "connect one sensor alone: factory-fresh T7s all have address 127; clino t7 address gives each its own"
        }
        Make::Isu => "connect one sensor alone; clino isu address gives each its own address",
    };
    Diagnosis {
        kind: "collision",
        cause: "an answer comes, and never a good one: two sensors have one address, or the line is bad"
            .to_owned(),
        next: vec![alone, "check termination at both ends, ground, and the length of the cable"],
    }
}

/// Some answers were good.
fn noise(counters: &BusCounters) -> Diagnosis {
    Diagnosis {
        kind: "noise",
        cause: format!(
            "of {} requests {} were answered well, {} not at all, {} badly: the line is bad, or a sensor went silent",
            counters.requests, counters.good, counters.no_answer, counters.bad_answer
        ),
        next: vec!["try again", "check termination at both ends, ground, and the length of the cable"],
    }
}

/// Nothing came back but our own frames: what to check, in order.
fn silence(make: Make, asked: Asked, seen: &Seen) -> Diagnosis {
    let mut next = vec!["check the supply of the sensor"];
    match (make, asked) {
        (Make::T7, Asked::One) => next.push("check the address: clino t7 scan; a factory-fresh T7 has 127"),
        (Make::T7, _) => {}
        (Make::Isu, _) => next.extend([
            "check the address: 0 with --alone reaches a module that is connected alone, whatever its address",
            "check the transceiver between adapter and module: an ISU has logic levels, and TXEN switches its driver",
            "check that RX of the module is high at power-up: held low, it prints ASCII lines and does not listen",
        ]),
    }
    next.push("swap A and B at the adapter: makers do not agree on the names");
    if make == Make::T7 && asked != Asked::ScanAll {
        next.push("check the bit rate: clino t7 scan all finds a T7 at any of the five");
    }
    next.push(
        "connect the ground of the adapter to that of the sensor; 120 ohm at both ends of a long cable",
    );
    if seen.has_echo != Some(true) {
        next.push("check that the adapter sends: one whose driver RTS switches needs --rts-de, or --rs485");
    }
    Diagnosis { kind: "silence", cause: "no sensor answers".to_owned(), next }
}

fn wrong_rate(make: Make) -> Vec<&'static str> {
    match make {
        Make::T7 => vec!["clino t7 scan all finds T7s at every bit rate", "then give --baud with that rate"],
        Make::Isu => vec!["an ISU has 9600 bit/s alone: check what else is on the line"],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(characters: u32) -> Seen {
        Seen { characters, ..Seen::new(EchoMode::Detect) }
    }

    fn kind(seen: &Seen, counters: &BusCounters) -> &'static str {
        diagnose(Make::T7, Asked::One, seen, counters).kind
    }

    #[test]
    fn each_cause_has_its_signature() {
        let asked = BusCounters { requests: 3, ..BusCounters::default() };
        let silent = BusCounters { no_answer: 3, ..asked };
        let bad = BusCounters { bad_answer: 3, ..asked };
        assert_eq!(kind(&seen(0), &silent), "silence");
        // Our own characters are no answer, not even those that come too late to be known as an echo.
        let mut late = Seen::new(EchoMode::Detect);
        for _ in 0..3 {
            late.sent(&[5, 1, 0x83]);
            [5, 1, 0x83].map(Character::clean).into_iter().for_each(|character| late.heard(character));
        }
        assert_eq!(kind(&late, &BusCounters { discarded: 9, ..bad }), "silence");
        assert_eq!(kind(&seen(9), &BusCounters { echo: 9, ..silent }), "silence");
        assert_eq!(kind(&seen(24), &BusCounters { checksum: 3, ..bad }), "collision");
        assert_eq!(kind(&seen(24), &BusCounters { discarded: 24, ..bad }), "collision");
        assert_eq!(kind(&seen(8), &BusCounters { framing: 6, breaks: 1, ..bad }), "wrong_rate");
        assert_eq!(kind(&seen(1), &BusCounters { framing: 1, breaks: 1, ..silent }), "swapped");
        assert_eq!(kind(&seen(24), &BusCounters { late: 2, ..silent }), "late");
        assert_eq!(kind(&seen(24), &BusCounters { foreign: 3, ..bad }), "foreign");
        assert_eq!(kind(&seen(24), &BusCounters { good: 1, no_answer: 2, ..asked }), "noise");
        let expected = Seen::new(EchoMode::Expected);
        assert_eq!(kind(&expected, &BusCounters { contention: 3, ..asked }), "no_echo");
        let off = Seen { returned: 3, characters: 9, ..Seen::new(EchoMode::Off) };
        assert_eq!(kind(&off, &BusCounters { discarded: 9, ..bad }), "echo");
    }

    #[test]
    fn nothing_is_advised_that_was_just_done() {
        let next = |asked| diagnose(Make::T7, asked, &seen(0), &BusCounters::default()).next.join("\n");
        assert!(next(Asked::One).contains("clino t7 scan;") && next(Asked::One).contains("scan all"));
        assert!(!next(Asked::Scan).contains("clino t7 scan;") && next(Asked::Scan).contains("scan all"));
        assert!(!next(Asked::ScanAll).contains("scan"));
    }

    #[test]
    fn a_frame_that_comes_back_whole_is_noticed() {
        let mut seen = Seen::new(EchoMode::Off);
        let mut hear = |frame: &[u8], bytes: &[u8]| {
            seen.sent(frame);
            bytes.iter().for_each(|&byte| seen.heard(Character::clean(byte)));
            seen.returned
        };
        assert_eq!(hear(&[5, 1, 0x83], &[5, 6, 0x83, 0, 0, 0x30, 0x39, 9]), 0);
        assert_eq!(hear(&[5, 1, 0x83], &[0, 5, 1, 0x83]), 0);
        assert_eq!(hear(&[5, 1, 0x83], &[5, 1, 0x83, 5, 6]), 1);
    }
}

//! A master at character level, simulated sensors as the source of answers, and a seeded generator.

#![allow(dead_code, reason = "each test file uses its own part")]

pub mod expected;
pub mod transactions;

use clino_bus::{Event, ExchangeOutcome, Fault, Instant, Master, Protocol, Timing};
use clino_codec::character::Character;
use clino_sim::node::{Heard, Node};

/// What is heard: a pause since the end of what was heard (or sent) before it, then a character.
#[derive(Clone, Copy, Debug)]
pub struct Sound {
    pub pause: u64,
    pub character: Character,
}

/// Characters back to back, the first one after `latency` µs.
pub fn sounds(latency: u64, bytes: &[u8]) -> Vec<Sound> {
    let sound = |(index, &byte)| Sound {
        pause: if index == 0 { latency } else { 0 },
        character: Character::clean(byte),
    };
    bytes.iter().enumerate().map(sound).collect()
}

/// The answer of a sensor to a command, straight from its transmitter.
pub fn answer_of(node: &mut dyn Node, command: &[u8]) -> Vec<u8> {
    let bit = 1_000_000_000 / u64::from(node.baud());
    let mut at = 1_000_000_000;
    for &byte in command {
        at += 10 * bit;
        node.hear(Heard { at, byte, framing_error: false });
    }
    while let Some(next) = node.next_event().filter(|&next| next < at + 3_000_000_000) {
        if let Some(burst) = node.act(next) {
            return burst.bytes;
        }
    }
    panic!("no answer to {command:02X?}")
}

/// A master on a computed line: frames go out at once, and the test supplies what the master hears.
pub struct Desk<P: Protocol> {
    pub master: Master<P>,
    pub now: Instant,
}

impl<P: Protocol> Desk<P> {
    pub fn new(timing: Timing) -> Self {
        Desk { master: Master::new(timing), now: Instant::from_micros(1_000) }
    }

    /// Asks as soon as the master allows; `heard` follows the last stop bit of the request, to its end even when the
    /// exchange is over before that.
    pub fn ask(&mut self, address: P::Address, request: &P::Request, heard: &[Sound]) -> ExchangeOutcome<P> {
        while let Some(at) = self.master.ask_at(address, request).filter(|&at| at > self.now) {
            assert!(self.wait(at).is_none(), "an outcome of nothing");
        }
        let frame = self.master.begin(address, request, self.now).ok().expect("a request");
        let timing = *self.master.timing();
        self.now = self.now + timing.guard + timing.serial.characters(frame.as_ref().len() as u32);
        assert!(self.master.on(Event::Released { at: self.now }).is_none());
        let mut outcome = None;
        let mut ended = self.now.as_micros() * 1_000;
        let character_ns = 10_000_000_000 / u64::from(timing.serial.baud);
        for sound in heard {
            ended += sound.pause * 1_000 + character_ns;
            // The centre of the stop bit.
            let at = Instant::from_micros((ended - character_ns / 20) / 1_000);
            let first = outcome.is_none();
            outcome = self.wait(at).or(outcome);
            let event = Event::Heard { character: sound.character, at };
            let now = self.master.on(event);
            assert!(now.is_none() || (first && outcome.is_none()), "two outcomes of one exchange");
            outcome = now.or(outcome);
        }
        while outcome.is_none() {
            let at = self.master.poll_at().expect("an exchange ends");
            outcome = self.wait(at);
        }
        self.now = self.now.max(Instant::from_micros(ended / 1_000));
        outcome.expect("an outcome")
    }

    fn wait(&mut self, until: Instant) -> Option<ExchangeOutcome<P>> {
        let mut outcome = None;
        while let Some(at) = self.master.poll_at().filter(|&at| at <= until) {
            self.now = self.now.max(at);
            let now = self.master.poll(self.now);
            assert!(now.is_none() || outcome.is_none(), "two outcomes of one exchange");
            outcome = now.or(outcome);
        }
        self.now = self.now.max(until);
        outcome
    }
}

/// Whether a fault is one that a caller can act on: every kind but the end of a collection.
pub fn is_typed<E>(fault: &Fault<E>) -> bool {
    !matches!(fault, Fault::Over { .. })
}

/// Splitmix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators" (2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Below `n`, evenly enough.
    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// True once in `n` times.
    pub fn once_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

//! A transmitter: a shift register that plays characters, and the line driver behind it.
//!
//! The shift register runs whether or not the driver is on (a UART does not know its DE pin), so what reaches
//! the line is the one masked by the other; the character's [`Fate`] says what was lost.

use std::collections::VecDeque;

use super::line::{Ps, to_ns};
use crate::log::{Fate, LineEvent, Talker};

/// A character to be shifted out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Character {
    /// Beginning of the start bit.
    pub start: Ps,
    /// Data bits, least significant first.
    pub word: u16,
    /// How many of them.
    pub data_bits: u8,
    /// Length of the stop in half bits.
    pub stop_halves: u8,
    /// Length of a bit.
    pub bit_ps: u64,
}

impl Character {
    /// End of the last stop bit.
    pub fn end(&self) -> Ps {
        let halves = 2 * (1 + u64::from(self.data_bits)) + u64::from(self.stop_halves);
        self.start + halves * self.bit_ps / 2
    }

    /// Levels from the start bit (bit 0, low) on; everything above the data bits is the stop, high.
    fn frame(&self) -> u32 {
        (u32::from(self.word) << 1) | (u32::MAX << (1 + self.data_bits))
    }
}

/// The character that is being shifted out.
#[derive(Clone, Copy, Debug)]
struct InFlight {
    character: Character,
    /// Bit now on the output, 0 for the start bit.
    bit: u8,
    driven_at_start: bool,
    /// The driver was on at some time.
    driven: bool,
    /// First time the driver was switched after the start.
    switched: Option<Ps>,
    fought: bool,
}

/// Transmitter and line driver of one participant.
#[derive(Debug)]
pub struct Driver {
    who: Talker,
    on: bool,
    switches: VecDeque<(Ps, bool)>,
    in_flight: Option<InFlight>,
    queue: VecDeque<Character>,
}

impl Driver {
    /// A silent transmitter whose driver is off.
    pub fn new(who: Talker) -> Self {
        Self { who, on: false, switches: VecDeque::new(), in_flight: None, queue: VecDeque::new() }
    }

    /// Whether the line driver is on.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// The level it drives, when it drives.
    pub fn drives(&self) -> Option<bool> {
        let shifted_out = match self.in_flight {
            Some(InFlight { character, bit, .. }) => (character.frame() >> bit) & 1 == 1,
            None => true,
        };
        self.on.then_some(shifted_out)
    }

    /// Queues a character; starts must not go back in time.
    pub fn push(&mut self, character: Character) {
        self.queue.push_back(character);
    }

    /// End of the last queued character.
    pub fn busy_until(&self) -> Option<Ps> {
        self.queue.back().map(Character::end).or(self.in_flight.map(|f| f.character.end()))
    }

    /// Switches the line driver at a later time; times must not go back. A switch that a later one at the
    /// same instant undoes is dropped, so that back-to-back bursts keep the line.
    pub fn switch_at(&mut self, at: Ps, on: bool) {
        if self.switches.back().is_some_and(|&(last, _)| last >= at) {
            self.switches.pop_back();
        } else {
            self.switches.push_back((at, on));
        }
    }

    /// Next change of anything it does to the line.
    pub fn next_edge(&self) -> Option<Ps> {
        let shift = match self.in_flight {
            Some(InFlight { character, bit, .. }) => Some(next_change(&character, bit)),
            None => self.queue.front().map(|character| character.start),
        };
        earlier(shift, self.switches.front().map(|&(at, _)| at))
    }

    /// Next time at which it drives the line, releases it or begins a character: between two of these only the
    /// bits of a known character go by.
    pub fn next_event(&self) -> Option<Ps> {
        let free = self.in_flight.map_or(0, |in_flight| in_flight.character.end());
        let begin = self.queue.front().map(|character| character.start.max(free));
        earlier(begin, self.switches.front().map(|&(at, _)| at))
    }

    /// Does everything that is due at `at`, which must not lie beyond [`Driver::next_edge`].
    pub fn step(&mut self, at: Ps, log: &mut Vec<LineEvent>) {
        // Order within an instant: the old character ends, then the driver switches, then the next begins.
        if let Some(in_flight) = &mut self.in_flight {
            if in_flight.character.end() <= at {
                self.finish(log);
            } else if next_change(&in_flight.character, in_flight.bit) <= at {
                in_flight.bit = ((at - in_flight.character.start) / in_flight.character.bit_ps) as u8;
            }
        }
        while let Some(&(when, on)) = self.switches.front()
            && when <= at
        {
            self.switches.pop_front();
            self.switch(at, on, log);
        }
        if self.in_flight.is_none()
            && let Some(&character) = self.queue.front()
            && character.start <= at
        {
            self.queue.pop_front();
            self.in_flight = Some(InFlight {
                character,
                bit: 0,
                driven_at_start: self.on,
                driven: self.on,
                switched: None,
                fought: false,
            });
        }
    }

    /// Switches the line driver now.
    pub fn switch(&mut self, at: Ps, on: bool, log: &mut Vec<LineEvent>) {
        if on == self.on {
            return;
        }
        self.on = on;
        let ns = to_ns(at);
        // What the gateway's pin does, the segment logs.
        if let Talker::Node(node) = self.who {
            log.push(LineEvent::Drive { node, at: ns, on });
        }
        if let Some(in_flight) = &mut self.in_flight {
            if in_flight.character.start == at {
                in_flight.driven_at_start = on;
                in_flight.driven = on;
            } else {
                in_flight.switched = in_flight.switched.or(Some(at));
                in_flight.driven |= on;
            }
        }
    }

    /// Another driver drives the opposite level.
    pub fn mark_fought(&mut self) {
        if let Some(in_flight) = &mut self.in_flight {
            in_flight.fought = true;
        }
    }

    /// Loses power: it releases the line and drops all queued characters.
    pub fn kill(&mut self, at: Ps, log: &mut Vec<LineEvent>) {
        self.switches.clear();
        self.queue.clear();
        self.switch(at, false, log);
        self.finish(log);
    }

    fn finish(&mut self, log: &mut Vec<LineEvent>) {
        let Some(in_flight) = self.in_flight.take() else { return };
        let fate = match in_flight.switched {
            _ if !in_flight.driven => Fate::Undriven,
            Some(at) if in_flight.driven_at_start => Fate::Cut { at: to_ns(at) },
            Some(at) => Fate::Late { at: to_ns(at) },
            None if in_flight.fought => Fate::Fought,
            None => Fate::Clean,
        };
        let Character { start, word, bit_ps, .. } = in_flight.character;
        let end = in_flight.character.end();
        log.push(LineEvent::Char { who: self.who, start: to_ns(start), end: to_ns(end), word, bit_ps, fate });
    }
}

/// Time of the next level change after `bit`, or the end of the character.
fn next_change(character: &Character, bit: u8) -> Ps {
    let frame = character.frame();
    let level = (frame >> bit) & 1;
    let differs = (frame ^ level.wrapping_neg()) >> bit;
    let next = u32::from(bit) + differs.trailing_zeros();
    if next > u32::from(character.data_bits) + 1 {
        return character.end();
    }
    character.start + u64::from(next) * character.bit_ps
}

fn earlier(a: Option<Ps>, b: Option<Ps>) -> Option<Ps> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// Characters of a burst, without a gap.
pub fn burst(start: Ps, bytes: &[u8], bit_ps: u64) -> impl Iterator<Item = Character> + '_ {
    bytes.iter().enumerate().map(move |(n, &byte)| Character {
        start: start + 10 * bit_ps * n as u64,
        word: u16::from(byte),
        data_bits: 8,
        stop_halves: 2,
        bit_ps,
    })
}

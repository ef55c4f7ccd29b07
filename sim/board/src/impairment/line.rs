//! A wire whose input is impaired.

use std::collections::VecDeque;

use clino_segment::chance::{Chance, Topic};
use clino_segment::wire::{Format, Received, Sent, Wire};
use clino_sim::node::Ns;

use super::{Character, Choice, Echo, Effect, Impaired, Impairments, OVERRUN_CHARACTERS, SharedImpairments};
use crate::timeline::PS_PER_NS;

/// Data bits without a parity bit.
const DATA_BITS: u8 = 8;
/// The parity bit above them.
const PARITY_BIT: u16 = 1 << DATA_BITS;

/// Any wire, impaired on its way to the gateway. As long as nothing is to be done it changes nothing.
pub struct ImpairedLine {
    wire: Box<dyn Wire>,
    chance: Chance,
    shared: SharedImpairments,
    receiver: Option<Format>,
    /// What comes back of what was sent, in order of time.
    echo: VecDeque<Received>,
    echoes: u64,
    /// What is on its way to the receiver, in order of time; whether the receiver is left full after it.
    coming: VecDeque<(Received, bool)>,
    /// Centre of the stop bit of the last that was put there.
    last: Ns,
    /// The same of the next one at the earliest, after one that was delayed or added.
    occupied: Ns,
    /// In the receiver, which is not emptied; until when at most.
    unread: Option<(Received, Ns)>,
    received: VecDeque<Received>,
}

/// The result of the impairments of a character.
struct Fate {
    character: Received,
    lost: bool,
    doubled: bool,
    overrun: bool,
    paused: Ns,
    before: Option<u16>,
}

impl ImpairedLine {
    /// This wire, unimpaired so far.
    pub fn new(wire: Box<dyn Wire>, chance: Chance) -> Self {
        Self {
            wire,
            chance,
            shared: SharedImpairments::default(),
            receiver: None,
            echo: VecDeque::new(),
            echoes: 0,
            coming: VecDeque::new(),
            last: 0,
            occupied: 0,
            unread: None,
            received: VecDeque::new(),
        }
    }

    /// The host's handle.
    pub fn impairments(&self) -> SharedImpairments {
        self.shared.clone()
    }

    /// Length of a character of the receiver's format.
    fn character(&self) -> Ns {
        let halves = |format: Format| 2 * u64::from(1 + format.data_bits) + u64::from(format.stop_halves);
        self.receiver.map_or(0, |format| half_bits(format, halves(format)))
    }

    fn has_parity_bit(&self) -> bool {
        self.receiver.is_some_and(|format| format.data_bits > DATA_BITS)
    }

    /// A byte with the parity of this word.
    fn like(&self, word: u16, byte: u8) -> u16 {
        // The number of ones stays even, or odd.
        let differs = (u16::from(byte) ^ word).count_ones() % 2 == 1;
        let parity = self.has_parity_bit() && differs;
        u16::from(byte) | if parity { PARITY_BIT } else { 0 }
    }

    /// Takes what the wire has received and what comes back, in order of time.
    fn take(&mut self, now: Ns) {
        let mut arrived = self.wire.take_received();
        loop {
            let echo = self.echo.front().filter(|echo| echo.at <= now);
            match (arrived, echo) {
                (Some(character), Some(echo)) if echo.at < character.at => self.take_echo(),
                (Some(character), _) => {
                    self.take_sent(character);
                    arrived = self.wire.take_received();
                }
                (None, Some(_)) => self.take_echo(),
                (None, None) => break,
            }
        }
    }

    fn take_sent(&mut self, character: Received) {
        let number = self.shared.lock().sent;
        self.shared.lock().sent += 1;
        self.impair(character, Character::Sent(number), number);
    }

    fn take_echo(&mut self) {
        if let Some(echo) = self.echo.pop_front() {
            self.echoes += 1;
            // Numbers from the other end, so that chance is another one than for what is sent.
            self.impair(echo, Character::Echo, !self.echoes);
        }
    }

    /// Does to a character what is to be done to it, and puts what is left on its way.
    fn impair(&mut self, character: Received, which: Character, number: u64) {
        let fate = self.decide(character, which, number);
        let Fate { mut character, lost, doubled, overrun, paused, before } = fate;
        let natural = which != Character::Echo && paused == 0;
        character.at += paused;
        if let Some(word) = before {
            self.put(Received { at: character.at, word, framing_error: false, noise: false }, false, false);
        }
        if !lost {
            self.put(character, natural, overrun);
            if doubled {
                self.put(character, false, false);
            }
        }
    }

    fn decide(&self, character: Received, which: Character, number: u64) -> Fate {
        let at = character.at;
        let mut fate =
            Fate { character, lost: false, doubled: false, overrun: false, paused: 0, before: None };
        let mut shared = self.shared.lock();
        let Impairments { list, log, .. } = &mut *shared;
        for (index, impairment) in (0..).zip(list.iter()) {
            let hit = match impairment.choice {
                Choice::Characters { first, count } => {
                    matches!(which, Character::Sent(n) if n >= first && n - first < count)
                }
                Choice::Random { rate, within } => {
                    within.is_none_or(|(from, until)| (from..until).contains(&at))
                        && self.chance.part(index).hit(rate, Topic::Impair, number, 0)
                }
            };
            if hit {
                let effect = self.settled(impairment.effect, self.chance.part(index), number);
                log.push(Impaired { at, character: which, word: character.word, effect });
                self.apply(effect, &mut fate);
            }
        }
        fate
    }

    /// What a bit error comes to.
    fn settled(&self, effect: Effect, chance: Chance, number: u64) -> Effect {
        if effect != Effect::BitError {
            return effect;
        }
        let data_bits = self.receiver.map_or(DATA_BITS, |format| format.data_bits);
        let stop = u64::from(data_bits) + 1;
        match chance.roll(Topic::Impair, number, 1) % (stop + 1) {
            0 => Effect::Lost,
            bit if bit == stop => Effect::FramingError,
            bit => Effect::Flipped(1 << (bit - 1)),
        }
    }

    fn apply(&self, effect: Effect, fate: &mut Fate) {
        let character = &mut fate.character;
        match effect {
            Effect::Lost => fate.lost = true,
            Effect::Doubled => fate.doubled = true,
            Effect::Inserted(byte) => fate.before = Some(self.like(character.word, byte)),
            Effect::Replaced(byte) => character.word = self.like(character.word, byte),
            Effect::Flipped(mask) => character.word ^= mask,
            Effect::FramingError => character.framing_error = true,
            Effect::Noise => character.noise = true,
            Effect::ParityError if self.has_parity_bit() => character.word ^= PARITY_BIT,
            Effect::Overrun => fate.overrun = true,
            Effect::Paused(ns) => fate.paused += ns,
            Effect::ParityError | Effect::BitError => {}
        }
    }

    /// Puts a character on its way. A natural one comes when it comes, unless something delayed or added is before it; any
    /// other comes behind what is there.
    fn put(&mut self, character: Received, natural: bool, overrun: bool) {
        let length = self.character();
        let free = if natural { self.occupied } else { self.last + length };
        let at = character.at.max(free);
        if at != character.at || !natural {
            self.occupied = at + length;
        }
        self.last = at;
        self.coming.push_back((Received { at, ..character }, overrun));
    }

    /// Hands over what has arrived.
    fn arrive(&mut self, now: Ns) {
        let full_for = OVERRUN_CHARACTERS * self.character();
        while let Some((character, overrun)) = self.coming.front().copied().filter(|(next, _)| next.at <= now)
        {
            self.coming.pop_front();
            let at = character.at;
            self.empty(at);
            // Both at once: the first fills the receiver, the second finds it full.
            if let Some((unread, _)) = self.unread.take() {
                self.received.extend([Received { at, ..unread }, character]);
            } else if overrun {
                self.unread = Some((character, at + full_for));
            } else {
                self.received.push_back(character);
            }
        }
        self.empty(now);
    }

    /// The receiver that was left full is emptied, if it is time.
    fn empty(&mut self, now: Ns) {
        if let Some((unread, until)) = self.unread.take_if(|(_, until)| *until < now) {
            self.received.push_back(Received { at: until, ..unread });
        }
    }

    fn catch_up(&mut self, now: Ns) {
        self.take(now);
        self.arrive(now);
    }
}

impl Wire for ImpairedLine {
    fn set_receiver(&mut self, now: Ns, format: Option<Format>) {
        self.wire.set_receiver(now, format);
        self.catch_up(now);
        self.receiver = format;
        if format.is_none() {
            self.coming.clear();
            self.unread = None;
        }
    }

    fn send(&mut self, sent: Sent) {
        let Sent { start, word, format } = sent;
        self.wire.send(sent);
        self.catch_up(start);
        let Some(Echo { delay, by }) = self.shared.lock().echo else { return };
        let centre = start + half_bits(format, 2 * u64::from(1 + format.data_bits) + 1);
        let (bytes, count) = by.echo(word as u8);
        for &byte in bytes.iter().take(count) {
            let at = centre + delay;
            let place = self.echo.partition_point(|echo| echo.at <= at);
            let word = self.like(word, byte);
            self.echo.insert(place, Received { at, word, framing_error: false, noise: false });
        }
    }

    fn drive_enable(&mut self, now: Ns, high: bool) {
        self.wire.drive_enable(now, high);
        self.catch_up(now);
    }

    fn next_event(&self) -> Option<Ns> {
        let echo = self.echo.front().map(|echo| echo.at);
        let coming = self.coming.front().map(|(next, _)| next.at);
        let emptied = self.unread.map(|(_, until)| until + 1);
        [self.wire.next_event(), echo, coming, emptied].into_iter().flatten().min()
    }

    fn advance(&mut self, now: Ns) {
        self.wire.advance(now);
        self.catch_up(now);
    }

    fn take_received(&mut self) -> Option<Received> {
        self.received.pop_front()
    }
}

/// This many halves of a bit, in nanoseconds.
fn half_bits(format: Format, count: u64) -> Ns {
    (count * format.bit_ps / 2).div_ceil(PS_PER_NS)
}

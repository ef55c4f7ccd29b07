//! A UART receiver that samples the line at its own bit times.
//!
//! It waits for a falling edge, checks the start bit at its centre (high there: a spike, start again), then
//! samples the centre of every bit. A low stop bit is a framing error; after it the line must go high before
//! a new start bit counts. A masked receiver (a transceiver whose RE̅ is off, with a pull-up on its output)
//! sees a high line.
//!
//! Sampling is done when the stop bit's centre is reached, looking back at the line. Noise that inverts
//! samples is decided at the falling edge.

use super::chance::{Chance, Probability, Topic};
use super::line::{Level, Line, Ps, reached};
use crate::log::{LineEvent, Talker};
use clino_sim::node::Ns;

/// What a receiver expects on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Length of a bit.
    pub bit_ps: u64,
    /// Bits between start and stop.
    pub data_bits: u8,
}

/// Disturbances of what receivers sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Noise {
    /// Probability that one sampled bit is inverted.
    pub bit_errors: Probability,
    /// Probability that a whole character is lost.
    pub drops: Probability,
    /// When the disturbance is there, `[from, until)`; always when `None`.
    pub within: Option<(Ns, Ns)>,
}

impl Noise {
    fn acts_at(&self, at: Ps) -> bool {
        self.within.is_none_or(|(from, until)| (from..until).contains(&(at / 1_000)))
    }
}

/// A character as sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Centre of the stop bit, in the first whole nanosecond after it.
    pub at: Ns,
    /// Data bits.
    pub word: u16,
    /// The stop bit was low.
    pub framing_error: bool,
    /// A sample fell where two drivers fought.
    pub noise: bool,
}

/// Start, data and stop bit as sampled, lowest bit first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Samples {
    bits: u16,
    count: u8,
    fought: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Unpowered, switched off or deaf.
    Off,
    /// After a framing error: a low line is no start bit.
    WaitHigh,
    /// Waiting for a falling edge.
    Idle,
    /// In a character that began at `start`.
    Busy {
        start: Ps,
        /// Bits that noise inverts.
        flips: u16,
        /// The start bit's centre is known to be low.
        started: bool,
        /// Samples taken so far under an earlier mask.
        taken: Samples,
        /// The mask has not changed since the start.
        whole: bool,
    },
}

/// The last character decoded from the line. Receivers of the same rate that see the same falling edge sample
/// the same instants, so 32 nodes need not do it 32 times.
#[derive(Debug, Default)]
pub struct Shared {
    key: Option<(Ps, Sampling)>,
    samples: Samples,
}

/// One receiver.
#[derive(Debug)]
pub struct Receiver {
    who: Talker,
    chance: Chance,
    sampling: Sampling,
    masked: bool,
    state: State,
}

impl Receiver {
    /// A receiver that is switched off.
    pub fn new(who: Talker, chance: Chance) -> Self {
        let sampling = Sampling { bit_ps: 1, data_bits: 8 };
        Self { who, chance, sampling, masked: false, state: State::Off }
    }

    /// Length of its bits while it is on.
    pub fn bit_ps(&self) -> Option<u64> {
        (self.state != State::Off).then_some(self.sampling.bit_ps)
    }

    /// Switches it on with this format; no effect when it is on with the same one.
    pub fn switch_on(&mut self, sampling: Sampling, line: Level) {
        if self.state == State::Off || self.sampling != sampling {
            self.sampling = sampling;
            self.state = if line.high || self.masked { State::Idle } else { State::WaitHigh };
        }
    }

    /// Switches it off; a character in progress is lost.
    pub fn switch_off(&mut self) {
        self.state = State::Off;
    }

    /// Masks or unmasks the line.
    pub fn mask(&mut self, at: Ps, masked: bool, line: &Line, noise: &Noise) {
        if masked == self.masked {
            return;
        }
        self.take_until(at, line);
        self.masked = masked;
        if !line.now().high {
            // The mask hides or uncovers a low line: the receiver sees an edge.
            self.edge(at, masked, noise);
        }
    }

    /// The line changed. Called for every change, in order.
    pub fn line_changed(&mut self, at: Ps, high: bool, noise: &Noise) {
        if !self.masked {
            self.edge(at, high, noise);
        }
    }

    /// When the character in progress is complete.
    pub fn due(&self) -> Option<Ps> {
        match self.state {
            State::Busy { start, .. } => Some(self.centre(start, self.sampling.data_bits + 1)),
            _ => None,
        }
    }

    /// Completes the character whose [`Receiver::due`] has come; nothing if it was a spike or got lost.
    pub fn complete(
        &mut self,
        line: &Line,
        noise: &Noise,
        shared: &mut Shared,
        log: &mut Vec<LineEvent>,
    ) -> Option<Sampled> {
        let due = self.due()?;
        let State::Busy { start, flips, whole, .. } = self.state else { return None };
        let key = (start, self.sampling);
        let samples = if whole && !self.masked && shared.key == Some(key) {
            shared.samples
        } else {
            self.take_until(due + 1, line);
            let State::Busy { taken, .. } = self.state else { return None };
            if whole && !self.masked {
                *shared = Shared { key: Some(key), samples: taken };
            }
            taken
        };
        let high_now = self.masked || line.now().high;
        self.state = State::Idle;
        let bits = samples.bits ^ flips;
        if bits & 1 == 1 {
            return None;
        }
        let stop_low = (bits >> (self.sampling.data_bits + 1)) & 1 == 0;
        if stop_low && !high_now {
            self.state = State::WaitHigh;
        }
        if flips != 0 {
            log.push(LineEvent::Flipped { receiver: self.who, at: start / 1_000, bits: flips });
        }
        if noise.acts_at(start) && self.chance.hit(noise.drops, Topic::Drop, start, 0) {
            log.push(LineEvent::Dropped { receiver: self.who, at: reached(due) });
            return None;
        }
        let word = (bits >> 1) & !(u16::MAX << self.sampling.data_bits);
        Some(Sampled { at: reached(due), word, framing_error: stop_low, noise: samples.fought })
    }

    fn centre(&self, start: Ps, bit: u8) -> Ps {
        start + (2 * u64::from(bit) + 1) * self.sampling.bit_ps / 2
    }

    /// An edge as the receiver sees it, behind its mask.
    fn edge(&mut self, at: Ps, high: bool, noise: &Noise) {
        match &mut self.state {
            State::WaitHigh if high => self.state = State::Idle,
            State::Idle if !high => self.begin(at, noise),
            &mut State::Busy { start, flips, ref mut started, .. } if !*started => {
                let start_centre = start + self.sampling.bit_ps / 2;
                if at > start_centre {
                    // First edge after the start bit's centre: there the line had the opposite level.
                    let sampled_high = !high ^ (flips & 1 == 1);
                    *started = !sampled_high;
                    if sampled_high {
                        self.state = State::Idle;
                        if !high {
                            self.begin(at, noise);
                        }
                    }
                }
            }
            _ => {}
        }
    }

    fn begin(&mut self, start: Ps, noise: &Noise) {
        let mut flips = 0;
        if noise.bit_errors != Probability::NEVER && noise.acts_at(start) {
            for bit in 0..self.sampling.data_bits + 2 {
                let hit = self.chance.hit(noise.bit_errors, Topic::Flip, start, u64::from(bit));
                flips |= u16::from(hit) << bit;
            }
        }
        self.state = State::Busy { start, flips, started: false, taken: Samples::default(), whole: true };
    }

    /// Takes the samples whose instants lie before `until` under the present mask.
    fn take_until(&mut self, until: Ps, line: &Line) {
        let (sampling, masked, last) = (self.sampling, self.masked, self.sampling.data_bits + 2);
        let State::Busy { start, taken, whole, .. } = &mut self.state else { return };
        let centre = |bit: u8| *start + (2 * u64::from(bit) + 1) * sampling.bit_ps / 2;
        let mut sampler = line.sampler(centre(taken.count));
        while taken.count < last && centre(taken.count) < until {
            let level = if masked { Level::IDLE } else { sampler.level(centre(taken.count)) };
            taken.bits |= u16::from(level.high) << taken.count;
            taken.fought |= level.fought;
            taken.count += 1;
        }
        *whole = false;
    }
}

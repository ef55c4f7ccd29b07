//! The level of the line over time.
//!
//! A piecewise constant function: what all drivers together make of the pair of wires. Undriven, the bias
//! resistors hold it high. Where two drivers oppose each other, what a receiver sees is not defined; here it
//! is decided by chance for each piece, so that neither gets through.

use std::collections::VecDeque;

use clino_sim::node::Ns;

/// Time in picoseconds: bit edges are not on whole nanoseconds. 64 bits last for 213 days.
pub type Ps = u64;

const PS_PER_NS: u64 = 1_000;

/// Nanoseconds to picoseconds.
pub fn to_ps(ns: Ns) -> Ps {
    ns * PS_PER_NS
}

/// The nanosecond in which `ps` lies.
pub fn to_ns(ps: Ps) -> Ns {
    ps / PS_PER_NS
}

/// The first whole nanosecond at which `ps` has been reached.
pub fn reached(ps: Ps) -> Ns {
    ps.div_ceil(PS_PER_NS)
}

/// What the line does in one piece of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// The differential pair reads as a one.
    pub high: bool,
    /// Two drivers oppose each other.
    pub fought: bool,
}

impl Level {
    /// No driver is on, or all drive high.
    pub const IDLE: Self = Self { high: true, fought: false };
}

/// The line's past, as far back as a receiver may still have to look.
#[derive(Debug)]
pub struct Line {
    pieces: VecDeque<(Ps, Level)>,
}

impl Line {
    /// A line that has always been idle.
    pub fn new() -> Self {
        Self { pieces: VecDeque::from([(0, Level::IDLE)]) }
    }

    /// The level now, that is since the last change.
    pub fn now(&self) -> Level {
        self.pieces.back().map_or(Level::IDLE, |&(_, level)| level)
    }

    /// A new piece begins; `at` must not go back. Returns whether the sampled level changed.
    pub fn set(&mut self, at: Ps, level: Level) -> bool {
        let before = self.now();
        if before != level {
            self.pieces.push_back((at, level));
        }
        before.high != level.high
    }

    /// Levels at instants that come in rising order. An edge belongs to the piece it begins.
    pub fn sampler(&self, from: Ps) -> Sampler<'_> {
        let index = self.pieces.partition_point(|&(at, _)| at <= from).saturating_sub(1);
        Sampler { line: self, index }
    }

    /// Forgets what came before `horizon`.
    pub fn forget(&mut self, horizon: Ps) {
        while self.pieces.get(1).is_some_and(|&(at, _)| at <= horizon) {
            self.pieces.pop_front();
        }
    }

    /// How many pieces are kept.
    #[cfg(test)]
    pub fn remembered(&self) -> usize {
        self.pieces.len()
    }
}

/// Reads a [`Line`] forwards.
#[derive(Debug)]
pub struct Sampler<'a> {
    line: &'a Line,
    index: usize,
}

impl Sampler<'_> {
    /// The level at `at`.
    pub fn level(&mut self, at: Ps) -> Level {
        while self.line.pieces.get(self.index + 1).is_some_and(|&(from, _)| from <= at) {
            self.index += 1;
        }
        self.line.pieces.get(self.index).map_or(Level::IDLE, |&(_, level)| level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOW: Level = Level { high: false, fought: false };

    #[test]
    fn samples_the_piece_that_an_instant_lies_in() {
        let mut line = Line::new();
        assert!(line.set(100, LOW));
        assert!(!line.set(150, LOW));
        assert!(line.set(200, Level::IDLE));
        for from in [0, 99, 100, 199, 200] {
            let mut sampler = line.sampler(from);
            let seen: Vec<bool> =
                [from, 200, 300].into_iter().map(|at| sampler.level(at.max(from)).high).collect();
            assert_eq!(seen, [!(100..200).contains(&from), true, true], "from {from}");
        }
    }

    #[test]
    fn forgets_only_what_no_receiver_can_ask_for() {
        let mut line = Line::new();
        line.set(100, LOW);
        line.set(200, Level::IDLE);
        line.forget(150);
        assert_eq!(line.sampler(150).level(150), LOW);
        line.forget(1_000);
        assert_eq!(line.pieces.len(), 1);
        assert_eq!(line.sampler(1_000).level(1_000), Level::IDLE);
    }

    #[test]
    fn a_picosecond_is_reached_in_the_next_whole_nanosecond() {
        assert_eq!((reached(1_000), reached(1_001), to_ns(1_999)), (1, 2, 1));
    }
}

//! Counters of one bus since reset, from the master and from the hardware. Counters wrap; readers take differences.

use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::Check;

use crate::Duration;

/// Counts per bus, one for each kind of fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusCounters {
    /// Requests handed to the line, retries included.
    pub requests: u32,
    /// Of these, repetitions of a request that failed.
    pub retries: u32,
    /// Of these, requests that change a sensor's non-volatile memory, which wears.
    pub writes: u32,
    /// Answers that passed every check.
    pub good: u32,
    /// Of these, answers to the first try.
    pub first_try: u32,
    /// Requests to which nothing came back in time.
    pub no_answer: u32,
    /// Requests to which something came back that was not the answer; the next three say what, and count every
    /// frame.
    pub bad_answer: u32,
    /// Frames with a wrong checksum.
    pub checksum: u32,
    /// Frames with a wrong length.
    pub length: u32,
    /// Intact answers from another address or to another command than was asked.
    pub foreign: u32,
    /// Good answers that came after their deadline; never credited to anyone.
    pub late: u32,
    /// The line driver had to be switched off by force.
    pub forced: u32,
    /// Requests dropped because the line did not fall silent.
    pub line_busy: u32,
    /// Requests during which another node transmitted, as our own echo showed.
    pub contention: u32,
    /// Our own characters that came back.
    pub echo: u32,
    /// Characters that belong to no frame.
    pub discarded: u32,
    /// Characters that came before a request was out: unsolicited.
    pub unasked: u32,
    /// Characters with a low stop bit.
    pub framing: u32,
    /// Of these, characters of nothing but zeros: the line was low for a character at least.
    pub breaks: u32,
    /// Characters whose samples disagreed.
    pub noise: u32,
    /// Characters after which at least one was lost.
    pub overrun: u32,
    /// Characters with wrong parity.
    pub parity: u32,
    /// From our last stop bit to the end of the first character of the last good answer (here and below, answers with
    /// stray characters before them are left out).
    pub response_last: Duration,
    /// The shortest of these; zero while there was none.
    pub response_min: Duration,
    /// The longest of these.
    pub response_max: Duration,
}

/// How the line driver behaved, as the hardware measured it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriverEnable {
    /// Longest time from the end of a frame's last stop bit to DE low, post-delay left out, in nanoseconds.
    pub release_max_ns: u32,
    /// Longest time DE was high, in microseconds.
    pub high_max_us: u32,
}

impl BusCounters {
    pub(crate) fn character(&mut self, Character { byte, errors }: Character) {
        let count = |flag, counter: &mut u32| {
            if errors.contains(flag) {
                bump(counter);
            }
        };
        count(LineErrors::FRAMING, &mut self.framing);
        count(LineErrors::NOISE, &mut self.noise);
        count(LineErrors::OVERRUN, &mut self.overrun);
        count(LineErrors::PARITY, &mut self.parity);
        if byte == 0 {
            count(LineErrors::FRAMING, &mut self.breaks);
        }
    }

    pub(crate) fn refused(&mut self, check: Check) {
        match check {
            Check::Checksum => bump(&mut self.checksum),
            Check::Length => bump(&mut self.length),
            Check::Address | Check::Command => bump(&mut self.foreign),
            Check::LineErrors | Check::Value => {}
        }
    }

    pub(crate) fn response(&mut self, time: Duration) {
        if self.response_min == Duration::ZERO || time < self.response_min {
            self.response_min = time;
        }
        self.response_last = time;
        self.response_max = self.response_max.max(time);
    }
}

/// One more.
pub(crate) fn bump(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}

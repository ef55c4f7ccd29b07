//! What happened on one bus since reset. Counters wrap; readers take differences.

use clino_codec::character::LineErrors;

use crate::Micros;

/// Counts per bus, one for each kind of fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Requests handed to the line.
    pub requests: u32,
    /// Answers that passed every check.
    pub good: u32,
    /// Nothing came back in time.
    pub no_answer: u32,
    /// Something came back that was not the answer (checksum, length, command, line errors).
    pub bad_answer: u32,
    /// A good answer that came after its deadline; never credited to anyone.
    pub late: u32,
    /// The line driver had to be switched off by force.
    pub forced: u32,
    /// A request was dropped because the line did not fall silent.
    pub line_busy: u32,
    /// Characters that belong to no frame.
    pub junk: u32,
    /// Characters with a low stop bit.
    pub framing: u32,
    /// Characters whose samples disagreed.
    pub noise: u32,
    /// Characters after which at least one was lost.
    pub overrun: u32,
    /// Characters with wrong parity.
    pub parity: u32,
    /// From DE low to the end of the first character of the last answer.
    pub response_last: Micros,
    /// The longest of these.
    pub response_max: Micros,
}

impl Counters {
    pub(crate) fn character(&mut self, errors: LineErrors) {
        let count = |flag, counter: &mut u32| {
            if errors.contains(flag) {
                bump(counter);
            }
        };
        count(LineErrors::FRAMING, &mut self.framing);
        count(LineErrors::NOISE, &mut self.noise);
        count(LineErrors::OVERRUN, &mut self.overrun);
        count(LineErrors::PARITY, &mut self.parity);
    }

    pub(crate) fn response(&mut self, time: Micros) {
        self.response_last = time;
        self.response_max = self.response_max.max(time);
    }
}

/// One more.
pub(crate) fn bump(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}

//! What happened to one slot since reset. Counters wrap; readers take differences.

use clino_bus::{Duration, Fault};
use clino_codec::checks::Check;

/// Microseconds of a count of response time.
const RESPONSE_STEP_US: u32 = 10;

/// Counts of one slot. 40 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotCounters {
    /// Requests handed to the line, retries and probes included.
    pub requests: u32,
    /// Requests that were answered by a good answer without a retry.
    pub first_try: u32,
    /// Of the requests, repetitions of one that failed.
    pub retries: u32,
    /// Requests to which nothing came back in time.
    pub no_answer: u32,
    /// Readings that were never begun, because the bus was too busy in their whole period.
    pub skipped: u16,
    /// Answers with a wrong checksum.
    pub checksum: u16,
    /// Answers with a wrong length.
    pub length: u16,
    /// Answers from another address or to another command.
    pub foreign: u16,
    /// Answers with a character that the receiver flagged as wrong, characters that make no answer, and requests during
    /// which another sender transmitted.
    pub garbled: u16,
    /// Answers that refuse the request, or have a value out of its range.
    pub refused: u16,
    /// Requests that did not get out.
    pub not_sent: u16,
    /// Good answers that came after their deadline.
    pub late: u16,
    /// Requests that change the sensor's non-volatile memory, which wears.
    pub writes: u16,
    response: [u16; 3],
}

impl SlotCounters {
    /// From our last stop bit to the end of the first character of the last good answer, to 10 µs.
    pub fn response_last(&self) -> Duration {
        self.response(0)
    }

    /// The shortest of these; zero while there was none.
    pub fn response_min(&self) -> Duration {
        self.response(1)
    }

    /// The longest of these.
    pub fn response_max(&self) -> Duration {
        self.response(2)
    }

    fn response(&self, which: usize) -> Duration {
        let steps = self.response.get(which).copied().unwrap_or(0);
        Duration::from_micros(RESPONSE_STEP_US).times(steps.into())
    }

    pub(crate) fn answered(&mut self, time: Duration) {
        let steps = u16::try_from(time.as_micros() / RESPONSE_STEP_US).unwrap_or(u16::MAX);
        let [_, min, max] = self.response;
        let min = if min == 0 { steps } else { min.min(steps) };
        self.response = [steps, min, max.max(steps)];
    }

    pub(crate) fn failed(&mut self, fault: &Fault<Check>) {
        let counter = match fault {
            Fault::NoAnswer { .. } => return bump32(&mut self.no_answer),
            Fault::Garbled { .. } | Fault::Contention => &mut self.garbled,
            Fault::Bad(check) => match check {
                Check::LineErrors => &mut self.garbled,
                Check::Checksum => &mut self.checksum,
                Check::Length => &mut self.length,
                Check::Address | Check::Command => &mut self.foreign,
                Check::Value => &mut self.refused,
            },
            Fault::LineBusy | Fault::NotSent | Fault::Over { .. } => &mut self.not_sent,
        };
        bump16(counter);
    }
}

pub(crate) fn bump16(counter: &mut u16) {
    *counter = counter.wrapping_add(1);
}

pub(crate) fn bump32(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}

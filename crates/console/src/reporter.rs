//! Which slot is printed next, when the console is slower than the sensors.
//!
//! A slot is printed when it has an outcome that was not printed yet and its reporting interval has passed. Among
//! several, the one with the earliest deadline goes first: a slot with a short interval is printed ahead of one with a
//! long interval, and none starves. A change of status or of an alarm goes ahead of everything. What is not printed in
//! time is replaced by its successor: a slow console shows fewer readings, never old ones.

use clino_bus::Instant;

use clino_gateway::{Alarm, Alarms, MAX_SLOTS, ReadingBrief, Stamp, Status};

/// What was printed of a slot. Small: there is one for each slot, on the stack of the main loop.
#[derive(Clone, Copy, Default)]
struct Printed {
    /// Only tells whether there was another outcome since.
    sequence: u16,
    status: Option<Status>,
    alarms: Alarms,
    at: Stamp,
}

/// What is printed next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamEntry {
    /// Number of the slot.
    pub slot: usize,
    /// The alarm whose state has changed; `None` if the reading is printed.
    pub alarm: Option<Alarm>,
}

/// Chooses the next reading to print.
pub struct Reporter {
    printed: [Printed; MAX_SLOTS],
}

impl Reporter {
    /// A reporter that has printed nothing yet.
    pub fn new() -> Reporter {
        Reporter { printed: [Printed::default(); MAX_SLOTS] }
    }

    /// The slot to be printed now, if any; it counts as printed. A change of an alarm goes first, one alarm at a time.
    /// `look` looks at a slot as of `now`, and returns `None` from the first slot on that there is not.
    pub fn next(
        &mut self,
        look: impl Fn(usize) -> Option<ReadingBrief>,
        now: Instant,
    ) -> Option<StreamEntry> {
        let mut most_urgent: Option<(Instant, usize, ReadingBrief)> = None;
        for (slot, printed) in self.printed.iter().enumerate() {
            let Some(brief) = look(slot) else { break };
            if let Some(deadline) = deadline(&brief, printed, now)
                && most_urgent.is_none_or(|(earliest, ..)| deadline < earliest)
            {
                most_urgent = Some((deadline, slot, brief));
            }
        }
        let (_, slot, ReadingBrief { sequence, status, alarms, .. }) = most_urgent?;
        let printed = self.printed.get_mut(slot)?;
        let alarm = printed.alarms.first_change(alarms);
        match alarm {
            Some(alarm) => printed.alarms = printed.alarms.with(alarm, alarms),
            None => {
                let (sequence, at) = (sequence as u16, Stamp::of(now));
                *printed = Printed { sequence, status: Some(status), at, ..*printed };
            }
        }
        Some(StreamEntry { slot, alarm })
    }
}

impl Default for Reporter {
    fn default() -> Self {
        Reporter::new()
    }
}

/// By when the reading should be printed, if it should: at once when its status has changed, else within one more
/// interval after its interval has passed.
fn deadline(brief: &ReadingBrief, printed: &Printed, now: Instant) -> Option<Instant> {
    if brief.alarms != printed.alarms {
        return Some(Instant::ZERO);
    }
    let status = brief.status;
    if printed.status != Some(status) {
        let says_nothing = match status {
            Status::Disabled => true,
            // At the start. Later it takes back what was printed before.
            Status::NeverRead => printed.status.is_none(),
            _ => false,
        };
        return (!says_nothing).then_some(Instant::ZERO);
    }
    let at = printed.at.near(now);
    let interval = brief.report_every.max(brief.period);
    let is_due = brief.sequence as u16 != printed.sequence && now >= at + brief.report_every;
    is_due.then(|| at + interval + interval)
}

#[cfg(test)]
mod tests;

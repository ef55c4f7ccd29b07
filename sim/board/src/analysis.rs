//! Figures of a bus, computed from its wire log only.
//!
//! The log is cut into polls at the edges of DE: what the gateway sent while DE was high is the request, what
//! it heard until the next rise is the answer. Both are judged by the vendors' documents (`analysis/t7.rs`,
//! `analysis/isu.rs`) with no help from the gateway's own codec.

mod isu;
mod t7;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;

use clino_sim::node::Ns;

use clino_segment::log::{Fate, LineEvent, SegmentLog, Talker};

/// Largest time from DE's rise to the first start bit, in bit times.
pub const MOST_LEAD_BITS: f64 = 1.0;
/// Largest time from the end of the last stop bit to DE's fall, in nanoseconds.
pub const MOST_TAIL: Ns = 10_000;

/// Which document a bus follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// US Digital T7.
    T7,
    /// STT ISU, binary mode.
    Isu,
}

/// The result of a poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PollVerdict {
    /// A whole answer to this request, with the right checksum.
    Good,
    /// Nothing was heard.
    NoAnswer,
    /// Something was heard, but no answer to this request.
    BadAnswer,
    /// A well-formed answer in which the device reports an error.
    DeviceError,
}

/// Requests that follow an answer sooner than this, in nanoseconds, were waiting for it: ten times the guard of one
/// character at 115200 bit/s, and less than the gateway's shortest period.
pub const BACK_TO_BACK: i64 = 1_000_000;

/// No exchange takes longer: the message timeout of the ISU is 400 ms, that of the T7 500 ms.
const LONGEST_EXCHANGE: Ns = 500_000_000;

/// One request and what followed it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Poll {
    /// DE rose.
    pub de_high: Ns,
    /// First start bit of the request.
    pub first_start: Ns,
    /// End of the last stop bit of the request.
    pub last_stop: Ns,
    /// DE fell; `None` if the run ended before.
    pub de_low: Option<Ns>,
    /// Length of a bit in picoseconds.
    pub bit_ps: u64,
    /// What the gateway sent.
    pub request: Vec<u8>,
    /// The request keeps to the document.
    pub well_formed: bool,
    /// What the gateway heard until DE's next rise, framing errors included.
    pub answer: Vec<u8>,
    /// End of the last stop bit of the last sensor that spoke.
    pub answer_end: Option<Ns>,
    /// DE's next rise.
    pub next_de_high: Option<Ns>,
    /// Its result.
    pub verdict: PollVerdict,
}

impl Poll {
    /// Address of the sensor asked.
    pub fn address(&self, protocol: Protocol) -> Option<u8> {
        match protocol {
            Protocol::T7 => self.request.first().copied(),
            Protocol::Isu => self.request.get(1).map(|byte| byte >> 4),
        }
    }

    /// Whether the run ended at `end` before the poll could have a result.
    pub fn is_open(&self, end: Ns) -> bool {
        self.next_de_high.is_none()
            && self.verdict != PollVerdict::Good
            && end < self.last_stop + LONGEST_EXCHANGE
    }

    /// DE's rise to the first start bit, in bit times.
    pub fn lead_bits(&self) -> f64 {
        (self.first_start - self.de_high) as f64 * 1_000.0 / self.bit_ps as f64
    }

    /// End of the last stop bit to DE's fall, in nanoseconds; negative if DE fell too early.
    pub fn tail(&self) -> Option<i64> {
        self.de_low.map(|low| low.cast_signed() - self.last_stop.cast_signed())
    }

    /// End of an answer to DE's next rise; negative if DE rose into it.
    pub fn turnaround(&self) -> Option<i64> {
        Some(self.next_de_high?.cast_signed() - self.answer_end?.cast_signed())
    }
}

/// Smallest and largest of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes<T> {
    /// The smallest.
    pub min: T,
    /// The largest.
    pub max: T,
}

impl<T: PartialOrd + Copy> Extremes<T> {
    /// Of some values; `None` if there are none.
    pub fn of(values: impl Iterator<Item = T>) -> Option<Self> {
        values.fold(None, |so_far: Option<Self>, value| {
            let Self { min, max } = so_far.unwrap_or(Self { min: value, max: value });
            Some(Self {
                min: if value < min { value } else { min },
                max: if value > max { value } else { max },
            })
        })
    }
}

/// How the polls of one sensor came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Requests.
    pub polls: u64,
    /// [`PollVerdict::Good`].
    pub good: u64,
    /// [`PollVerdict::NoAnswer`].
    pub no_answer: u64,
    /// [`PollVerdict::BadAnswer`].
    pub bad_answer: u64,
    /// [`PollVerdict::DeviceError`].
    pub device_error: u64,
}

/// A bus in figures.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Which document it was judged by.
    pub protocol: Protocol,
    /// Every poll, in order.
    pub polls: Vec<Poll>,
    /// Polls by the address asked.
    pub by_address: BTreeMap<u8, Tally>,
    /// DE's rise to the first start bit, in bit times.
    pub lead_bits: Option<Extremes<f64>>,
    /// End of the last stop bit to DE's fall, in nanoseconds.
    pub tail: Option<Extremes<i64>>,
    /// End of an answer to DE's next rise, in nanoseconds.
    pub turnaround: Option<Extremes<i64>>,
    /// The same for requests that were due already when the answer ended, which is taken to be so for those that
    /// follow within [`BACK_TO_BACK`].
    pub back_to_back: Option<Extremes<i64>>,
    /// Longest time that DE was high.
    pub longest_de: Ns,
    /// Times that DE was high without anything being sent.
    pub idle_de: u64,
    /// The gateway's characters that did not reach the line whole because of DE.
    pub broken_characters: u64,
    /// Requests that do not keep to the document.
    pub malformed_requests: u64,
    /// Characters that the gateway heard with a framing error.
    pub framing_errors: u64,
    /// Times that two drivers were on at once, and among them those that drove opposite levels.
    pub contentions: (u64, u64),
    /// Share of the time in which a character was on the line, 0…1.
    pub utilisation: f64,
    /// Beginning of the time that all this is about.
    pub since: Ns,
}

impl Analysis {
    /// Analyses a log that covers this time.
    pub fn of(log: &SegmentLog, protocol: Protocol, time: Range<Ns>) -> Self {
        let Range { start: since, end } = time;
        let events = log.in_order();
        let polls = polls(&events, protocol);
        let mut by_address: BTreeMap<u8, Tally> = BTreeMap::new();
        let settled = |poll: &&Poll| !poll.is_open(end);
        for poll in polls.iter().filter(settled) {
            let tally = by_address.entry(poll.address(protocol).unwrap_or(0)).or_default();
            tally.polls += 1;
            *match poll.verdict {
                PollVerdict::Good => &mut tally.good,
                PollVerdict::NoAnswer => &mut tally.no_answer,
                PollVerdict::BadAnswer => &mut tally.bad_answer,
                PollVerdict::DeviceError => &mut tally.device_error,
            } += 1;
        }
        let de = de_pulses(&events);
        // DE has just risen when the log ends: its first character is logged when it is out.
        let just_risen = |&&(rise, fall): &&(Ns, Option<Ns>)| {
            fall.is_none() && polls.last().is_none_or(|poll| poll.de_high < rise)
        };
        let just_risen = de.last().filter(just_risen).map_or(0, |_| 1);
        let count =
            |wanted: fn(&LineEvent) -> bool| events.iter().filter(|event| wanted(event)).count() as u64;
        Self {
            protocol,
            by_address,
            lead_bits: Extremes::of(polls.iter().map(Poll::lead_bits)),
            tail: Extremes::of(polls.iter().filter_map(Poll::tail)),
            turnaround: Extremes::of(polls.iter().filter_map(Poll::turnaround)),
            back_to_back: Extremes::of(
                polls.iter().filter_map(Poll::turnaround).filter(|&turnaround| turnaround < BACK_TO_BACK),
            ),
            longest_de: de
                .iter()
                .map(|&(rise, fall)| fall.unwrap_or(end).saturating_sub(rise))
                .max()
                .unwrap_or(0),
            idle_de: (de.len() - polls.len() - just_risen) as u64,
            broken_characters: count(|event| match event {
                LineEvent::Char { who: Talker::Gateway, fate, .. } => {
                    matches!(fate, Fate::Cut { .. } | Fate::Late { .. } | Fate::Undriven)
                }
                _ => false,
            }),
            malformed_requests: polls.iter().filter(settled).filter(|poll| !poll.well_formed).count() as u64,
            framing_errors: count(|event| matches!(event, LineEvent::Heard { framing_error: true, .. })),
            contentions: (
                count(|event| matches!(event, LineEvent::Contention { .. })),
                count(|event| matches!(event, LineEvent::Contention { fought: true, .. })),
            ),
            utilisation: utilisation(&events, since, end),
            polls,
            since,
        }
    }

    /// The whole bus's tally.
    pub fn total(&self) -> Tally {
        self.by_address.values().fold(Tally::default(), |sum, tally| Tally {
            polls: sum.polls + tally.polls,
            good: sum.good + tally.good,
            no_answer: sum.no_answer + tally.no_answer,
            bad_answer: sum.bad_answer + tally.bad_answer,
            device_error: sum.device_error + tally.device_error,
        })
    }

    /// Rules about DE and requests that were broken, in words.
    pub fn broken_rules(&self) -> Vec<String> {
        let mut broken = Vec::new();
        if self.broken_characters > 0 {
            broken.push(format!("{} characters were cut or lost by DE", self.broken_characters));
        }
        if let Some(lead) = self.lead_bits.filter(|lead| lead.max > MOST_LEAD_BITS) {
            let most = MOST_LEAD_BITS;
            broken.push(format!("DE rose {:.2} bit times before a start bit, at most {most}", lead.max));
        }
        if let Some(tail) = self.tail.filter(|tail| tail.min < 0 || tail.max > MOST_TAIL.cast_signed()) {
            let (min, max) = (tail.min, tail.max);
            broken.push(format!("DE fell {min} to {max} ns after a stop bit, expected 0 to {MOST_TAIL} ns"));
        }
        if self.idle_de > 0 {
            broken.push(format!("DE was high {} times with nothing to send", self.idle_de));
        }
        if self.malformed_requests > 0 {
            broken.push(format!("{} requests do not keep to the document", self.malformed_requests));
        }
        broken
    }
}

/// Rises and falls of DE.
fn de_pulses(events: &[&LineEvent]) -> Vec<(Ns, Option<Ns>)> {
    let mut pulses: Vec<(Ns, Option<Ns>)> = Vec::new();
    for event in events {
        match **event {
            LineEvent::De { at, high: true } => pulses.push((at, None)),
            LineEvent::De { at, high: false } => {
                if let Some((_, fall)) = pulses.last_mut() {
                    *fall = Some(at);
                }
            }
            _ => {}
        }
    }
    pulses
}

/// Cuts a log into polls; DE pulses in which nothing was sent are none.
fn polls(events: &[&LineEvent], protocol: Protocol) -> Vec<Poll> {
    let pulses = de_pulses(events);
    let mut polls = Vec::new();
    let mut rest = events;
    for (n, &(de_high, de_low)) in pulses.iter().enumerate() {
        let next_de_high = pulses.get(n + 1).map(|&(rise, _)| rise);
        // A character cut by DE's next rise belongs here; what begins at or after the rise does not.
        let begins = rest.partition_point(|event| event.at() < de_high);
        let ends = rest.partition_point(|event| next_de_high.is_none_or(|next| event.at() < next));
        let window = rest.get(begins..ends).unwrap_or(&[]);
        rest = rest.get(ends..).unwrap_or(&[]);
        polls.extend(poll(window, protocol, de_high, de_low, next_de_high));
    }
    polls
}

fn poll(
    window: &[&LineEvent],
    protocol: Protocol,
    de_high: Ns,
    de_low: Option<Ns>,
    next_de_high: Option<Ns>,
) -> Option<Poll> {
    let mut sent: Option<(Ns, Ns, u64)> = None;
    let (mut request, mut answer, mut clean) = (Vec::new(), Vec::new(), true);
    let mut answer_end = None;
    for event in window {
        match **event {
            LineEvent::Char { who: Talker::Gateway, start, end, word, bit_ps, .. } => {
                let first_start = sent.map_or(start, |(first, ..)| first);
                sent = Some((first_start, end, bit_ps));
                request.push(word as u8);
            }
            LineEvent::Char { end, .. } => answer_end = answer_end.max(Some(end)),
            // With the receiver on all the time the gateway hears its own request first.
            LineEvent::Heard { at, word, framing_error, .. } if de_low.is_some_and(|low| at > low) => {
                answer.push(word as u8);
                clean &= !framing_error;
            }
            _ => {}
        }
    }
    let (first_start, last_stop, bit_ps) = sent?;
    let (well_formed, judged) = match protocol {
        Protocol::T7 => (t7::is_request(&request), t7::judge(&request, &answer)),
        Protocol::Isu => (isu::is_request(&request), isu::judge(&request, &answer)),
    };
    let verdict = if answer.is_empty() {
        PollVerdict::NoAnswer
    } else if clean {
        judged
    } else {
        PollVerdict::BadAnswer
    };
    let request_and_answer = (request, answer);
    Some(Poll {
        de_high,
        first_start,
        last_stop,
        de_low,
        bit_ps,
        request: request_and_answer.0,
        well_formed,
        answer: request_and_answer.1,
        answer_end,
        next_de_high,
        verdict,
    })
}

/// Share of the time in which at least one character was on the line.
fn utilisation(events: &[&LineEvent], since: Ns, end: Ns) -> f64 {
    let (mut busy, mut until) = (0, since);
    for event in events {
        if let LineEvent::Char { start, end: stop, fate, .. } = **event
            && fate != Fate::Undriven
        {
            let stop = stop.min(end);
            busy += stop.saturating_sub(start.max(until));
            until = until.max(stop);
        }
    }
    if end == since { 0.0 } else { busy as f64 / (end - since) as f64 }
}

//! The Modbus port's far end: a master on an RS485 pair, and its handle for the host.
//!
//! The pair is a [`clino_segment::Segment`] without sensors: only what the gateway sends while its DE is high reaches
//! the master, two talkers at once spoil each other's bits and are logged, and a wrong bit rate is heard as the wrong
//! bytes it gives. The master is behind an adapter with automatic direction control: its driver is on from the first start bit of
//! what is to be sent to the last stop bit.
//!
//! What a master knows of Modbus is how long silence ends a frame ("MODBUS over Serial Line", V1.02, section 2.5.1.1).

mod framing;
mod line;

use std::collections::VecDeque;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clino_segment::wire::Received;
use clino_sim::node::Ns;

use crate::gaps::{self, Gap, Waiting};

pub use framing::{Framing, Parity};
pub use line::ModbusLine;

/// What the master heard between two silences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// First start bit.
    pub began: Ns,
    /// End of the last stop bit.
    pub ended: Ns,
    /// Without parity bits.
    pub bytes: Vec<u8>,
    /// Characters with a wrong parity bit, a low stop bit, or bits that were fought over.
    pub spoilt: usize,
    /// The gateway's DE rose.
    pub de_high: Option<Ns>,
    /// The gateway's DE fell; none while it is still high after the silence.
    pub de_low: Option<Ns>,
}

/// How many characters went over the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Sent by the master.
    pub sent: u64,
    /// Heard by the master.
    pub heard: u64,
    /// Of those, spoilt ones.
    pub spoilt: u64,
}

/// The master, as the host sees it.
#[derive(Debug, Default)]
pub struct Master {
    framing: Framing,
    /// What is to be sent.
    outgoing: VecDeque<Waiting>,
    /// End of the last stop bit sent.
    sent_until: Ns,
    heard: Vec<u8>,
    /// The answer that no silence has ended yet.
    open: Option<Answer>,
    answers: VecDeque<Answer>,
    /// End of the last stop bit heard.
    heard_until: Ns,
    /// Last rise of the gateway's DE, and the fall after it.
    de: (Option<Ns>, Option<Ns>),
    traffic: Traffic,
    /// The gateway's receiver has been on.
    gateway_has_listened: bool,
}

impl Master {
    /// Bit rate and framing, for both directions.
    pub fn framing(&self) -> Framing {
        self.framing
    }

    /// Another bit rate and framing from now on; a character under way is lost.
    pub fn set_framing(&mut self, framing: Framing) {
        self.framing = framing;
    }

    /// Sends these bytes back to back from `at` on, or as soon as what is to be sent before is out. It looks at
    /// nothing else: it sends into silences that are too short, and into answers.
    ///
    /// `at` must not be in the board's past, nor before what was given to be sent earlier.
    pub fn send(&mut self, at: Ns, bytes: &[u8]) {
        self.send_with_gaps(at, bytes, &[]);
    }

    /// The same with pauses between them.
    pub fn send_with_gaps(&mut self, at: Ns, bytes: &[u8], gaps: &[Gap]) {
        self.outgoing.extend(gaps::waiting(at, bytes, gaps));
    }

    /// When the next character is due.
    fn next_start(&self) -> Option<Ns> {
        self.outgoing.front().map(|next| next.start(self.sent_until))
    }

    /// Earliest instant at which a request is separate from the characters heard before it.
    pub fn free_from(&self) -> Ns {
        self.heard_until + self.framing.silence()
    }

    /// The answers that are over, in order, since the last call.
    pub fn take_answers(&mut self) -> Vec<Answer> {
        self.answers.drain(..).collect()
    }

    /// Every byte heard since the last call, whether or not its answer is over.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        mem::take(&mut self.heard)
    }

    /// Characters since power-up.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// The gateway has started: its receiver has been on since power-up. Before that, requests are lost.
    pub fn gateway_has_listened(&self) -> bool {
        self.gateway_has_listened
    }

    fn hear(&mut self, received: Received) {
        let (byte, parity_holds) = self.framing.take_apart(received.word);
        let spoilt = received.framing_error || received.noise || !parity_holds;
        let (began, ended) = self.framing.around(received.at);
        self.heard.push(byte);
        self.traffic.heard += 1;
        self.traffic.spoilt += u64::from(spoilt);
        self.heard_until = ended;
        let open = self.open.get_or_insert(Answer {
            began,
            ended,
            bytes: Vec::new(),
            spoilt: 0,
            de_high: None,
            de_low: None,
        });
        open.ended = ended;
        open.bytes.push(byte);
        open.spoilt += usize::from(spoilt);
    }

    /// When silence ends the answer that is being heard.
    fn answer_ends(&self) -> Option<Ns> {
        self.open.as_ref().map(|answer| answer.ended + self.framing.silence())
    }

    fn end_answer(&mut self) {
        let (de_high, de_low) = self.de;
        self.answers.extend(self.open.take().map(|answer| Answer { de_high, de_low, ..answer }));
    }

    fn drive_enabled(&mut self, now: Ns, high: bool) {
        match (high, &mut self.de) {
            (true, de) => *de = (Some(now), None),
            (false, (_, low)) => *low = Some(now),
        }
    }
}

/// A master that the host and the line share.
#[derive(Clone, Debug, Default)]
pub struct SharedMaster(Arc<Mutex<Master>>);

impl SharedMaster {
    /// Access to the master; not to be held while the board runs.
    pub fn lock(&self) -> MutexGuard<'_, Master> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;

//! A second UART on the pair, such as that of a computer, behind a line driver of its own.
//!
//! The host controls it like the gateway's: it says when the driver switches and when a character begins. Its
//! receiver is deaf while its driver is on. In the log it is the node after the last sensor.

use std::collections::VecDeque;
use std::sync::PoisonError;

use clino_sim::node::Ns;

use super::Segment;
use super::driver::{Character, Driver};
use super::line::{Line, Ps, to_ps};
use super::receiver::{Noise, Receiver, Sampled, Sampling, Shared};
use crate::log::{LineEvent, Talker};
use crate::wire::{Format, Received, Sent};

/// The second master's receiver and what it has heard.
pub struct SecondMaster {
    receiver: Receiver,
    received: VecDeque<Received>,
}

impl SecondMaster {
    /// Its receiver.
    pub fn receiver(&self) -> &Receiver {
        &self.receiver
    }

    /// The line changed.
    pub fn line_changed(&mut self, at: Ps, high: bool, noise: &Noise) {
        self.receiver.line_changed(at, high, noise);
    }

    /// Takes the character whose stop bit has come, if one has.
    pub fn complete(
        &mut self,
        clock: Ps,
        line: &Line,
        noise: &Noise,
        shared: &mut Shared,
        log: &mut Vec<LineEvent>,
    ) {
        if self.receiver.due().is_some_and(|due| due <= clock)
            && let Some(sampled) = self.receiver.complete(line, noise, shared, log)
        {
            let Sampled { at, word, framing_error, noise } = sampled;
            self.received.push_back(Received { at, word, framing_error, noise });
        }
    }
}

impl Segment {
    /// Attaches a second master called `name` to the pair, with its receiver off. A pair has one at most.
    #[must_use]
    pub fn with_second_master(mut self, name: &str) -> Self {
        let who = Talker::Node(self.slots.len());
        let chance = self.settings.chance.part(self.slots.len() as u64 + 1);
        if self.second_master.is_none() {
            self.second_master =
                Some(SecondMaster { receiver: Receiver::new(who, chance), received: VecDeque::new() });
            self.drivers.push(Driver::new(who));
            self.log.lock().unwrap_or_else(PoisonError::into_inner).nodes.push(name.to_owned());
        }
        self
    }

    /// The second master's receiver is on with this format, or off.
    pub fn set_second_master_receiver(&mut self, now: Ns, format: Option<Format>) {
        self.run(to_ps(now));
        let line = self.line.now();
        if let Some(SecondMaster { receiver, .. }) = &mut self.second_master {
            match format {
                Some(Format { bit_ps, data_bits, .. }) => {
                    receiver.switch_on(Sampling { bit_ps, data_bits }, line);
                }
                None => receiver.switch_off(),
            }
        }
        self.next = self.find_next();
    }

    /// The second master starts a character. To be called at `sent.start`, when the one before is over.
    pub fn send_as_second_master(&mut self, sent: Sent) {
        let start = to_ps(sent.start);
        self.run(start);
        let Format { bit_ps, data_bits, stop_halves } = sent.format;
        if self.second_master.is_some()
            && let Some(driver) = self.drivers.last_mut()
        {
            driver.push(Character { start, word: sent.word, data_bits, stop_halves, bit_ps });
        }
        self.run(start);
    }

    /// The second master switches its line driver.
    pub fn drive_as_second_master(&mut self, now: Ns, on: bool) {
        let at = to_ps(now);
        self.run(at);
        let (line, noise) = (&self.line, &self.settings.noise);
        let Some(second_master) = &mut self.second_master else { return };
        if on {
            second_master.receiver.mask(at, true, line, noise);
        }
        if let Some(driver) = self.drivers.last_mut() {
            driver.switch(at, on, &mut self.news);
        }
        self.resolve(at);
        if !on && let Some(second_master) = &mut self.second_master {
            second_master.receiver.mask(at, false, &self.line, &self.settings.noise);
        }
        self.run(at);
    }

    /// A character whose stop-bit centre the second master's receiver has reached, in order.
    pub fn take_heard_by_second_master(&mut self) -> Option<Received> {
        self.second_master.as_mut()?.received.pop_front()
    }
}

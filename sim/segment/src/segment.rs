//! An RS485 half-duplex segment: the gateway's USART behind its DE pin, and simulated sensors, on one pair.
//!
//! It knows which drivers are on at every instant. Undriven, the line idles high (fail-safe bias). What a
//! transmitter shifts out while its driver is off never reaches the line; a driver switched off within a
//! character cuts it. Every receiver samples the resulting level at its own bit times, so a wrong baud rate, two talkers
//! at once or a cut character come out as the wrong bytes and framing errors they really give.
//!
//! The gateway's RE̅ is tied to its DE (it hears nothing while it drives, its RO pulled up) unless
//! [`SegmentSettings::echo`] says that RE̅ is always on. So a DE that is shorted high makes it deaf as well, without `echo`; with
//! it, it hears its own idle level fighting the answers. A node that is deaf while it sends has its receiver off while its
//! driver is on.
//!
//! A shorted pair reads the same everywhere, for any driver: low (a break) or high (as an idle line does).
//!
//! Limits: levels are ideal and without delay; noise acts on sampled bits, not on an idle line; sampling
//! takes one sample a bit, so `noise` on a received character means that a sample fell into a fight.

pub mod chance;
mod driver;
mod faults;
mod line;
mod receiver;
mod second_master;
mod shorts;
mod slot;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use clino_sim::node::{Node, Ns};

use crate::log::{LineEvent, SegmentLog, SharedLog, Talker};
use crate::trace::Trace;
use crate::wire::{Format, Received, Sent, Wire};
use chance::{Chance, Topic};
use driver::{Character, Driver};
use line::{Level, Line, Ps, reached, to_ns, to_ps};
use receiver::{Receiver, Sampled, Sampling, Shared};
use second_master::SecondMaster;
use slot::Slot;

pub use chance::Probability;
pub use faults::{Babble, Faults, LineFaults, StuckLine};
pub use receiver::Noise;

/// How far receivers look back, in bit times: start, nine data bits, stop and one to spare.
const LOOK_BACK_BITS: u64 = 12;
/// A node with more acts than this at one instant is stuck.
const MAX_ACTS_AT_ONCE: usize = 1_000;

/// What is the same for the whole segment.
#[derive(Clone, Copy, Debug)]
pub struct SegmentSettings {
    /// Decides everything that is left to chance.
    pub chance: Chance,
    /// The gateway hears itself.
    pub echo: bool,
    /// Disturbances of every receiver.
    pub noise: Noise,
}

/// A sensor on the line.
pub struct Station {
    /// Name in the log.
    pub name: String,
    /// The sensor.
    pub node: Box<dyn Node>,
    /// What goes wrong with it.
    pub faults: Faults,
}

/// Two or more drivers are on.
struct OpenContention {
    from: Ps,
    who: Vec<Talker>,
    fought: bool,
}

/// The line and everything on it.
pub struct Segment {
    settings: SegmentSettings,
    faults: LineFaults,
    line: Line,
    /// The gateway's, then the nodes', then the second master's.
    drivers: Vec<Driver>,
    receiver: Receiver,
    slots: Vec<Slot>,
    /// A second UART on the pair; its driver is the last one.
    second_master: Option<SecondMaster>,
    contention: Option<OpenContention>,
    /// The level to which the pair is shorted.
    stuck: Option<bool>,
    /// The gateway's driver is on, regardless of its pin,
    de_shorted: bool,
    /// which is this.
    de: bool,
    /// Last instant at which the faults of the line were looked at.
    faults_seen: Option<Ns>,
    shared: Shared,
    clock: Ps,
    next: Option<Ps>,
    received: VecDeque<Received>,
    news: Vec<LineEvent>,
    log: SharedLog,
    /// The level over time, if it is wanted.
    trace: Option<Trace>,
}

impl Segment {
    /// A segment with these sensors, all powered since time 0 unless their faults say otherwise.
    pub fn new(settings: SegmentSettings, stations: Vec<Station>) -> Self {
        let nodes = stations.iter().map(|station| station.name.clone()).collect();
        let log = Arc::new(Mutex::new(SegmentLog { nodes, events: Vec::new() }));
        let drivers = (0..=stations.len()).map(|index| Driver::new(talker(index))).collect();
        let slot = |(index, station)| Slot::new(index, station, settings.chance.part(index as u64 + 1));
        let slots = stations.into_iter().enumerate().map(slot).collect();
        let receiver = Receiver::new(Talker::Gateway, settings.chance.part(0));
        let mut segment = Self {
            settings,
            faults: LineFaults::default(),
            line: Line::new(),
            drivers,
            receiver,
            slots,
            second_master: None,
            contention: None,
            stuck: None,
            de_shorted: false,
            de: false,
            faults_seen: None,
            shared: Shared::default(),
            clock: 0,
            next: None,
            received: VecDeque::new(),
            news: Vec::new(),
            log,
            trace: None,
        };
        segment.next = segment.find_next();
        segment
    }

    /// The same with a line of which this goes wrong. To be called before anything else has happened.
    #[must_use]
    pub fn with_faults(mut self, faults: LineFaults) -> Self {
        self.faults = faults;
        self.next = self.find_next();
        self
    }

    /// The log, to be read during or after the run.
    pub fn log(&self) -> SharedLog {
        Arc::clone(&self.log)
    }

    /// The bit rate of a sensor just now, by its place, in bit/s.
    pub fn node_baud(&self, node: usize) -> Option<u32> {
        self.slots.get(node).map(Slot::baud)
    }

    /// Records the level of the pair from now on, as its receivers sample it (noise excepted: it acts in a receiver).
    pub fn trace(&mut self) -> Trace {
        self.trace.get_or_insert_default().clone()
    }

    /// The earliest event of the segment itself.
    fn find_next(&self) -> Option<Ps> {
        let characters = self.drivers.iter().filter_map(Driver::next_event);
        let nodes = self.slots.iter().filter_map(Slot::next);
        let faults = self.faults.next_change(self.faults_seen).map(to_ps);
        characters.chain(nodes).chain(faults).chain(self.receivers().filter_map(Receiver::due)).min()
    }

    /// All receivers of the line.
    fn receivers(&self) -> impl Iterator<Item = &Receiver> {
        let second_master = self.second_master.iter().map(SecondMaster::receiver);
        self.slots.iter().map(Slot::receiver).chain(second_master).chain([&self.receiver])
    }

    /// Lets everything up to and including `now` happen.
    fn run(&mut self, now: Ps) {
        while let Some(next) = self.find_next()
            && next <= now
        {
            self.clock = self.clock.max(next);
            self.settle(self.clock);
            self.complete_characters();
            self.change_faults();
            for index in 0..self.slots.len() {
                self.run_slot(index);
            }
        }
        self.settle(now);
        self.clock = now;
        self.next = self.find_next();
        let slowest = self.receivers().filter_map(Receiver::bit_ps).max();
        let look_back = LOOK_BACK_BITS * slowest.unwrap_or(0);
        self.line.forget(now.saturating_sub(look_back));
        if !self.news.is_empty() {
            self.log.lock().unwrap_or_else(PoisonError::into_inner).events.append(&mut self.news);
        }
    }

    /// Plays all drivers' edges up to and including `until` onto the line.
    fn settle(&mut self, until: Ps) {
        while let Some(at) = self.drivers.iter().filter_map(Driver::next_edge).min()
            && at <= until
        {
            for (index, driver) in self.drivers.iter_mut().enumerate() {
                if driver.next_edge() != Some(at) {
                    continue;
                }
                let was_on = driver.is_on();
                driver.step(at, &mut self.news);
                if was_on != driver.is_on()
                    && let Some(slot) = index.checked_sub(1).and_then(|node| self.slots.get_mut(node))
                {
                    slot.driver_switched(driver.is_on(), self.line.now());
                }
            }
            self.resolve(at);
        }
    }

    /// Computes the level from all drivers and reports a change to all receivers.
    fn resolve(&mut self, at: Ps) {
        let (mut on, mut highs) = (0, 0);
        for level in self.drivers.iter().filter_map(Driver::drives) {
            on += 1;
            highs += usize::from(level);
        }
        let fought = self.stuck.is_none() && highs != 0 && highs != on;
        let high = match self.stuck {
            Some(high) => high,
            None if fought => self.settings.chance.roll(Topic::Fight, at, 0) & 1 == 1,
            None => highs == on,
        };
        if self.stuck.is_some() {
            self.drivers
                .iter_mut()
                .filter(|driver| driver.drives() == Some(!high))
                .for_each(Driver::mark_fought);
        }
        self.note_contention(at, on, fought);
        if self.line.set(at, Level { high, fought }) {
            if let Some(trace) = &self.trace {
                trace.note(to_ns(at), high);
            }
            self.receiver.line_changed(at, high, &self.settings.noise);
            for slot in &mut self.slots {
                slot.line_changed(at, high, &self.settings.noise);
            }
            if let Some(second_master) = &mut self.second_master {
                second_master.line_changed(at, high, &self.settings.noise);
            }
        }
    }

    fn note_contention(&mut self, at: Ps, on: usize, fought: bool) {
        if on < 2 {
            if let Some(OpenContention { from, who, fought }) = self.contention.take() {
                let (from, until) = (to_ns(from), to_ns(at));
                self.news.push(LineEvent::Contention { from, until, who, fought });
            }
            return;
        }
        let open = self.contention.get_or_insert(OpenContention { from: at, who: Vec::new(), fought: false });
        open.fought |= fought;
        for (index, driver) in self.drivers.iter_mut().enumerate().filter(|(_, driver)| driver.is_on()) {
            if !open.who.contains(&talker(index)) {
                open.who.push(talker(index));
            }
            if fought {
                driver.mark_fought();
            }
        }
    }

    /// Hands over the characters whose stop bits have come.
    fn complete_characters(&mut self) {
        let (line, noise) = (&self.line, &self.settings.noise);
        if self.receiver.due().is_some_and(|due| due <= self.clock)
            && let Some(sampled) = self.receiver.complete(line, noise, &mut self.shared, &mut self.news)
        {
            let Sampled { at, word, framing_error, noise } = sampled;
            self.news.push(LineEvent::Heard { at, word, framing_error, noise });
            self.received.push_back(Received { at, word, framing_error, noise });
        }
        for slot in &mut self.slots {
            slot.complete(self.clock, line, noise, &mut self.shared, &mut self.news);
        }
        if let Some(second_master) = &mut self.second_master {
            second_master.complete(self.clock, line, noise, &mut self.shared, &mut self.news);
        }
    }

    /// Does what is due for one sensor.
    fn run_slot(&mut self, index: usize) {
        let mut acts = 0;
        while self.slots[index].next().is_some_and(|next| next <= self.clock) {
            assert!(acts < MAX_ACTS_AT_ONCE, "node {index} does not get on at {} ps", self.clock);
            acts += 1;
            let driver = &mut self.drivers[index + 1];
            self.slots[index].act(self.clock, driver, self.line.now(), &mut self.news);
        }
        if acts > 0 {
            self.resolve(self.clock);
            self.settle(self.clock);
        }
    }
}

impl Wire for Segment {
    fn set_receiver(&mut self, now: Ns, format: Option<Format>) {
        self.run(to_ps(now));
        match format {
            Some(Format { bit_ps, data_bits, .. }) => {
                self.receiver.switch_on(Sampling { bit_ps, data_bits }, self.line.now());
            }
            None => self.receiver.switch_off(),
        }
        self.next = self.find_next();
    }

    fn send(&mut self, sent: Sent) {
        let start = to_ps(sent.start);
        self.run(start);
        let Format { bit_ps, data_bits, stop_halves } = sent.format;
        self.drivers[0].push(Character { start, word: sent.word, data_bits, stop_halves, bit_ps });
        self.run(start);
    }

    fn drive_enable(&mut self, now: Ns, high: bool) {
        let at = to_ps(now);
        self.run(at);
        if high != self.de {
            self.de = high;
            self.news.push(LineEvent::De { at: now, high });
            self.switch_gateway(at);
        }
        self.run(at);
    }

    fn next_event(&self) -> Option<Ns> {
        self.next.map(reached)
    }

    fn advance(&mut self, now: Ns) {
        self.run(to_ps(now));
    }

    fn take_received(&mut self) -> Option<Received> {
        self.received.pop_front()
    }
}

fn talker(index: usize) -> Talker {
    index.checked_sub(1).map_or(Talker::Gateway, Talker::Node)
}

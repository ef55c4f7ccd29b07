//! A sensor's place on the line: the node with its receiver, its power and its faults.

use clino_sim::node::{Burst, Heard, Node, Ns};

use super::Station;
use super::chance::{Chance, Topic};
use super::driver::{self, Driver};
use super::faults::Faults;
use super::line::{Level, Line, Ps, reached, to_ns, to_ps};
use super::receiver::{Noise, Receiver, Sampled, Sampling, Shared};
use crate::log::{LineEvent, PS_PER_S, Talker};

/// A babbling node decides on its next character this many bit times before it begins.
const BABBLE_LEAD_BITS: u64 = 5;

/// A sensor with its receiver.
pub struct Slot {
    /// Its place in the segment.
    index: usize,
    node: Box<dyn Node>,
    faults: Faults,
    receiver: Receiver,
    chance: Chance,
    powered: bool,
    /// Last instant at which power changes were looked at.
    power_seen: Option<Ns>,
    /// Earliest start of the next babbled character.
    babble_from: Ns,
}

impl Slot {
    /// Puts a sensor on the line as number `index`, powered.
    pub fn new(index: usize, station: Station, chance: Chance) -> Self {
        let Station { node, faults, .. } = station;
        let mut receiver = Receiver::new(Talker::Node(index), chance);
        receiver.switch_on(sampling_at(node.baud()), Level::IDLE);
        Self { index, node, faults, receiver, chance, powered: true, power_seen: None, babble_from: 0 }
    }

    /// Its receiver.
    pub fn receiver(&self) -> &Receiver {
        &self.receiver
    }

    /// The bit rate of its node just now, in bit/s.
    pub fn baud(&self) -> u32 {
        self.node.baud()
    }

    /// The line changed.
    pub fn line_changed(&mut self, at: Ps, high: bool, noise: &Noise) {
        if self.powered {
            self.receiver.line_changed(at, high, noise);
            self.node.line_level(reached(at), high);
        }
    }

    /// Hands the node the character whose stop bit has come, if one has.
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
            let Sampled { at, word, framing_error, .. } = sampled;
            self.node.hear(Heard { at, byte: word as u8, framing_error });
            self.follow_baud(line.now());
        }
    }

    /// Does one thing that is due: power, babble, or what the node wants.
    pub fn act(&mut self, clock: Ps, driver: &mut Driver, line: Level, log: &mut Vec<LineEvent>) {
        let now = reached(clock);
        if let Some(at) = self.faults.next_power_change(self.power_seen)
            && at <= now
        {
            self.power_seen = Some(at);
            self.switch_power(now, !self.faults.unplugged_at(at), driver, line, log);
        } else if self.babble_due().is_some_and(|due| due <= clock) {
            self.babble(clock, driver);
        } else {
            let burst = self.node.act(now);
            self.follow_baud(line);
            if let Some(mut burst) = burst
                && !self.faults.babbles_at(now)
            {
                if let Some(how) = self.faults.spoil(&mut burst, self.chance) {
                    log.push(LineEvent::Altered { node: self.index, at: burst.start_at, how });
                }
                transmit(&burst, clock, driver);
            }
        }
    }

    /// When its power, its babble or its node wants something.
    pub fn next(&self) -> Option<Ps> {
        let power = self.faults.next_power_change(self.power_seen).map(to_ps);
        let node = if self.powered { self.node.next_event().map(to_ps) } else { None };
        [power, self.babble_due(), node].into_iter().flatten().min()
    }

    fn babble_due(&self) -> Option<Ps> {
        if !self.powered || self.faults.babble.is_empty() {
            return None;
        }
        let (start, _) = self.faults.next_babble(self.babble_from)?;
        Some(to_ps(start).saturating_sub(BABBLE_LEAD_BITS * bit_ps(self.node.baud())))
    }

    fn babble(&mut self, clock: Ps, driver: &mut Driver) {
        let Some((start, gap)) = self.faults.next_babble(self.babble_from) else { return };
        let byte = self.chance.roll(Topic::Babble, start, 0) as u8;
        let start_at = start.max(reached(clock));
        let baud = self.node.baud();
        let burst = Burst { drive_at: start_at, start_at, bytes: vec![byte], baud, hold: 0 };
        self.babble_from = to_ns(transmit(&burst, clock, driver)) + gap;
    }

    fn switch_power(
        &mut self,
        now: Ns,
        on: bool,
        driver: &mut Driver,
        line: Level,
        log: &mut Vec<LineEvent>,
    ) {
        if on == self.powered {
            return;
        }
        log.push(LineEvent::Power { node: self.index, at: now, on });
        self.powered = on;
        if on {
            self.babble_from = now;
            self.node.power_on(now);
            self.node.line_level(now, line.high);
            self.receiver.switch_on(sampling_at(self.node.baud()), line);
        } else {
            self.node.power_off(now);
            self.receiver.switch_off();
            driver.kill(to_ps(now), log);
        }
    }

    /// Its line driver was switched: a deaf node stops or begins to hear.
    pub fn driver_switched(&mut self, on: bool, line: Level) {
        if self.powered && self.node.deaf_while_sending() {
            if on {
                self.receiver.switch_off();
            } else {
                self.receiver.switch_on(sampling_at(self.node.baud()), line);
            }
        }
    }

    /// A node may have changed its bit rate.
    fn follow_baud(&mut self, line: Level) {
        if self.receiver.bit_ps().is_some() {
            self.receiver.switch_on(sampling_at(self.node.baud()), line);
        }
    }
}

/// Puts a burst into the transmitter, not before `clock` nor into what it already sends; returns its end.
fn transmit(burst: &Burst, clock: Ps, driver: &mut Driver) -> Ps {
    let bit_ps = bit_ps(burst.baud);
    let start = to_ps(burst.start_at).max(clock).max(driver.busy_until().unwrap_or(0));
    driver.switch_at(to_ps(burst.drive_at).max(clock).min(start), true);
    let mut end = start;
    for character in driver::burst(start, &burst.bytes, bit_ps) {
        end = character.end();
        driver.push(character);
    }
    driver.switch_at(end + to_ps(burst.hold), false);
    end
}

fn bit_ps(baud: u32) -> u64 {
    PS_PER_S / u64::from(baud.max(1))
}

fn sampling_at(baud: u32) -> Sampling {
    Sampling { bit_ps: bit_ps(baud), data_bits: 8 }
}

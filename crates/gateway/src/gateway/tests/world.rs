//! A gateway and its sensors, in virtual time, event by event.
//!
//! The wire is played by arithmetic: a frame goes out after the guard, at ten bits a character, and a node's answer
//! begins after its latency. Frames are made by hand, from the documents.

use super::*;
use crate::summary::Standing;
use clino_bus::Duration;
use std::collections::BTreeMap;

/// Anything that decides by chance, the same for the same seed (xorshift64*).
pub(super) struct Chance(u64);

impl Chance {
    pub fn new(seed: u64) -> Chance {
        Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }
}

/// What happens to an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    Well,
    /// The node is not there.
    Silent,
    /// Two characters are replaced by anything.
    Damaged,
    /// The last characters are missing.
    Torn,
    /// It begins this many µs late.
    Late(u64),
}

/// What the sensors do.
pub(super) trait Sensors {
    /// What happens to the answer of a node that is asked at `now`.
    fn fate(&mut self, bus: Bus, node: u8, now: u64) -> Fate;
    /// True angle in 0.001°, -180000 to 179999.
    fn t7(&self, node: u8, now: u64) -> i32;
    /// Product type of a T7.
    fn product(&self, _: u8) -> [u8; 6] {
        *b"T7-1  "
    }
    /// A request has gone out.
    fn asked(&mut self, _: Bus, _: &[u8], _: u64) {}
    /// True angle as the module has measured it last.
    fn isu(&self, node: u8, now: u64) -> u16;
    fn chance(&mut self) -> &mut Chance;
}

struct Segment {
    bus: Bus,
    character_ns: u64,
    guard: u64,
    latency: u64,
    /// The line is silent from then on.
    silent: u64,
    /// What is still to happen.
    events: BTreeMap<(u64, u32), Event>,
    sent: u32,
}

impl Segment {
    fn characters(&self, n: u64) -> u64 {
        (n * self.character_ns).div_ceil(1_000)
    }

    fn push(&mut self, at: u64, event: Event) {
        self.sent = self.sent.wrapping_add(1);
        self.events.insert((at, self.sent), event);
    }

    fn send(&mut self, frame: &[u8], now: u64, sensors: &mut impl Sensors) {
        let out = now.max(self.silent + self.guard) + self.characters(frame.len() as u64);
        self.push(out, Event::Released { at: Instant::from_micros(out) });
        self.silent = out;
        let node = match self.bus {
            Bus::T7 => frame[0],
            Bus::Isu => frame[1] >> 4,
        };
        sensors.asked(self.bus, frame, out);
        let fate = sensors.fate(self.bus, node, out);
        let late = match fate {
            Fate::Silent => return,
            Fate::Late(late) => late,
            _ => 0,
        };
        let mut answer = match self.bus {
            Bus::T7 => t7_answer(frame, sensors.t7(node, out), sensors.product(node)),
            Bus::Isu => isu_answer(frame, sensors.isu(node, out)),
        };
        let length = answer.len() as u64;
        match fate {
            Fate::Damaged => {
                for _ in 0..2 {
                    let at = sensors.chance().below(length) as usize;
                    answer[at] = sensors.chance().next() as u8;
                }
            }
            Fate::Torn => answer.truncate(1 + sensors.chance().below(length - 1) as usize),
            _ => {}
        }
        let begin = out + self.latency + late;
        for (index, byte) in (1..).zip(answer) {
            // A stop bit is heard in its middle.
            let at = Instant::from_micros(begin + self.characters(index) - self.characters(1) / 20);
            self.push(at.as_micros(), Event::Heard { character: Character::clean(byte), at });
        }
        self.silent = self.silent.max(begin + self.characters(length));
    }
}

/// T7 guide sections 2.1.1, 2.1.4 and 2.3.
fn t7_answer(request: &[u8], mdeg: i32, product: [u8; 6]) -> Vec<u8> {
    let angle = mdeg.to_be_bytes();
    let mut answer = match *request {
        [node, 1, 0x81..=0x83] => [&[node, 0x06, request[2]][..], &angle].concat(),
        [node, 1, 0x80] => [&[node, 0x10, 0x80][..], &[0; 8], &angle, &[0x08, 0xFC]].concat(),
        [node, 1, 0x87] => {
            let one_g = 102_300_i32.to_be_bytes();
            [&[node, 0x20, 0x87][..], &[0; 8], &angle, &[0x08, 0xFC], &one_g, &[0; 12]].concat()
        }
        // What a device is asked to identify it: sections 2.2.1, 2.4.1, 2.5.1, 2.6.1, 2.7.1.
        [node, 1, 0x85] => [&[node, 0x0E, 0x85][..], &[0; 12]].concat(),
        [node, 1, 0x88] => std::vec![node, 0x05, 0x88, 0, 0, 0],
        [node, 1, 0x8A] => std::vec![node, 0x04, 0x8A, 0x01, 0xF4],
        [node, 1, 0x8C] => std::vec![node, 0x03, 0x8C, 0],
        [node, 1, 0x8E] => [&[node, 0x14, 0x8E, 0, 0, 0, node][..], b"1.00  ", &product, &[0, 0]].concat(),
        _ => panic!("no such request is expected: {request:02X?}"),
    };
    answer.push(answer.iter().fold(0, |sum: u8, byte| sum.wrapping_sub(*byte)));
    answer
}

/// AN #201 section 4: the sum does not cover the length.
fn isu_answer(request: &[u8], code: u16) -> Vec<u8> {
    let [3, head, 0x58, 2, _] = *request else { panic!("no such request is expected: {request:02X?}") };
    let [high, low] = code.to_be_bytes();
    let body = [head | 1, 0x58, high, low];
    let sum = body.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    [&[4][..], &body, &[sum]].concat()
}

pub(super) struct World<S> {
    pub gateway: Gateway,
    pub sensors: S,
    pub now: u64,
    /// Requests to each node.
    pub asked: BTreeMap<(u8, u8), u32>,
    segments: [Segment; 2],
}

impl<S: Sensors> World<S> {
    pub fn new(table: &[SlotConfig], sensors: S) -> World<S> {
        let (t7, isu) = (Timing::t7(Serial::T7_DEFAULT), Timing::isu());
        let segment = |bus, character_ns, guard: Duration, latency| Segment {
            bus,
            character_ns,
            guard: u64::from(guard.as_micros()),
            latency,
            silent: 0,
            events: BTreeMap::new(),
            sent: 0,
        };
        World {
            gateway: Gateway::new(&Settings::new(table, t7, isu), pwm::Limits::new(84_000_000)),
            sensors,
            now: 0,
            asked: BTreeMap::new(),
            segments: [
                segment(Bus::T7, 86_806, t7.guard, 2_000),
                segment(Bus::Isu, 1_041_667, isu.guard, 1_000),
            ],
        }
    }

    /// Lets time pass; calls `watch` with every reading that has changed, and when.
    pub fn run(&mut self, until: u64, mut watch: impl FnMut(&mut S, Reading, u64)) {
        while self.now < until {
            let mut next = until;
            for segment in &mut self.segments {
                let mut sent = None;
                self.gateway.poll(segment.bus, Instant::from_micros(self.now), |action| {
                    if let Action::Send(frame) = action {
                        sent = Some(frame.to_vec());
                    }
                });
                if let Some(frame) = sent {
                    let node = if segment.bus == Bus::T7 { frame[0] } else { frame[1] >> 4 };
                    *self.asked.entry((segment.bus as u8, node)).or_default() += 1;
                    segment.send(&frame, self.now, &mut self.sensors);
                }
                let event_at = segment.events.first_key_value().map(|(&(at, _), _)| at);
                let poll_at = self.gateway.poll_at(segment.bus).map(|at| at.as_micros().max(self.now));
                next = [event_at, poll_at].into_iter().flatten().fold(next, u64::min);
            }
            while let Some(reading) = self.gateway.next_changed() {
                self.check_looks(&reading);
                watch(&mut self.sensors, reading, self.now);
            }
            self.now = self.now.max(next);
            for segment in &mut self.segments {
                while let Some(entry) = segment.events.first_entry()
                    && entry.key().0 <= self.now
                {
                    self.gateway.line(segment.bus, entry.remove());
                }
            }
        }
    }

    /// All ways to look at a slot say the same: now, and before, at and after the instant at which its value grows stale.
    fn check_looks(&mut self, reading: &Reading) {
        let slot = usize::from(reading.slot);
        let stale = reading.measured.map(|at| (at + reading.stale_after).as_micros());
        let instants = stale.map_or([0; 3], |at| [at - 1, at, at + 1]);
        for now in instants.into_iter().chain([self.now, self.now + (1 << 40)]).map(Instant::from_micros) {
            let (status, age_ms) = (reading.status(now), reading.age_ms(now));
            let parts = (self.gateway.status(slot, now), self.gateway.angle(slot, now));
            assert_eq!(parts, (Some(status), reading.angle(now)), "slot {slot} at {now:?}");
            assert_eq!(self.gateway.age_ms(slot, now), age_ms, "slot {slot} at {now:?}");
            let Reading { source, health, alarms, .. } = *reading;
            let standing = Standing { source, status, health, alarms, age_ms };
            assert_eq!(self.gateway.standing(slot, now), Some(standing), "slot {slot} at {now:?}");
            assert_eq!(self.gateway.brief(slot, now), Some(reading.brief(now)), "slot {slot} at {now:?}");
        }
    }

    pub fn skip(&mut self, until: u64) {
        self.run(until, |_, _, _| ());
    }

    pub fn status(&mut self, slot: usize) -> Status {
        self.gateway.reading(slot).unwrap().status(Instant::from_micros(self.now))
    }

    pub fn asked(&self, bus: Bus, node: u8) -> u32 {
        self.asked.get(&(bus as u8, node)).copied().unwrap_or(0)
    }
}

pub(super) fn t7_slot(node: u8, period: Duration) -> SlotConfig {
    let address = t7::Address::new(node).unwrap();
    slot(Source::T7 { address, axis: t7::Axis::Two }, period)
}

pub(super) fn isu_slot(node: u8, period: Duration) -> SlotConfig {
    slot(Source::Isu { address: isu::Address::new(node).unwrap() }, period)
}

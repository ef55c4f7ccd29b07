//! The segment against nodes and a USART made for the purpose: what must be heard is worked out here from
//! times and bits alone.

use std::sync::{Arc, Mutex};

use clino_sim::node::{Burst, Heard};

use super::*;
use crate::log::Fate;

mod faults;
mod fights;
mod line_faults;
mod timing;

/// 1/115200 s in picoseconds, rounded down as the segment does for nodes.
const BIT: u64 = 8_680_555;
const CHAR_NS: Ns = 86_805;
const BAUD: u32 = 115_200;

/// A node that sends what the test gives it and remembers what it heard.
#[derive(Clone, Default)]
struct Puppet(Arc<Mutex<PuppetState>>);

struct PuppetState {
    baud: u32,
    deaf: bool,
    plans: VecDeque<(Ns, Burst)>,
    heard: Vec<Heard>,
    levels: Vec<(Ns, bool)>,
    powers: Vec<(Ns, bool)>,
}

impl Default for PuppetState {
    fn default() -> Self {
        Self {
            baud: BAUD,
            deaf: true,
            plans: VecDeque::new(),
            heard: Vec::new(),
            levels: Vec::new(),
            powers: Vec::new(),
        }
    }
}

impl Puppet {
    fn says(self, at: Ns, bytes: &[u8]) -> Self {
        let baud = self.0.lock().unwrap().baud;
        self.bursts(Burst { drive_at: at, start_at: at, bytes: bytes.to_vec(), baud, hold: 0 })
    }

    fn bursts(self, burst: Burst) -> Self {
        self.0.lock().unwrap().plans.push_back((burst.drive_at, burst));
        self
    }

    fn at_baud(self, baud: u32) -> Self {
        self.0.lock().unwrap().baud = baud;
        self
    }

    fn hears_itself(self) -> Self {
        self.0.lock().unwrap().deaf = false;
        self
    }

    fn heard(&self) -> Vec<(u8, bool)> {
        self.0.lock().unwrap().heard.iter().map(|heard| (heard.byte, heard.framing_error)).collect()
    }

    fn station(&self) -> Station {
        self.with(Faults::default())
    }

    fn with(&self, faults: Faults) -> Station {
        Station { name: "puppet".into(), node: Box::new(self.clone()), faults }
    }
}

impl Node for Puppet {
    fn baud(&self) -> u32 {
        self.0.lock().unwrap().baud
    }

    fn hear(&mut self, heard: Heard) {
        self.0.lock().unwrap().heard.push(heard);
    }

    fn next_event(&self) -> Option<Ns> {
        self.0.lock().unwrap().plans.front().map(|&(at, _)| at)
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        let mut state = self.0.lock().unwrap();
        let due = state.plans.front().is_some_and(|&(at, _)| at <= now);
        if due { state.plans.pop_front().map(|(_, burst)| burst) } else { None }
    }

    fn deaf_while_sending(&self) -> bool {
        self.0.lock().unwrap().deaf
    }

    fn power_off(&mut self, now: Ns) {
        self.0.lock().unwrap().powers.push((now, false));
    }

    fn power_on(&mut self, now: Ns) {
        self.0.lock().unwrap().powers.push((now, true));
    }

    fn line_level(&mut self, now: Ns, high: bool) {
        self.0.lock().unwrap().levels.push((now, high));
    }
}

fn settings() -> SegmentSettings {
    SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() }
}

fn segment(stations: Vec<Station>) -> Segment {
    on_at(settings(), stations, BIT)
}

/// A segment whose gateway receiver is on.
fn on_at(settings: SegmentSettings, stations: Vec<Station>, bit_ps: u64) -> Segment {
    let mut segment = Segment::new(settings, stations);
    segment.set_receiver(0, Some(format(bit_ps)));
    segment
}

fn format(bit_ps: u64) -> Format {
    Format { bit_ps, data_bits: 8, stop_halves: 2 }
}

/// The gateway sends bytes back to back from `start`, without touching DE. Returns the end.
fn send(segment: &mut Segment, start: Ns, bytes: &[u8]) -> Ns {
    let mut end = to_ps(start);
    for &byte in bytes {
        play(segment, to_ns(end));
        segment.send(Sent { start: to_ns(end), word: u16::from(byte), format: format(BIT) });
        end += 10 * BIT;
    }
    reached(end)
}

/// DE up, bytes, DE down, like a driver should.
fn poll(segment: &mut Segment, at: Ns, bytes: &[u8]) -> Ns {
    play(segment, at);
    segment.drive_enable(at, true);
    let end = send(segment, at, bytes);
    play(segment, end);
    segment.drive_enable(end, false);
    end
}

/// Calls `advance` when the segment asks for it, like the host does, and no oftener.
fn play(segment: &mut Segment, until: Ns) {
    while let Some(next) = segment.next_event()
        && next <= until
    {
        segment.advance(next);
    }
}

/// All that the gateway heard until then.
fn listen(segment: &mut Segment, until: Ns) -> Vec<(u16, bool)> {
    play(segment, until);
    segment.advance(until);
    std::iter::from_fn(|| segment.take_received()).map(|got| (got.word, got.framing_error)).collect()
}

fn events(segment: &Segment) -> Vec<LineEvent> {
    segment.log().lock().unwrap().events.clone()
}

fn fates(segment: &Segment, who: Talker) -> Vec<(u16, Fate)> {
    events(segment)
        .iter()
        .filter_map(|event| match *event {
            LineEvent::Char { who: sender, word, fate, .. } if sender == who => Some((word, fate)),
            _ => None,
        })
        .collect()
}

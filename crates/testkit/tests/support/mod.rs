//! A gateway core with both buses of a house of simulated sensors, and what the sensors truly are at.
//!
//! ```text
//!  slot 0, 1   T7 at address 1, axes 0 and 2          slot 4   T7 at address 3, where none is at first
//!  slot 2      T7 at address 2, axis 2                slot 5   the PWM output of the ISU
//!  slot 3      ISU at address 1                       slot 6   T7 at address 1, axis 2, asked for everything
//! ```

#![allow(dead_code, reason = "each test file uses its own part")]

use std::sync::{Arc, Mutex, MutexGuard};

use clino_bus::{Duration, Instant, Serial, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::pwm::{Limits, Ticks};
use clino_codec::t7::{Address, Axis, Direction};
use clino_codec::{isu, t7};
use clino_gateway::config::{Ask, Filter};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::TaskEvent;
use clino_gateway::{
    Action, Bus, Capture, Gateway, PwmInput, Reading, Requester, Settings, SlotConfig, Source, Status,
};
use clino_segment::chance::Chance;
use clino_segment::{Noise, Station};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu};
use clino_sim::motion::Motion;
use clino_sim::node::Node;
use clino_sim::t7::{Identity, Model, T7};
use clino_testkit::rig::{Port, sensor};

pub const SECOND: u64 = 1_000_000;
pub const SLOTS: usize = 7;
/// A turn in 0.001°.
pub const TURN: i64 = 360_000;
/// The slot that reads the PWM output, and that of its ISU.
pub const PWM: usize = 5;
pub const ISU: usize = 3;
/// From one PWM cycle to the next, µs.
const CYCLE: u64 = 33_333;
/// Ticks of 1/30 s at 84 MHz.
const PERIOD_TICKS: u32 = 2_800_000;

/// Anything that decides by chance, the same for the same seed (xorshift64*).
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Dice {
        Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) % limit
    }

    pub fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }
}

pub struct House {
    pub gateway: Gateway,
    pub t7s: [Arc<Mutex<T7>>; 2],
    pub isu: Arc<Mutex<Isu>>,
    ports: [Port; 2],
    pub now: u64,
    next_cycle: u64,
    /// True angle of the ISU from its factory null, µ°, and its rate, µ°/s.
    isu_motion: Motion,
    pub news: Vec<TaskEvent>,
}

/// How the sensors move: µ°, and µ°/s.
#[derive(Clone, Copy, Debug)]
pub struct Moves {
    pub t7: [(i64, i64); 4],
    pub isu: (i64, i64),
}

fn motion((start, rate): (i64, i64)) -> Motion {
    if rate == 0 { Motion::Constant(start) } else { Motion::Ramp { start, rate } }
}

fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

pub fn t7_source(number: u8, axis: Axis) -> Source {
    Source::T7 { address: address(number), axis }
}

pub fn isu_address() -> isu::Address {
    isu::Address::new(1).unwrap()
}

/// The table with nothing but the usual in it.
pub fn table() -> [SlotConfig; SLOTS] {
    let pwm = SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 });
    [
        SlotConfig::usual(t7_source(1, Axis::Zero)),
        SlotConfig::usual(t7_source(1, Axis::Two)),
        SlotConfig::usual(t7_source(2, Axis::Two)),
        SlotConfig::usual(Source::Isu { address: isu_address() }),
        SlotConfig::usual(t7_source(3, Axis::Two)),
        SlotConfig { partner: Some(ISU as u8), ..pwm },
        SlotConfig { ask: Ask::Everything, ..SlotConfig::usual(t7_source(1, Axis::Two)) },
    ]
}

/// The number of an axis, as the guide counts them.
fn axis_number(axis: Axis) -> usize {
    match axis {
        Axis::Zero => 0,
        Axis::One => 1,
        Axis::Two => 2,
    }
}

impl House {
    pub fn new(table: &[SlotConfig; SLOTS], moves: &Moves) -> House {
        let t7 = |number: u8, model, motions: [(i64, i64); 3]| {
            let options = clino_sim::t7::Options { motion: motions.map(motion), ..Default::default() };
            let stored = clino_sim::t7::StoredSettings { address: number, ..Default::default() };
            let product = if model == Model::T73 { *b"T7-3  " } else { *b"T7-1  " };
            let identity =
                Identity { model, serial: 1_000 + u32::from(number), product, ..Identity::default() };
            Arc::new(Mutex::new(T7::new(identity, stored, options).unwrap()))
        };
        let [a, b, c, d] = moves.t7;
        let t7s = [t7(1, Model::T73, [a, b, c]), t7(2, Model::T71, [d; 3])];
        let eeprom =
            Eeprom::factory(Content { address: 1, ..Content::default() }, ChecksumScope::default(), 1);
        let options = clino_sim::isu::Options { motion: motion(moves.isu), ..Default::default() };
        let isu = Arc::new(Mutex::new(Isu::new(eeprom, options)));
        let (t7_timing, isu_timing) = (Timing::t7(Serial::T7_DEFAULT), Timing::isu());
        let station = |name: &str, node: Box<dyn Node>| sensor(name, node);
        let port = |timing: Timing, stations: Vec<Station>| {
            let settings = clino_segment::SegmentSettings {
                chance: Chance::new(1),
                echo: false,
                noise: Noise::default(),
            };
            Port::with_line(timing.line(), settings, stations)
        };
        let ports = [
            port(
                t7_timing,
                vec![station("t7-1", Box::new(t7s[0].clone())), station("t7-2", Box::new(t7s[1].clone()))],
            ),
            port(isu_timing, vec![station("isu-1", Box::new(isu.clone()))]),
        ];
        House {
            gateway: Gateway::new(&Settings::new(table, t7_timing, isu_timing), Limits::new(84_000_000)),
            t7s,
            isu,
            ports,
            now: 0,
            next_cycle: CYCLE,
            isu_motion: motion(moves.isu),
            news: Vec::new(),
        }
    }

    /// The sensor, to be spoilt.
    pub fn t7(&self, number: usize) -> MutexGuard<'_, T7> {
        self.t7s[number].lock().unwrap()
    }

    pub fn isu(&self) -> MutexGuard<'_, Isu> {
        self.isu.lock().unwrap()
    }

    /// An order from the console, which has to be accepted.
    pub fn order(&mut self, order: Order) -> Result<(), Refusal> {
        self.gateway.carry_out(order, Requester::Console)
    }

    /// Lets time pass; `watch` is called whenever something may have been published.
    pub fn run(&mut self, until: u64, mut watch: impl FnMut(&mut House)) {
        while self.now < until {
            let to = (self.now + 1_000).min(until).min(self.next_cycle);
            for bus in [Bus::T7, Bus::Isu] {
                self.run_bus(bus, to, &mut watch);
            }
            self.now = to;
            if to >= self.next_cycle {
                self.next_cycle += CYCLE;
                self.cycle();
            }
            if let Some(news) = self.gateway.task_event(Requester::Console) {
                self.news.push(news);
            }
            self.gateway.publish();
            watch(self);
        }
    }

    fn run_bus(&mut self, bus: Bus, to: u64, watch: &mut impl FnMut(&mut House)) {
        let index = bus as usize;
        loop {
            let port = &mut self.ports[index];
            let now = port.now();
            self.gateway.poll(bus, now, |action| match action {
                Action::Send(frame) => {
                    port.submit(frame, now + Duration::from_micros(100_000)).expect("nothing is in hand")
                }
                Action::Run(timing, _) => port.set_serial(timing.serial, timing.guard),
            });
            let at = self.gateway.poll_at(bus).map_or(to, |at| at.as_micros().min(to));
            let event = self.ports[index].run(Instant::from_micros(at.max(now.as_micros())));
            if let Some(event) = event {
                self.gateway.line(bus, event);
            }
            self.now = self.now.max(self.ports[index].now().as_micros());
            self.gateway.publish();
            watch(self);
            if self.ports[index].now().as_micros() >= to && event.is_none() {
                return;
            }
        }
    }

    /// The PWM output says what the module's RAM does: 6.749 times the duty in per cent, less 157.45 (AN #201 section 5).
    fn cycle(&mut self) {
        let degrees = f64::from(self.isu().code()) * 360.0 / 65_536.0;
        let high = ((degrees + 157.45) / 674.9 * f64::from(PERIOD_TICKS)).round() as u32;
        let capture = Capture::Cycle(Ticks { period: PERIOD_TICKS, high });
        self.gateway.pwm(PwmInput::Pwm1, capture, Instant::from_micros(self.now));
    }

    pub fn reading(&mut self, slot: usize) -> Reading {
        self.gateway.reading(slot).expect("a slot")
    }

    pub fn status(&mut self, slot: usize) -> Status {
        self.reading(slot).status(Instant::from_micros(self.now))
    }

    /// What the slot should say now, in 0.001° on the circle; `None` if no sensor is at its address.
    pub fn truth(&self, slot: usize) -> Option<i64> {
        let config = *self.gateway.config(slot)?;
        let said = match config.source {
            Source::T7 { address, axis } => {
                let mut nodes = self.t7s.iter().map(|node| node.lock().unwrap());
                let node = nodes.find(|node| node.settings().address == address.get())?;
                i64::from(node.angle_at(axis_number(axis), self.now * 1_000)) * 1_000
            }
            Source::Isu { .. } | Source::Pwm { .. } => {
                self.isu_motion.at(self.now * 1_000) - i64::from(self.isu().null()) * 360_000_000 / 65_536
            }
            Source::Off | Source::Incomplete { .. } => return None,
        };
        let from_zero = said - i64::from(config.soft_zero.udeg());
        let counted = if config.direction == Direction::Reversed { -from_zero } else { from_zero };
        Some(counted.rem_euclid(TURN * 1_000) / 1_000)
    }

    /// How far a published angle is from what the slot should say, in 0.001°; `None` while it is not *ok*.
    pub fn error(&mut self, slot: usize) -> Option<i64> {
        let said = i64::from(self.reading(slot).angle(Instant::from_micros(self.now))?.mdeg());
        let off = (said - self.truth(slot)?).rem_euclid(TURN);
        Some(off.min(TURN - off))
    }
}

/// Anything that a slot may be told about its number.
pub fn any_config(config: SlotConfig, dice: &mut Dice) -> SlotConfig {
    let samples = 1 + dice.below(8) as u8;
    SlotConfig {
        filter: dice.one_of(&[Filter::Off, Filter::Mean, Filter::Median]),
        samples: dice.one_of(&[samples, 8]),
        direction: dice.one_of(&[Direction::Normal, Direction::Reversed]),
        range: dice.one_of(&[Range::Bidirectional, Range::Unidirectional]),
        soft_zero: Angle::from_mdeg(dice.below(360_000) as i32).unwrap(),
        confirm: dice.below(4) > 0,
        max_rate: dice.one_of(&[0, config.max_rate, 400_000]),
        ..config
    }
}

pub fn t7_axis(number: u64) -> t7::Axis {
    if number == 0 { Axis::Zero } else { Axis::Two }
}

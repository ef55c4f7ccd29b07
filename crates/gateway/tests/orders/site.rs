//! A gateway whose T7 bus is a simulated segment with real time on it. The ISU bus is not connected.

use std::sync::{Arc, Mutex};

use clino_bus::{Duration, Instant, Serial, Timing, earliest, line};
use clino_codec::{pwm, t7};
use clino_commissioning::t7::Device;
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::TaskEvent;
use clino_gateway::{Action, Bus, BusChange, Gateway, Requester, Settings, SlotConfig, Source};
use clino_segment::chance::Chance;
use clino_segment::{Noise, SegmentSettings as Segment};
use clino_sim::motion::Motion;
use clino_sim::t7::{Identity, Options, StoredSettings as Memory, T7};
use clino_testkit::rig::{Port, sensor};

pub type Sensor = Arc<Mutex<T7>>;

/// A request that went out.
#[derive(Clone, Debug)]
pub struct Sent {
    pub at: Instant,
    pub baud: u32,
    pub bytes: Vec<u8>,
}

pub struct Site {
    pub gateway: Gateway,
    pub port: Port,
    pub sensors: Vec<Sensor>,
    /// Every request, in order.
    pub sent: Vec<Sent>,
    /// The line settings that the bus was given, and when.
    pub runs: Vec<(Instant, Timing, line::LineSettings)>,
    /// The events of all tasks.
    pub news: Vec<TaskEvent>,
    /// TaskEvent is fetched as it comes.
    pub prompt: bool,
}

/// A T7 at 30°. Its memory holds `baud_index` of 115200, 57600, 38400, 19200, 9600.
pub fn t7(address: u8, baud_index: u8, motion: Motion) -> Sensor {
    let identity = Identity { serial: 1000 + u32::from(address), ..Identity::default() };
    let memory = Memory { address, baud_index, damping_ms: 20, ..Memory::default() };
    let options =
        Options { motion: [Motion::Constant(0), Motion::Constant(0), motion], ..Options::default() };
    Arc::new(Mutex::new(T7::new(identity, memory, options).unwrap()))
}

pub fn address(number: u8) -> t7::Address {
    t7::Address::new(number).unwrap()
}

pub fn device(number: u8) -> Device {
    Device::at(address(number)).unwrap()
}

/// A slot that reads axis 2 of a T7.
pub fn slot(number: u8) -> SlotConfig {
    let source = Source::T7 { address: address(number), axis: t7::Axis::Two };
    SlotConfig::usual(source).every(Duration::from_millis(40))
}

impl Site {
    /// Each sensor is read by a slot of its own.
    pub fn new(sensors: Vec<Sensor>) -> Site {
        let settings = Segment { chance: Chance::new(1), echo: false, noise: Noise::default() };
        let table: Vec<_> =
            sensors.iter().map(|sensor| slot(sensor.lock().unwrap().settings().address)).collect();
        let stations = sensors.iter().map(|t7| sensor("t7", Box::new(Arc::clone(t7)))).collect();
        let timing = Timing::t7(Serial::T7_DEFAULT);
        Site {
            gateway: Gateway::new(
                &Settings::new(&table, timing, Timing::isu()),
                pwm::Limits::new(84_000_000),
            ),
            port: Port::with_line(timing.line(), settings, stations),
            sensors,
            sent: Vec::new(),
            runs: Vec::new(),
            news: Vec::new(),
            prompt: true,
        }
    }

    pub fn now(&self) -> Instant {
        self.port.now()
    }

    pub fn order(&mut self, order: Order) -> Result<(), Refusal> {
        self.gateway.carry_out(order, Requester::Console)
    }

    pub fn change(&mut self, change: BusChange) -> Result<(), Refusal> {
        self.order(Order::Bus { bus: Bus::T7, change })
    }

    /// Lets time pass.
    pub fn run(&mut self, span: Duration) {
        let until = self.now() + span;
        while self.now() < until {
            self.poll();
            let now = self.now();
            let next = earliest(self.gateway.poll_at(Bus::T7), Some(until)).unwrap_or(until);
            // What is due and not done waits for the line.
            let at = if next <= now { now + Duration::from_micros(20) } else { next.min(until) };
            if let Some(event) = self.port.run(at) {
                self.gateway.line(Bus::T7, event);
            }
        }
    }

    /// Lets time pass until there is no task and no news is left.
    pub fn finish(&mut self) {
        let begun = self.now();
        while self.gateway.progress(Bus::T7).is_some() || self.gateway.has_task_event(Requester::Console) {
            self.run(Duration::from_micros(1_000));
            self.fetch();
            assert!(self.now().since(begun) < Duration::from_micros(60_000_000), "a task does not end");
        }
    }

    pub fn fetch(&mut self) {
        self.news.extend(self.gateway.task_event(Requester::Console));
    }

    fn poll(&mut self) {
        let now = self.now();
        let (port, sent, runs) = (&mut self.port, &mut self.sent, &mut self.runs);
        self.gateway.poll(Bus::T7, now, |action| match action {
            Action::Send(frame) => {
                let baud = port.line().settings().serial.baud;
                sent.push(Sent { at: now, baud, bytes: frame.to_vec() });
                port.submit(frame, now + Duration::from_micros(10_000)).expect("the line is idle");
            }
            Action::Run(timing, line) => {
                port.set_serial(timing.serial, timing.guard);
                runs.push((now, timing, line));
            }
        });
        if self.prompt {
            self.fetch();
        }
    }
}

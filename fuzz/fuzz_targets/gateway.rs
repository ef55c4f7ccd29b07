//! Anything on both buses, the PWM inputs and from those who give orders: time always moves on, and no slot is *ok* but
//! with the angle of an intact answer of its own sensor.
//!
//! Input: what happens, step by step. A frame that the gateway sends is out at once.
#![no_main]

use clino_bus::{Duration, Event, Instant, Serial, Timing};
use clino_codec::character::{Character, LineErrors};
use clino_codec::pwm::{Limits, Ticks};
use clino_codec::{isu, t7};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, Rates};
use clino_gateway::config::{Ask, Filter};
use clino_gateway::order::Order;
use clino_gateway::{
    Action, Requester, Bus, BusChange, Capture, Gateway, PwmInput, Settings, SlotConfig, Source, Status, task,
};
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;

/// Polls in a row that may be due without time going on: a change of settings, the end of a task, its news.
const AT_ONCE: usize = 8;
/// The PWM timers, Hz.
const CLOCK: u32 = 84_000_000;

fuzz_target!(|input: &[u8]| {
    let mut input = Unstructured::new(input);
    let mut world = World::new();
    while !input.is_empty() && world.step(&mut input).is_ok() {
        world.run();
        world.look();
    }
});

struct World {
    gateway: Gateway,
    now: Instant,
    wires: [Wire; 2],
    /// PWM cycles that were handed in.
    cycles: [bool; 2],
}

/// What a bus's port knows.
#[derive(Default)]
struct Wire {
    /// The last frame that the gateway sent.
    asked: Vec<u8>,
    /// What was heard; `None` is a character that the receiver complains of.
    heard: Vec<Option<u8>>,
}

fn axis(number: u8) -> t7::Axis {
    t7::Axis::new(number % 3).unwrap()
}

fn t7_at(number: u8) -> t7::Address {
    t7::Address::new(number % 4 + 1).unwrap()
}

fn isu_at(number: u8) -> isu::Address {
    isu::Address::new(number % 3 + 1).unwrap()
}

fn source(kind: u8, address: u8) -> Source {
    match kind % 5 {
        0 => Source::Off,
        1 => Source::T7 { address: t7_at(address), axis: axis(address >> 2) },
        2 => Source::Isu { address: isu_at(address) },
        3 => Source::Pwm { input: PwmInput::Pwm1 },
        _ => Source::Pwm { input: PwmInput::Pwm2 },
    }
}

const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

impl World {
    fn new() -> World {
        let table = [(1, 0), (1, 5), (2, 0), (2, 1), (3, 0)].map(|(k, a)| SlotConfig::usual(source(k, a)));
        let settings = Settings::new(&table, Timing::t7(Serial::T7_DEFAULT), Timing::isu());
        let gateway = Gateway::new(&settings, Limits::new(CLOCK));
        World { gateway, now: Instant::ZERO, wires: Default::default(), cycles: [false; 2] }
    }

    fn step(&mut self, input: &mut Unstructured<'_>) -> Result<()> {
        let kind: u8 = input.arbitrary()?;
        let bus = usize::from(kind & 1);
        match kind >> 1 & 0xF {
            0 => self.pass(input.arbitrary::<u8>()?.into()),
            1 => self.pass(u64::from(input.arbitrary::<u16>()?) * 20),
            // To where something is due.
            2 | 3 => {
                if let Some(at) = self.gateway.poll_at(BUSES[bus]) {
                    self.pass(at.micros_since(self.now));
                }
            }
            4 => self.hears(bus, &[input.arbitrary()?], true),
            5 => self.hears(bus, &[input.arbitrary()?], false),
            6 => {
                let length = usize::from(input.arbitrary::<u8>()? % 80).min(input.len());
                let bytes = input.bytes(length)?;
                self.hears(bus, bytes, true);
            }
            7 => self.hears_whole(bus, input)?,
            8..=10 => self.answer(bus, input.arbitrary()?),
            11 => self.event(bus, input.arbitrary()?),
            12 => self.capture(bus, input)?,
            13 | 14 => self.order(input)?,
            _ => _ = self.gateway.task_event(if bus == 0 { Requester::Console } else { Requester::Modbus }),
        }
        Ok(())
    }

    fn pass(&mut self, micros: u64) {
        // A day at most: what waits for longer, waits.
        self.now = Instant::from_micros(self.now.as_micros().saturating_add(micros.min(86_400_000_000)));
    }

    fn hears(&mut self, bus: usize, bytes: &[u8], clean: bool) {
        for &byte in bytes {
            let errors = if clean { LineErrors::NONE } else { LineErrors::FRAMING };
            let character = Character { byte, errors };
            self.wires[bus].heard.push(clean.then_some(byte));
            self.gateway.line(BUSES[bus], Event::Heard { character, at: self.now });
        }
    }

    /// Any content with a right checksum.
    fn hears_whole(&mut self, bus: usize, input: &mut Unstructured<'_>) -> Result<()> {
        let length = usize::from(input.arbitrary::<u8>()? % 80).min(input.len());
        let content = input.bytes(length)?.to_vec();
        self.hears_sealed(bus, content);
        Ok(())
    }

    fn hears_sealed(&mut self, bus: usize, mut content: Vec<u8>) {
        content.push(checksum(bus, &content));
        self.hears(bus, &content, true);
    }

    /// The sensor that was asked for its angle says so; what else was asked is not answered here.
    fn answer(&mut self, bus: usize, angle: u16) {
        let [high, low] = angle.to_be_bytes();
        let content = match (bus, &self.wires[bus].asked[..]) {
            // Get Angle: millidegrees in four bytes.
            (0, &[address, _, command @ 0x81..=0x83, ..]) => vec![address, 0x06, command, 0, 0, high, low],
            // Get All Angles: three of them, and a temperature.
            (0, &[address, _, 0x80, ..]) => {
                [&[address, 0x10, 0x80][..], &[0, 0, high, low].repeat(3), &[0x08, 0xFC]].concat()
            }
            // Two bytes of RAM.
            (1, &[_, head, 0x58, ..]) => vec![0x04, head | 1, 0x58, high, low],
            _ => return,
        };
        self.hears_sealed(bus, content);
    }

    fn event(&mut self, bus: usize, code: u8) {
        let at = self.now;
        let event = match code % 5 {
            0 => Event::Released { at },
            1 => Event::Forced { at },
            2 => Event::GivenUp { at },
            3 => Event::Echo { at },
            _ => Event::Contention { at },
        };
        self.gateway.line(BUSES[bus], event);
    }

    fn capture(&mut self, input: usize, from: &mut Unstructured<'_>) -> Result<()> {
        let capture = match from.arbitrary::<u8>()? % 5 {
            0 => Capture::LostEdge,
            1 => Capture::NoSignal { high: from.arbitrary()? },
            2 => Capture::Cycle(Ticks { period: from.arbitrary()?, high: from.arbitrary()? }),
            // 30 Hz.
            _ => Capture::Cycle(Ticks { period: 2_800_000, high: u32::from(from.arbitrary::<u16>()?) * 43 }),
        };
        self.cycles[input] |= matches!(capture, Capture::Cycle(_));
        self.gateway.pwm([PwmInput::Pwm1, PwmInput::Pwm2][input], capture, self.now);
        Ok(())
    }

    fn order(&mut self, input: &mut Unstructured<'_>) -> Result<()> {
        let [kind, a, b, c]: [u8; 4] = input.arbitrary()?;
        let device = Device::at(t7_at(a)).unwrap();
        let module = Module::at(isu_at(a)).unwrap();
        let order = match kind % 10 {
            0..=2 => {
                let config = SlotConfig {
                    ask: if c & 1 == 0 { Ask::Angle } else { Ask::Everything },
                    confirm: c & 2 != 0,
                    filter: if c & 4 == 0 { Filter::Off } else { Filter::Median },
                    samples: c >> 4,
                    partner: (c & 8 != 0).then_some(c >> 4),
                    ..SlotConfig::usual(source(kind >> 4, b))
                };
                Order::Slot { slot: a % 50, config }
            }
            3 => {
                let change = BusChange {
                    baud: [None, Some(9_600), Some(57_600), Some(1)][usize::from(a & 3)],
                    guard: (b & 2 != 0).then_some(Duration::from_micros(c.into())),
                    ..BusChange::NONE
                };
                Order::Bus { bus: BUSES[usize::from(b & 1)], change }
            }
            4 => Order::Cancel(BUSES[usize::from(a & 1)]),
            5 => Order::T7(match b % 5 {
                0 => task::t7::Task::Identify(device),
                1 => task::t7::Task::Sweep(Rates::ALL),
                2 => task::t7::Task::Zero(device, axis(c)),
                3 => task::t7::Task::Address { from: t7_at(a), to: t7_at(c) },
                _ => task::t7::Task::Baud(device, t7::BaudRate::B9600),
            }),
            6 => Order::Isu(match b % 4 {
                0 => task::isu::Task::Identify(module),
                1 => task::isu::Task::Reset(module),
                2 => task::isu::Task::ResetNull(module),
                _ => task::isu::Task::Repair(module),
            }),
            7 => Order::Isu(task::isu::Task::Program(
                module,
                isu::eeprom::Change::NullPosition(u16::from_be_bytes([b, c])),
            )),
            _ => return Ok(()),
        };
        let accepted = self.gateway.carry_out(order, if c & 1 == 0 { Requester::Console } else { Requester::Modbus });
        assert!(accepted.is_err() || order.check().is_ok());
        Ok(())
    }

    /// Both buses are polled until nothing is due.
    fn run(&mut self) {
        for (bus, wire) in BUSES.into_iter().zip(&mut self.wires) {
            let mut polls = 0;
            while self.gateway.poll_at(bus).is_some_and(|at| at <= self.now) {
                polls += 1;
                assert!(polls <= AT_ONCE, "{bus:?} never has enough");
                let mut sent = false;
                self.gateway.poll(bus, self.now, |action| {
                    if let Action::Send(frame) = action {
                        wire.asked = frame.to_vec();
                        sent = true;
                    }
                });
                if sent {
                    self.gateway.line(bus, Event::Released { at: self.now });
                }
            }
        }
    }

    /// Whatever changed is true.
    fn look(&mut self) {
        while let Some(reading) = self.gateway.next_changed() {
            let Some(raw) = reading.raw(self.now) else { continue };
            assert_eq!(reading.status(self.now), Status::Ok);
            let said = match reading.source {
                Source::Off | Source::Incomplete { .. } => false,
                Source::T7 { address, axis } => self.wires[0].t7_said(address.get(), axis, raw.udeg()),
                Source::Isu { address } => self.wires[1].isu_said(address.get(), raw.udeg()),
                Source::Pwm { input } => self.cycles[usize::from(input != PwmInput::Pwm1)],
            };
            assert!(said, "no source for {reading:?}");
        }
    }
}

impl Wire {
    /// What was heard in a row without complaint, of this length and with a right checksum.
    fn frames(&self, bus: usize, length: usize) -> impl Iterator<Item = Vec<u8>> {
        self.heard.windows(length).filter_map(move |window| {
            let bytes: Vec<u8> = window.iter().copied().collect::<Option<_>>()?;
            let (last, content) = bytes.split_last()?;
            (*last == checksum(bus, content)).then_some(bytes)
        })
    }

    /// Get Angle, Get All Angles or Get All Data: T7 guide sections 2.1 and 2.3.
    fn t7_said(&self, address: u8, axis: t7::Axis, udeg: i32) -> bool {
        let axis = axis as usize;
        let says = |frame: &[u8], at: usize| {
            let angle = i32::from_be_bytes(frame[at..at + 4].try_into().unwrap());
            frame[0] == address && angle.checked_mul(1_000) == Some(udeg)
        };
        self.frames(0, 8).any(|frame| frame[1..3] == [0x06, 0x81 + axis as u8] && says(&frame, 3))
            || self.frames(0, 18).any(|frame| frame[1..3] == [0x10, 0x80] && says(&frame, 3 + 4 * axis))
            || self.frames(0, 34).any(|frame| frame[1] == 0x20 && says(&frame, 3 + 4 * axis))
    }

    /// Two bytes of RAM: AN #201 section 4.
    fn isu_said(&self, address: u8, udeg: i32) -> bool {
        self.frames(1, 6).any(|frame| {
            let counts = i64::from(u16::from_be_bytes([frame[3], frame[4]]));
            let angle = counts * 360_000_000 / 65_536;
            frame[1] >> 4 == address && frame[2] == 0x58 && (angle - i64::from(udeg)).abs() <= 1
        })
    }
}

/// T7: all bytes together sum to zero. ISU: the sum of all but the first.
fn checksum(bus: usize, content: &[u8]) -> u8 {
    let sum = |bytes: &[u8]| bytes.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte));
    match bus {
        0 => sum(content).wrapping_neg(),
        _ => sum(content.get(1..).unwrap_or(&[])),
    }
}

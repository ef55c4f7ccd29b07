//! Orders and tasks in any order, at any time, against a model that knows only what was acknowledged.
//!
//! - What was acknowledged and not superseded is in force in the end: in the settings, and on the line.
//! - After an acknowledgement no request leaves at another bit rate than the acknowledged one, but for a task whose
//!   business that is.
//! - Nothing is sent within the documents' silence after a change of the bit rate.
//! - An order is refused as busy if it changes what a task works on, and only then.

use std::collections::BTreeMap;

use clino_bus::line::EchoMode;
use clino_bus::{Duration, Instant, Serial, Timing};
use clino_codec::angle::Angle;
use clino_codec::t7::{Axis, BaudRate};
use clino_commissioning::t7::{DeviceSetting, Rates};
use clino_commissioning::{Report, SettingChange};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::t7::Task;
use clino_gateway::task::{TaskEvent, t7 as told};
use clino_gateway::{Bus, BusChange, Requester, SlotConfig, Source};
use clino_sim::motion::Motion;
use proptest::prelude::*;

use super::site::{Site, address, device, slot, t7};

/// T7 guide section 1: a command has to arrive within 500 ms.
const DEAF: Duration = Duration::from_micros(500_000);
/// Rates and a character of each, rounded up, in microseconds: 10 bits.
const RATES: [(u32, u64, BaudRate); 3] =
    [(115_200, 87, BaudRate::B115200), (57_600, 174, BaudRate::B57600), (9_600, 1_042, BaudRate::B9600)];
const NODES: u8 = 3;

#[derive(Clone, Debug)]
enum Act {
    Bus { rate: Option<usize>, guard: Option<u64>, pre: Option<u64>, post: Option<u64>, echo: bool },
    Slot { slot: u8, node: u8, retries: u8, zero: bool },
    Off(u8),
    Task(Work),
    Cancel,
}

#[derive(Clone, Copy, Debug)]
enum Work {
    Identify(u8),
    Sweep,
    SweepAll,
    Damping(u8, u16),
    Zero(u8),
    Address(u8, u8),
    Baud(u8, usize),
}

impl Work {
    fn order(self, now: u32) -> Order {
        Order::T7(match self {
            Work::Identify(node) => Task::Identify(device(node)),
            Work::Sweep => {
                Task::Sweep(Rates::NONE.and(BaudRate::from_bits_per_second(now).expect("a rate of a T7")))
            }
            Work::SweepAll => Task::Sweep(Rates::ALL),
            Work::Damping(node, ms) => Task::Set(device(node), DeviceSetting::Damping(ms)),
            Work::Zero(node) => Task::Zero(device(node), Axis::Two),
            Work::Address(from, to) => Task::Address { from: address(from), to: address(to) },
            Work::Baud(node, rate) => Task::Baud(device(node), RATES[rate].2),
        })
    }
}

fn act() -> impl Strategy<Value = Act> {
    let node = 1..=NODES + 1;
    let work = prop_oneof![
        3 => node.clone().prop_map(Work::Identify),
        1 => Just(Work::Sweep),
        1 => Just(Work::SweepAll),
        2 => (node.clone(), 20..40_u16).prop_map(|(node, ms)| Work::Damping(node, ms)),
        2 => node.clone().prop_map(Work::Zero),
        3 => (node.clone(), node.clone()).prop_map(|(from, to)| Work::Address(from, to)),
        5 => (node.clone(), 0..RATES.len()).prop_map(|(node, rate)| Work::Baud(node, rate)),
    ];
    let us = |most: u64| prop::option::of(0..most);
    prop_oneof![
        5 => (prop::option::of(0..RATES.len()), us(400), us(60), us(60), any::<bool>())
            .prop_map(|(rate, guard, pre, post, echo)| Act::Bus { rate, guard, pre, post, echo }),
        4 => (0..4_u8, node, 0..5_u8, any::<bool>())
            .prop_map(|(slot, node, retries, zero)| Act::Slot { slot, node, retries, zero }),
        1 => (0..4_u8).prop_map(Act::Off),
        6 => work.prop_map(Act::Task),
        1 => Just(Act::Cancel),
    ]
}

/// Mostly one upon the other, sometimes after a task or a silence.
fn pause() -> impl Strategy<Value = u64> {
    prop_oneof![2 => Just(0), 4 => 0..40_000_u64, 2 => 0..700_000_u64]
}

/// What was acknowledged.
struct Model {
    baud: u32,
    /// As set by hand; `None` is the usual one.
    guard: Option<u64>,
    pre: u64,
    post: u64,
    echo: EchoMode,
    slots: BTreeMap<u8, SlotConfig>,
    task: Option<Work>,
}

fn usual_guard(baud: u32) -> u64 {
    RATES.iter().find(|rate| rate.0 == baud).expect("a rate of the table").1
}

fn node_of(config: &SlotConfig) -> Option<u8> {
    config.source.node().map(|(_, node)| node)
}

impl Model {
    fn new() -> Model {
        let slots = (0..NODES).map(|number| (number, slot(number + 1))).collect();
        Model { baud: 115_200, guard: None, pre: 0, post: 0, echo: EchoMode::Off, slots, task: None }
    }

    fn guard(&self) -> u64 {
        self.guard.unwrap_or(usual_guard(self.baud))
    }

    fn set_guard(&mut self, us: u64) {
        self.guard = (us != usual_guard(self.baud)).then_some(us);
    }

    /// Whether an order has to be refused as busy.
    fn is_busy(&self, act: &Act) -> bool {
        let Some(task) = self.task else { return false };
        match *act {
            Act::Task(_) => true,
            Act::Bus { rate: Some(rate), .. } => matches!(task, Work::Baud(..)) || RATES[rate].0 != self.baud,
            Act::Slot { slot: number, node, zero, .. } => {
                let before = self.slots.get(&number);
                let same = before.is_some_and(|before| node_of(before) == Some(node));
                match task {
                    Work::Address(from, to) => !same && (node == from || node == to),
                    Work::Zero(of) => {
                        let keeps = same && before.is_some_and(|before| before.soft_zero != Angle::ZERO);
                        node == of && zero && !keeps
                    }
                    _ => false,
                }
            }
            _ => false,
        }
    }

    fn acknowledged(&mut self, act: &Act) {
        match *act {
            Act::Bus { rate, guard, pre, post, echo } => {
                self.baud = rate.map_or(self.baud, |rate| RATES[rate].0);
                guard.into_iter().for_each(|us| self.set_guard(us));
                (self.pre, self.post) = (pre.unwrap_or(self.pre), post.unwrap_or(self.post));
                self.echo = if echo { EchoMode::Detect } else { self.echo };
            }
            Act::Slot { slot, node, retries, zero } => {
                self.slots.insert(slot, config(node, retries, zero));
            }
            Act::Off(slot) => _ = self.slots.insert(slot, SlotConfig::OFF),
            Act::Task(work) => self.task = Some(work),
            Act::Cancel => {}
        }
    }

    fn told(&mut self, news: &TaskEvent) {
        let TaskEvent::T7(news) = news else { panic!("{news:?}") };
        let task = match news {
            told::TaskEvent::Found(_) => return,
            _ => self.task.take().expect("a task"),
        };
        match (news, task) {
            (told::TaskEvent::Baud(Report { change: SettingChange::Changed { to, .. }, .. }), _) => {
                self.baud = to.bits_per_second();
            }
            (
                told::TaskEvent::Address(Report { change: SettingChange::Changed { .. }, .. }),
                Work::Address(from, to),
            ) => {
                for config in self.slots.values_mut().filter(|config| node_of(config) == Some(from)) {
                    config.source = Source::T7 { address: address(to), axis: Axis::Two };
                }
            }
            (told::TaskEvent::Zeroed(_), Work::Zero(node)) => {
                for config in self.slots.values_mut().filter(|config| node_of(config) == Some(node)) {
                    config.soft_zero = Angle::ZERO;
                }
            }
            _ => {}
        }
    }
}

fn config(node: u8, retries: u8, zero: bool) -> SlotConfig {
    let soft_zero = Angle::from_mdeg(if zero { 5_000 } else { 0 }).unwrap();
    SlotConfig { retries, soft_zero, ..slot(node) }
}

struct Trial {
    site: Site,
    model: Model,
    /// Requests that were looked at.
    seen: usize,
    /// The last change of the bit rate that was no task's, and how many there were.
    changed: Option<Instant>,
    runs: usize,
    /// A task that chooses its bit rate itself has been at work since the last look.
    free: bool,
}

impl Trial {
    fn pass(&mut self, us: u64) -> Result<(), TestCaseError> {
        let until = self.site.now() + Duration::from_micros(us as u32);
        loop {
            self.look()?;
            if self.site.now() >= until {
                return Ok(());
            }
            self.site.run(Duration::from_micros(500).min(until.since(self.site.now())));
        }
    }

    fn look(&mut self) -> Result<(), TestCaseError> {
        self.free |= matches!(self.model.task, Some(Work::Baud(..) | Work::SweepAll));
        let (sent, runs) = (&self.site.sent[self.seen..], &self.site.runs[self.runs..]);
        if !self.free {
            for (at, timing, _) in runs {
                let before = self.site.runs.iter().rfind(|run| run.0 < *at);
                if before.map_or(115_200, |run| run.1.serial.baud) != timing.serial.baud {
                    self.changed = Some(*at);
                }
            }
            for sent in sent {
                prop_assert_eq!(sent.baud, self.model.baud, "{:?} with {:?}", sent, self.model.task);
                if let Some(changed) = self.changed {
                    prop_assert!(
                        sent.at < changed || sent.at.since(changed) >= DEAF,
                        "{:?} {:?}",
                        sent,
                        changed
                    );
                }
            }
        }
        (self.seen, self.runs) = (self.site.sent.len(), self.site.runs.len());
        self.free = false;
        for news in std::mem::take(&mut self.site.news) {
            self.model.told(&news);
        }
        self.free = matches!(self.model.task, Some(Work::Baud(..) | Work::SweepAll));
        Ok(())
    }

    fn order(&mut self, act: &Act) -> Result<(), TestCaseError> {
        let order = match *act {
            Act::Bus { rate, guard, pre, post, echo } => Order::Bus {
                bus: Bus::T7,
                change: BusChange {
                    baud: rate.map(|rate| RATES[rate].0),
                    guard: guard.map(|us| Duration::from_micros(us as u32)),
                    pre_delay: pre.map(|us| Duration::from_micros(us as u32)),
                    post_delay: post.map(|us| Duration::from_micros(us as u32)),
                    echo: echo.then_some(EchoMode::Detect),
                },
            },
            Act::Slot { slot, node, retries, zero } => {
                Order::Slot { slot, config: config(node, retries, zero) }
            }
            Act::Off(slot) => Order::Slot { slot, config: SlotConfig::OFF },
            Act::Task(work) => work.order(self.model.baud),
            Act::Cancel => Order::Cancel(Bus::T7),
        };
        let expected = if self.model.is_busy(act) { Err(Refusal::Busy) } else { Ok(()) };
        prop_assert_eq!(self.site.order(order), expected, "{:?} during {:?}", act, self.model.task);
        if expected.is_ok() {
            self.model.acknowledged(act);
        }
        Ok(())
    }

    fn in_force(&self) -> Result<(), TestCaseError> {
        let Model { baud, pre, post, echo, .. } = self.model;
        let timing =
            Timing { guard: Duration::from_micros(self.model.guard() as u32), ..Timing::t7(Serial { baud }) };
        let line = clino_bus::line::LineSettings {
            pre_delay: Duration::from_micros(pre as u32),
            post_delay: Duration::from_micros(post as u32),
            echo,
            ..timing.line()
        };
        let shown = self.site.gateway.bus_settings(Bus::T7);
        prop_assert_eq!((shown.timing, shown.line), (timing, line), "told");
        prop_assert!(self.site.gateway.is_in_force(Bus::T7));
        prop_assert_eq!(*self.site.gateway.timing(Bus::T7), timing, "awaited");
        if let Some((_, run, at)) = self.site.runs.last() {
            prop_assert_eq!((*run, *at), (timing, line), "run");
        } else {
            prop_assert_eq!(timing, Timing::t7(Serial::T7_DEFAULT));
        }
        for number in 0..6 {
            let expected = self.model.slots.get(&number).copied().unwrap_or(SlotConfig::OFF);
            prop_assert_eq!(self.site.gateway.config(number.into()), Some(&expected), "slot {}", number);
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, ..ProptestConfig::default() })]

    #[test]
    fn what_was_acknowledged_last_is_in_force(acts in prop::collection::vec((act(), pause()), 1..14)) {
        let sensors = (1..=NODES).map(|node| t7(node, 0, Motion::Constant(30_000_000))).collect();
        let mut trial =
            Trial { site: Site::new(sensors), model: Model::new(), seen: 0, changed: None, runs: 0, free: false };
        trial.pass(100_000)?;
        for (act, pause) in &acts {
            trial.look()?;
            trial.order(act)?;
            trial.pass(*pause)?;
        }
        let begun = trial.site.now();
        while trial.site.gateway.progress(Bus::T7).is_some() {
            trial.pass(20_000)?;
            prop_assert!(trial.site.now().since(begun) < Duration::from_micros(60_000_000), "a task does not end");
        }
        trial.pass(1_000_000)?;
        prop_assert!(!trial.site.gateway.has_task_event(Requester::Console));
        trial.in_force()?;
    }
}

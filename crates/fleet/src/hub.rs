//! The state of every gateway, and the news of it.
//!
//! Sources tell, outputs look or listen. An output that listens has a queue of its own, without a bound: the bridge empties
//! it at once, a browser that is slow is dropped (`page/events.rs`).

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde_json::{Map, Value};
use tokio::sync::mpsc;

use crate::clock::Wall;
use crate::config::{Config, Gateway as GatewayConfig};
use crate::sensor::Outcome;

/// What a source says.
#[derive(Clone, Debug)]
pub enum Told {
    /// The gateway is there and speaks.
    Speaks,
    /// It is not, and why.
    Gone(String),
    /// Which start of which board this is.
    Start(Start),
    /// An outcome of a sensor.
    Outcome(u16, Outcome),
    /// A change of an alarm, as the gateway's line has it.
    Alarm(Alarm),
    /// The gateway as a whole.
    Summary(Vec<Arc<str>>),
    /// Health of a bus: lines of one kind, by bus.
    Bus(BusLine),
}

/// Which start of which board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// Version of the firmware.
    pub version: String,
    /// Power-ups and resets since: together they identify the start.
    pub power_ups: u32,
    /// See `power_ups`.
    pub boots: u32,
    /// Unique number of the chip.
    pub uid: String,
    /// Mode: `normal`, `safe` or `bare`.
    pub mode: String,
    /// What ended the time before, in the gateway's words.
    pub cause: String,
    /// Starts since power-up that ended in a crash.
    pub crashes: u32,
}

impl Start {
    /// The identity of this start among all starts of the board.
    pub fn boot(&self) -> String {
        format!("{}.{}", self.power_ups, self.boots)
    }
}

/// A change of an alarm.
#[derive(Clone, Debug, PartialEq)]
pub struct Alarm {
    /// Of this slot.
    pub slot: u16,
    /// `high`, `low`, `rate` or `no_value`.
    pub name: Arc<str>,
    /// `active`, `acknowledged`, `unacknowledged` or `quiet`.
    pub state: Arc<str>,
    /// The value furthest beyond the limit, and its unit.
    pub extreme: Option<f64>,
    /// `deg` or `deg_s`.
    pub unit: Option<Arc<str>>,
    /// When the alarm was raised.
    pub raised: Option<Wall>,
}

/// Counters of a bus, or times, as a line of the console has them.
#[derive(Clone, Debug, PartialEq)]
pub struct BusLine {
    /// `t7` or `isu`.
    pub bus: Arc<str>,
    /// `stats`, `line`, `times` or `bus_fault`.
    pub kind: Arc<str>,
    /// Names and values.
    pub values: Map<String, Value>,
}

/// News of a gateway.
#[derive(Clone, Debug)]
pub struct News {
    /// Its number in the configuration.
    pub gateway: usize,
    /// When it came.
    pub at: Instant,
    /// The same on the wall clock.
    pub wall: Wall,
    /// What came.
    pub told: Told,
}

/// The state of a gateway.
#[derive(Clone, Debug)]
pub struct GatewayState {
    /// Its name and how it is read.
    pub config: Arc<GatewayConfig>,
    /// Why it does not speak; `None` while it does.
    pub gone: Option<String>,
    /// Its start, where known.
    pub start: Option<Start>,
    /// Its sensors by slot.
    pub sensors: BTreeMap<u16, Outcome>,
    /// Alarms that are not quiet, by slot and name.
    pub alarms: BTreeMap<(u16, Arc<str>), Alarm>,
    /// What it declares of itself.
    pub signals: Vec<Arc<str>>,
    /// Health of its buses, by bus and kind.
    pub buses: BTreeMap<(Arc<str>, Arc<str>), Map<String, Value>>,
    /// Starts that were seen since this program began, the first not counted.
    pub restarts: u32,
}

impl GatewayState {
    fn apply(&mut self, told: &Told) {
        match told {
            Told::Speaks => self.gone = None,
            Told::Gone(why) => {
                self.gone = Some(why.clone());
                self.alarms.clear();
                self.signals.clear();
                self.buses.clear();
                for outcome in self.sensors.values_mut() {
                    *outcome = outcome.gone();
                }
            }
            Told::Start(start) => {
                if self.start.as_ref().is_some_and(|known| known != start) {
                    self.restarts = self.restarts.saturating_add(1);
                    self.alarms.clear();
                }
                self.start = Some(start.clone());
            }
            Told::Outcome(slot, outcome) => {
                if &*outcome.status == DISABLED {
                    self.sensors.remove(slot);
                } else {
                    self.sensors.insert(*slot, outcome.clone());
                }
            }
            Told::Alarm(alarm) => {
                let key = (alarm.slot, alarm.name.clone());
                if &*alarm.state == QUIET {
                    self.alarms.remove(&key)
                } else {
                    self.alarms.insert(key, alarm.clone())
                };
            }
            Told::Summary(signals) => self.signals.clone_from(signals),
            Told::Bus(line) => {
                self.buses.insert((line.bus.clone(), line.kind.clone()), line.values.clone());
            }
        }
    }
}

/// The gateway's word for a slot that is switched off.
pub const DISABLED: &str = "disabled";
/// The gateway's word for an alarm that is none.
const QUIET: &str = "quiet";

/// All gateways.
pub struct Hub {
    gateways: Vec<Mutex<GatewayState>>,
    listeners: Mutex<Vec<Listener>>,
}

/// An output that listens: to one gateway or to all.
struct Listener {
    gateway: Option<usize>,
    to: mpsc::UnboundedSender<Arc<News>>,
}

/// What a source does not get around to for longer than this is not known: its first state.
const NOT_YET: &str = "not heard yet";

impl Hub {
    /// All gateways of a configuration, none of which has been heard.
    pub fn new(config: &Config) -> Hub {
        let of = |gateway: &GatewayConfig| {
            Mutex::new(GatewayState {
                config: Arc::new(gateway.clone()),
                gone: Some(NOT_YET.into()),
                start: None,
                sensors: BTreeMap::new(),
                alarms: BTreeMap::new(),
                signals: Vec::new(),
                buses: BTreeMap::new(),
                restarts: 0,
            })
        };
        Hub { gateways: config.gateway.iter().map(of).collect(), listeners: Mutex::new(Vec::new()) }
    }

    /// How many gateways there are.
    pub fn len(&self) -> usize {
        self.gateways.len()
    }

    /// The state of a gateway.
    pub fn gateway(&self, number: usize) -> Option<MutexGuard<'_, GatewayState>> {
        Some(locked(self.gateways.get(number)?))
    }

    /// The number of the gateway of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.gateways.iter().position(|gateway| locked(gateway).config.name.as_str() == name)
    }

    /// News of all gateways from now on.
    pub fn listen(&self) -> mpsc::UnboundedReceiver<Arc<News>> {
        self.add_listener(None)
    }

    /// News of one gateway from now on.
    pub fn listen_to(&self, gateway: usize) -> mpsc::UnboundedReceiver<Arc<News>> {
        self.add_listener(Some(gateway))
    }

    fn add_listener(&self, gateway: Option<usize>) -> mpsc::UnboundedReceiver<Arc<News>> {
        let (to, receiver) = mpsc::unbounded_channel();
        locked(&self.listeners).push(Listener { gateway, to });
        receiver
    }

    /// A source says something.
    pub fn tell(&self, gateway: usize, told: Told) {
        let (at, wall) = (Instant::now(), Wall::now());
        let Some(mut state) = self.gateway(gateway) else { return };
        if matches!(&told, Told::Gone(why) if state.gone.as_ref() == Some(why)) {
            return;
        }
        if matches!(told, Told::Speaks) && state.gone.is_none() {
            return;
        }
        state.apply(&told);
        // While the state is locked, so that news of a gateway come in the order of its states.
        let news = Arc::new(News { gateway, at, wall, told });
        let wants = |listener: &Listener| listener.gateway.is_none_or(|wanted| wanted == gateway);
        locked(&self.listeners).retain(|listener| !wants(listener) || listener.to.send(news.clone()).is_ok());
    }
}

/// A panic of another thread leaves states that are whole: they are replaced, not edited in steps.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

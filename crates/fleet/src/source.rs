//! Sources: a gateway's console, a gateway's Modbus port, a bus without a gateway.
//!
//! A source runs until the program ends. It opens its port, tells what it hears, and when the port fails or falls silent
//! tells that it is gone, and tries again. Nothing that was heard before is told twice.

mod bytes;
mod console;
mod lines;
mod modbus;
mod registers;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clino_codec::angle::Angle;
use tokio::sync::mpsc;

use crate::clock::Wall;
use crate::config::{Bus, Config, Endpoint, Make, Modbus, ModbusEndpoint, Source};
use crate::hub::{Hub, Told};
use crate::say::say;
use crate::sensor::Outcome;

/// From one try to open a port to the next.
const TRY_AGAIN: Duration = Duration::from_secs(1);

/// A command for a gateway's console, and where its answer goes.
pub struct Command {
    /// Without its line end.
    pub line: String,
    /// The objects of the answer, the last of which ends it; or why there is none.
    pub answer: tokio::sync::oneshot::Sender<Result<Vec<serde_json::Value>, String>>,
}

/// Reads a bus without a gateway: opens the port, polls, and feeds what it hears until the feed says that it is over.
/// Blocking; the PC tool brings it along, with the bus master that its other commands use.
pub type ReadBus = Arc<dyn Fn(&Bus, &Feed) -> Result<(), String> + Send + Sync>;

/// Where a bus reader's readings go.
pub struct Feed {
    hub: Arc<Hub>,
    gateway: usize,
    over: Arc<AtomicBool>,
}

/// A reading of a bus reader.
#[derive(Clone, Copy, Debug)]
pub struct BusReading<'a> {
    /// Its place in the list of addresses.
    pub slot: u16,
    /// Address on the bus.
    pub address: u8,
    /// `ok`, or why there is no angle, in the gateway's words.
    pub status: &'a str,
    /// While the status is *ok*.
    pub angle: Option<Angle>,
    /// When the answer was received, if it was good.
    pub measured: Option<Instant>,
    /// Counter of outcomes of this sensor.
    pub outcome: u32,
}

impl Feed {
    /// Whether the program ends.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// The port is open.
    pub fn speaks(&self) {
        self.hub.tell(self.gateway, Told::Speaks);
    }

    /// A reading.
    pub fn reading(&self, make: Make, reading: &BusReading<'_>) {
        let kind: Arc<str> = if make == Make::T7 { "t7" } else { "isu" }.into();
        let age = reading.measured.map(|measured| measured.elapsed());
        let age_ms = age.map(|age| u64::try_from(age.as_millis()).unwrap_or(u64::MAX));
        let outcome = Outcome {
            bus: kind.clone(),
            kind,
            address: reading.address,
            status: reading.status.into(),
            angle: reading.angle,
            measured: age_ms.map(|ms| Wall::now().minus_ms(ms)),
            measured_at: reading.measured,
            health: Vec::new(),
            outcome: reading.outcome,
        };
        self.hub.tell(self.gateway, Told::Outcome(reading.slot, outcome));
    }
}

/// The sources at work.
pub struct Sources {
    over: Arc<AtomicBool>,
    /// For gateways with a console, where its commands go.
    commands: Vec<Option<mpsc::Sender<Command>>>,
}

/// Says of a port whose name may lead to another adapter after the computer's next start how to name it.
fn advise(source: &Source) {
    let port = match source {
        Source::Console(Endpoint::Serial(port))
        | Source::Modbus(Modbus { port: ModbusEndpoint::Rtu(Endpoint::Serial(port)), .. }) => port,
        Source::Bus(bus) => Path::new(&bus.port),
        _ => return,
    };
    if let Some(stable) = clino_adapter::stable_name(port) {
        let (port, stable) = (port.display(), stable.display());
        say(format!(
            "{port} may be another adapter when this computer starts again; {stable} stays this one"
        ));
    }
}

/// Commands that wait for a console.
const COMMANDS: usize = 8;

impl Sources {
    /// Begins to read all gateways.
    pub fn start(config: &Config, hub: &Arc<Hub>, read_bus: &ReadBus) -> Sources {
        let over = Arc::new(AtomicBool::new(false));
        let mut commands = Vec::new();
        for (number, gateway) in config.gateway.iter().enumerate() {
            advise(&gateway.source);
            let hub = hub.clone();
            let mut sender = None;
            match gateway.source.clone() {
                Source::Console(port) => {
                    let (to, from) = mpsc::channel(COMMANDS);
                    sender = Some(to);
                    tokio::spawn(console::run(port, hub, number, from));
                }
                Source::Modbus(modbus) => {
                    tokio::spawn(modbus::run(modbus, hub, number));
                }
                Source::Bus(bus) => {
                    let feed = Feed { hub, gateway: number, over: over.clone() };
                    let read = read_bus.clone();
                    tokio::task::spawn_blocking(move || read_bus_again_and_again(&bus, &feed, &read));
                }
            }
            commands.push(sender);
        }
        Sources { over, commands }
    }

    /// Where commands for this gateway go, if it takes any.
    pub fn commands(&self, gateway: usize) -> Option<mpsc::Sender<Command>> {
        self.commands.get(gateway)?.clone()
    }
}

impl Drop for Sources {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

fn read_bus_again_and_again(bus: &Bus, feed: &Feed, read: &ReadBus) {
    while !feed.is_over() {
        if let Err(why) = read(bus, feed) {
            feed.hub.tell(feed.gateway, Told::Gone(format!("{}: {why}", bus.port)));
        }
        std::thread::sleep(TRY_AGAIN);
    }
}

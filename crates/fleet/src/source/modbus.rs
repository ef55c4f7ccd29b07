//! A gateway's Modbus port: polls the fast blocks.
//!
//! Angles and ages of one request are from one state of the gateway, so that a value and its age always belong together. The
//! status codes come with another request; an angle is there only while its slot's status is *ok*, which is what counts.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval, sleep, timeout};
use tokio_modbus::client::{Context, Reader as _, rtu, tcp};
use tokio_modbus::slave::Slave;

use clino_codec::angle::Angle;
use clino_gateway::MAX_SLOTS;
use clino_modbus::map::{SLOT_BASE, SLOT_STRIDE};

use super::registers::{self, FAST, FAST2, GATEWAY, Identity, START};
use super::{TRY_AGAIN, bytes};
use crate::clock::Wall;
use crate::config::{Endpoint, Modbus, ModbusEndpoint, Parity};
use crate::hub::{Alarm, Hub, Told};
use crate::sensor::{OK, Outcome};

/// An answer takes up to 0.6 s at 2400 bit/s, and half a second longer while the gateway erases a sector.
const ANSWER: Duration = Duration::from_secs(2);
/// Requests in a row that may fail before the gateway counts as gone.
const FAILURES: u32 = 3;
/// Kind and address of slot 0: the last two registers of its block.
const SLOT_IDENTITY: u16 = SLOT_BASE + SLOT_STRIDE - 2;

/// Runs the source until the program ends.
pub async fn run(config: Modbus, hub: Arc<Hub>, gateway: usize) {
    loop {
        let why = match connect(&config).await {
            Ok(context) => Poll::new(context, &config, &hub, gateway).run().await,
            Err(why) => why,
        };
        let port = config.port.to_string();
        let why = if why.starts_with(&port) { why } else { format!("{port}: {why}") };
        hub.tell(gateway, Told::Gone(why));
        sleep(TRY_AGAIN).await;
    }
}

async fn connect(config: &Modbus) -> Result<Context, String> {
    let slave = Slave(config.unit);
    Ok(match &config.port {
        ModbusEndpoint::Rtu(port) => {
            rtu::attach_slave(bytes::open(port, config.baud, config.parity).await?, slave)
        }
        ModbusEndpoint::Tcp(address) => {
            let stream = bytes::open(&Endpoint::Tcp(address.clone()), config.baud, Parity::None).await?;
            tcp::attach_slave(stream, slave)
        }
    })
}

/// One connection.
struct Poll<'a> {
    context: Context,
    config: &'a Modbus,
    hub: &'a Hub,
    gateway: usize,
    known: BTreeMap<u16, Known>,
    start: Option<(Instant, u32)>,
    alarms: u64,
}

/// What is known of a slot.
struct Known {
    kind: Arc<str>,
    address: u8,
    status: Arc<str>,
    angle: Option<Angle>,
    measured: Option<(Wall, Instant)>,
    outcome: u32,
}

impl<'a> Poll<'a> {
    fn new(context: Context, config: &'a Modbus, hub: &'a Hub, gateway: usize) -> Poll<'a> {
        Poll { context, config, hub, gateway, known: BTreeMap::new(), start: None, alarms: 0 }
    }

    async fn run(mut self) -> String {
        let mut due = interval(self.config.every);
        due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut failures = 0;
        loop {
            due.tick().await;
            match self.poll().await {
                Ok(()) => failures = 0,
                Err(why) => {
                    failures += 1;
                    if failures >= FAILURES {
                        return why;
                    }
                }
            }
        }
    }

    async fn read(&mut self, (first, count): (u16, u16)) -> Result<Vec<u16>, String> {
        match timeout(ANSWER, self.context.read_holding_registers(first, count)).await {
            Err(_) => Err(format!("no answer within {} s", ANSWER.as_secs())),
            Ok(Err(why)) => Err(why.to_string()),
            Ok(Ok(Err(exception))) => Err(format!("registers from 0x{first:04X}: {exception}")),
            Ok(Ok(Ok(registers))) if registers.len() == usize::from(count) => Ok(registers),
            Ok(Ok(Ok(registers))) => Err(format!("{} registers instead of {count}", registers.len())),
        }
    }

    async fn poll(&mut self) -> Result<(), String> {
        let block = self.read(GATEWAY).await?;
        let identity = registers::identity(&block)?;
        self.hub.tell(self.gateway, Told::Speaks);
        self.note_start(&identity).await?;
        let second = self.read(FAST2).await?;
        // Last, so that the ages are the youngest: they are subtracted from this instant.
        let first = self.read(FAST).await?;
        let (at, wall) = (Instant::now(), Wall::now());
        let mut values = registers::values(&first, false);
        values.extend(registers::values(&second, true));
        let statuses = registers::statuses(&second).to_vec();
        for (slot, (value, code)) in (0_u16..).zip(values.iter().zip(statuses)) {
            let told = registers::status(code);
            if &*told == "disabled" {
                if self.known.remove(&slot).is_some() {
                    self.tell_disabled(slot);
                }
                continue;
            }
            // An angle is there if and only if it is right: the code may be of a later state.
            let status = match (value.angle, &*told) {
                (Some(_), _) => OK.into(),
                (None, OK) => "stale".into(),
                (None, _) => told,
            };
            if !self.known.contains_key(&slot) {
                let identity = self.read((SLOT_IDENTITY + slot * SLOT_STRIDE, 2)).await?;
                let [kind, address] = identity[..] else { continue };
                let kind = registers::kind(kind);
                let address = u8::try_from(address).unwrap_or_default();
                let known =
                    Known { kind, address, status: "".into(), angle: None, measured: None, outcome: 0 };
                self.known.insert(slot, known);
            }
            let Some(known) = self.known.get_mut(&slot) else { continue };
            if let Some(ms) = value.age_ms.map(u64::from) {
                let then = at.checked_sub(Duration::from_millis(ms));
                // The age says the same instant again until a new value comes; its reading wavers by milliseconds.
                known.measured = then.map(|then| (wall.minus_ms(ms), then));
            }
            (known.status, known.angle) = (status, value.angle);
            known.outcome = known.outcome.wrapping_add(1);
            let outcome = known.outcome();
            self.hub.tell(self.gateway, Told::Outcome(slot, outcome));
        }
        self.hub.tell(self.gateway, Told::Summary(identity.signals.clone()));
        self.note_alarms(identity.alarms);
        Ok(())
    }

    /// A start is noticed by an uptime that is shorter than what has passed.
    async fn note_start(&mut self, identity: &Identity) -> Result<(), String> {
        let now = Instant::now();
        let is_known = self.start.is_some_and(|(at, uptime_s)| {
            let passed = u32::try_from(now.duration_since(at).as_secs()).unwrap_or(u32::MAX);
            identity.uptime_s.saturating_add(2) >= uptime_s.saturating_add(passed)
        });
        self.start = Some((now, identity.uptime_s));
        if is_known {
            return Ok(());
        }
        let block = self.read(START).await?;
        let start = registers::start(&block, identity);
        self.known.clear();
        self.hub.tell(self.gateway, Told::Start(start));
        Ok(())
    }

    /// Over this door the bridge reads whether a slot has an alarm, not which.
    fn note_alarms(&mut self, now: u64) {
        for slot in 0..MAX_SLOTS as u16 {
            let (was, is) = (self.alarms >> slot & 1, now >> slot & 1);
            if was != is {
                let state = if is != 0 { "active" } else { "quiet" };
                let alarm = Alarm {
                    slot,
                    name: "any".into(),
                    state: state.into(),
                    extreme: None,
                    unit: None,
                    raised: None,
                };
                self.hub.tell(self.gateway, Told::Alarm(alarm));
            }
        }
        self.alarms = now;
    }

    fn tell_disabled(&self, slot: u16) {
        let off = Known {
            kind: "off".into(),
            address: 0,
            status: "disabled".into(),
            angle: None,
            measured: None,
            outcome: 0,
        };
        self.hub.tell(self.gateway, Told::Outcome(slot, off.outcome()));
    }
}

impl Known {
    fn outcome(&self) -> Outcome {
        let bus = match &*self.kind {
            "pwm" => format!("pwm{}", self.address).into(),
            _ => self.kind.clone(),
        };
        // As the console has it: a PWM input has a bus, and no address.
        let address = if &*self.kind == "pwm" { 0 } else { self.address };
        Outcome {
            bus,
            kind: self.kind.clone(),
            address,
            status: self.status.clone(),
            angle: self.angle,
            measured: self.measured.map(|(wall, _)| wall),
            measured_at: self.measured.map(|(_, at)| at),
            health: Vec::new(),
            outcome: self.outcome,
        }
    }
}

//! The edge node of a gateway: its connections, one after the other.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use prost::Message as _;
use rumqttc::{AsyncClient, Event, LastWill, Outgoing as Sent, Packet, QoS};
use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, interval, sleep_until, timeout};

use super::Shared;
use super::message::{Metric, Payload, Value, datatype};
use super::outbox::Outbox;
use super::reading::{Reading, Record, metric};
use crate::clock::Wall;
use crate::config::Mqtt;
use crate::health::BridgeHealth;
use crate::hub::{DISABLED, Hub, News, Told};
use crate::mqtt::{WINDOW, connect, options};
use crate::queue::{Held as _, Queue, TICK};
use crate::say::say;
use crate::sensor::{Outcome, SOURCE_GONE};
use crate::store;

const TRY_AGAIN: Duration = Duration::from_secs(2);
/// How long the last messages may take when the program ends.
const FAREWELL: Duration = Duration::from_secs(2);
/// `seq` and `bdSeq` count modulo 256.
const MODULUS: u64 = 256;
const REBIRTH: &str = "Node Control/Rebirth";
/// Records that are sent together: of history, a message has up to so much of a device.
const RECORDS: usize = 64;
/// Barriers that may be on their way before more is sent: what hundreds of nodes send at once must not swamp the broker.
const BARRIERS: usize = 1;

/// An edge node.
pub struct Node {
    mqtt: Mqtt,
    hub: Arc<Hub>,
    gateway: usize,
    name: String,
    queue: Shared,
    health: Arc<BridgeHealth>,
    /// How many nodes of the bridge are.
    connected: Arc<AtomicUsize>,
    is_connected: bool,
    seq: u64,
    /// `bdSeq` of this connection.
    birth: u64,
    /// Devices that were born on this connection.
    alive: BTreeSet<u32>,
    /// Those of them that have no source.
    lent: BTreeSet<u32>,
    /// Readings for the next record, and when it is due.
    batch: Vec<Reading>,
    due: Option<Instant>,
    /// Records below this number came before the births.
    born_at: u64,
    /// Records below this number were sent on this connection.
    sent: u64,
    outbox: Outbox,
}

impl Node {
    /// Of this gateway, by its number and name.
    pub fn new(
        mqtt: &Mqtt,
        hub: &Arc<Hub>,
        (gateway, name): (usize, String),
        queue: Shared,
        (health, connected): (Arc<BridgeHealth>, Arc<AtomicUsize>),
    ) -> Node {
        Node {
            mqtt: mqtt.clone(),
            hub: hub.clone(),
            gateway,
            outbox: Outbox::new(String::new()),
            name,
            queue,
            health,
            connected,
            is_connected: false,
            seq: 0,
            birth: 0,
            alive: BTreeSet::new(),
            lent: BTreeSet::new(),
            batch: Vec::new(),
            due: None,
            born_at: 0,
            sent: 0,
        }
    }

    /// Runs until `over` is true.
    pub async fn run(
        mut self,
        mut over: watch::Receiver<bool>,
        mut news: mpsc::UnboundedReceiver<Arc<News>>,
    ) {
        let mut said = String::new();
        loop {
            let end = self.connection(&mut over, &mut news).await;
            if std::mem::take(&mut self.is_connected) {
                self.connected.fetch_sub(1, Ordering::Relaxed);
                said.clear();
            }
            let Err(why) = end else { return };
            self.health.lost.fetch_add(1, Ordering::Relaxed);
            // Hundreds of nodes have one reason: each says it once.
            if said != why {
                say(format_args!("broker, edge node {}: {why}", self.name));
                said = why;
            }
            self.birth = (self.birth + 1) % MODULUS;
            let again = Instant::now() + TRY_AGAIN;
            loop {
                let due = self.due;
                tokio::select! {
                    () = sleep_until(again.into()) => break,
                    () = ended(&mut over) => return self.store_rest(&mut news),
                    () = sleep_until(due.unwrap_or(again).into()), if due.is_some() => self.store_batch(),
                    Some(news) = news.recv() => self.collect(&news),
                }
            }
        }
    }

    fn topic(&self, kind: &str, device: Option<u32>) -> String {
        let device = device.map(|slot| format!("/slot-{slot}")).unwrap_or_default();
        format!("spBv1.0/{}/{kind}/{}{device}", self.mqtt.group, self.name)
    }

    /// One connection, from the try to its end: `Ok` if the program ends.
    async fn connection(
        &mut self,
        over: &mut watch::Receiver<bool>,
        news: &mut mpsc::UnboundedReceiver<Arc<News>>,
    ) -> Result<(), String> {
        self.alive.clear();
        self.lent.clear();
        self.queue.with(Queue::rewind);
        self.sent = 0;
        // A topic below one that no other client publishes to.
        self.outbox = Outbox::new(self.topic("NCMD", None) + "/barrier");
        let client = format!("{}-{}", self.mqtt.bridge, self.name);
        let mut options = options(&self.mqtt, &client)?;
        let death = Payload { timestamp: Some(now()), metrics: vec![self.birth_metric()], seq: None };
        let death = (self.topic("NDEATH", None), death.encode_to_vec());
        options.set_last_will(LastWill::new(&death.0, death.1.clone(), QoS::AtLeastOnce, false));
        // Room for the window, barriers, and the subscription.
        let (client, mut events, pump) = connect(options, usize::from(WINDOW) * 2);
        let end = self.session(&client, &mut events, over, news).await;
        if end.is_ok() {
            self.store_rest(news);
            if self.is_connected {
                // What is not confirmed by then waits on disk; a broker that does not take it has the last will.
                let _ = timeout(FAREWELL, self.farewell(&client, &mut events, death)).await;
            }
        }
        pump.abort();
        end
    }

    async fn session(
        &mut self,
        client: &AsyncClient,
        events: &mut mpsc::Receiver<Result<Event, String>>,
        over: &mut watch::Receiver<bool>,
        news: &mut mpsc::UnboundedReceiver<Arc<News>>,
    ) -> Result<(), String> {
        let mut tick = interval(TICK);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            self.send(client);
            let due = self.due;
            tokio::select! {
                biased;
                event = events.recv() => self.take(&event.ok_or("the client ended")??, client),
                () = ended(over) => return Ok(()),
                () = sleep_until(due.unwrap_or_else(Instant::now).into()), if due.is_some() => self.store_batch(),
                _ = tick.tick() => self.outbox.mark(self.sent),
                Some(news) = news.recv() => self.collect(&news),
            }
        }
    }

    /// Says that the node goes, behind everything that waits, and disconnects.
    async fn farewell(
        &mut self,
        client: &AsyncClient,
        events: &mut mpsc::Receiver<Result<Event, String>>,
        (topic, death): (String, Vec<u8>),
    ) {
        loop {
            self.send(client);
            if self.outbox.is_empty() {
                self.outbox.mark(self.sent);
                self.outbox.send(client);
                if self.outbox.unanswered() == 0 {
                    break;
                }
            }
            let Some(Ok(event)) = events.recv().await else { return };
            self.take(&event, client);
        }
        // As the death certificate, but said: the broker drops the will when the client disconnects.
        let _ = client.try_publish(topic, QoS::AtLeastOnce, false, death);
        let _ = client.try_disconnect();
        while events.recv().await.is_some_and(|event| event.is_ok()) {}
    }

    fn take(&mut self, event: &Event, client: &AsyncClient) {
        match event {
            Event::Incoming(Packet::ConnAck(_)) => {
                self.is_connected = true;
                self.connected.fetch_add(1, Ordering::Relaxed);
                // If the client has ended, its event says so.
                let _ = client.try_subscribe(self.topic("NCMD", None), QoS::AtLeastOnce);
                self.be_born();
            }
            Event::Incoming(Packet::Publish(command)) if asks_for_rebirth(&command.payload) => self.be_born(),
            Event::Outgoing(Sent::Publish(_)) => self.outbox.sent(),
            Event::Incoming(Packet::UnsubAck(_)) => {
                if let Some(number) = self.outbox.answered() {
                    let confirmed = self.queue.with(|queue| queue.confirm_below(number));
                    self.health.confirmed.fetch_add(confirmed, Ordering::Relaxed);
                }
            }
            _ => {}
        }
    }

    /// Takes news: readings into the next record, a start into new births.
    fn collect(&mut self, news: &News) {
        let mut readings = Vec::new();
        match &news.told {
            Told::Outcome(slot, outcome) => readings.push(Reading::of(*slot, outcome, news.wall)),
            Told::Gone(_) => {
                if let Some(state) = self.hub.gateway(self.gateway) {
                    let gone = state.sensors.iter().map(|(slot, outcome)| (slot, outcome.gone()));
                    readings.extend(gone.map(|(slot, outcome)| Reading::of(*slot, &outcome, news.wall)));
                }
            }
            Told::Start(_) if self.is_connected => self.be_born(),
            _ => {}
        }
        if self.batch.is_empty() && !readings.is_empty() {
            self.due = Some(news.at + Duration::from_millis(self.mqtt.collect_ms.into()));
        }
        self.batch.extend(readings);
    }

    /// The record is whole: it waits for its turn.
    fn store_batch(&mut self) {
        self.due = None;
        if self.batch.is_empty() {
            return;
        }
        let record = Record { readings: std::mem::take(&mut self.batch) };
        let message = store::Message { topic: String::new(), payload: record.encode_to_vec(), retain: false };
        self.queue.with(|queue| queue.push(message, Instant::now()));
    }

    /// The program ends: what its sources have told by then is kept.
    fn store_rest(&mut self, news: &mut mpsc::UnboundedReceiver<Arc<News>>) {
        while let Ok(news) = news.try_recv() {
            self.collect(&news);
        }
        self.store_batch();
    }

    /// Hands over what waits, as much as the connection takes.
    fn send(&mut self, client: &AsyncClient) {
        if !self.is_connected {
            return;
        }
        if self.outbox.is_empty() && self.outbox.unanswered() < BARRIERS {
            self.take_from_queue();
        }
        self.outbox.send(client);
    }

    fn take_from_queue(&mut self) {
        let taken = self
            .queue
            .with(|queue| std::iter::from_fn(|| queue.send_next()).take(RECORDS).collect::<Vec<_>>());
        let mut past: BTreeMap<u32, Vec<Metric>> = BTreeMap::new();
        let are_many = taken.len() == RECORDS;
        for (number, message) in taken {
            self.sent = number + 1;
            for reading in Record::read(&message.payload).readings {
                if number < self.born_at {
                    self.lend_life(&reading);
                    past.entry(reading.slot).or_default().extend(reading.metrics(true));
                } else {
                    self.tell_past(&mut past);
                    self.tell(&reading);
                }
            }
        }
        self.tell_past(&mut past);
        if self.sent >= self.born_at {
            for slot in std::mem::take(&mut self.lent) {
                self.die(slot);
            }
        }
        if are_many {
            self.outbox.mark(self.sent);
        }
    }

    /// History needs a device that was born.
    fn lend_life(&mut self, reading: &Reading) {
        if self.alive.insert(reading.slot) {
            self.lent.insert(reading.slot);
            self.publish(
                "DBIRTH",
                Some(reading.slot),
                reading.gone().birth(self.sensor_name(reading.slot).as_deref()),
            );
        }
    }

    fn tell_past(&mut self, past: &mut BTreeMap<u32, Vec<Metric>>) {
        for (slot, metrics) in std::mem::take(past) {
            self.publish("DDATA", Some(slot), metrics);
        }
    }

    /// A reading of now.
    fn tell(&mut self, reading: &Reading) {
        if [SOURCE_GONE, DISABLED].contains(&reading.status.as_str()) {
            self.die(reading.slot);
        } else if self.alive.insert(reading.slot) || self.lent.remove(&reading.slot) {
            let name = self.sensor_name(reading.slot);
            self.publish("DBIRTH", Some(reading.slot), reading.birth(name.as_deref()));
        } else {
            self.publish("DDATA", Some(reading.slot), reading.metrics(false));
        }
    }

    fn die(&mut self, slot: u32) {
        if self.alive.remove(&slot) {
            self.publish("DDEATH", Some(slot), Vec::new());
        }
    }

    fn sensor_name(&self, slot: u32) -> Option<String> {
        let slot = u16::try_from(slot).ok()?;
        self.hub.gateway(self.gateway)?.config.sensor(slot).map(str::to_owned)
    }

    /// All births: of the node, then of the devices that have a source.
    fn be_born(&mut self) {
        self.store_batch();
        self.born_at = self.queue.with(|queue| queue.end());
        self.seq = 0;
        self.lent.clear();
        let (node, devices) = {
            let Some(state) = self.hub.gateway(self.gateway) else { return };
            let mut node = vec![
                self.birth_metric(),
                metric(REBIRTH, datatype::BOOLEAN, Some(Value::Boolean(false)), now()),
            ];
            if let Some(start) = &state.start {
                for (name, text) in [
                    ("Properties/Firmware", &start.version),
                    ("Properties/Boot", &start.boot()),
                    ("Properties/Cause", &start.cause),
                ] {
                    node.push(metric(name, datatype::STRING, Some(Value::Text(text.clone())), now()));
                }
            }
            let sensors = state.sensors.iter().filter(|_| state.gone.is_none());
            let device = |(slot, outcome): (&u16, &Outcome)| {
                let reading = Reading::of(*slot, outcome, Wall::now());
                (reading.slot, reading.birth(state.config.sensor(*slot)))
            };
            (node, sensors.map(device).collect::<BTreeMap<_, _>>())
        };
        self.publish("NBIRTH", None, node);
        self.alive = devices.keys().copied().collect();
        for (slot, metrics) in devices {
            self.publish("DBIRTH", Some(slot), metrics);
        }
    }

    fn birth_metric(&self) -> Metric {
        metric("bdSeq", datatype::INT64, Some(Value::Long(self.birth)), now())
    }

    fn publish(&mut self, kind: &str, device: Option<u32>, metrics: Vec<Metric>) {
        let payload = Payload { timestamp: Some(now()), metrics, seq: Some(self.seq) };
        self.seq = (self.seq + 1) % MODULUS;
        self.outbox.push(self.topic(kind, device), payload.encode_to_vec());
    }
}

/// The program ends.
async fn ended(over: &mut watch::Receiver<bool>) {
    // What it refers to must not be held while something else is awaited.
    let _ = over.wait_for(|over| *over).await;
}

fn now() -> u64 {
    u64::try_from(Wall::now().0).unwrap_or_default()
}

fn asks_for_rebirth(payload: &[u8]) -> bool {
    Payload::decode(payload).is_ok_and(|payload| {
        payload.metrics.iter().any(|metric| {
            metric.name.as_deref() == Some(REBIRTH) && metric.value == Some(Value::Boolean(true))
        })
    })
}

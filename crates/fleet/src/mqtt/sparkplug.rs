//! Sparkplug B: a gateway is an edge node, a slot is a device.
//!
//! Source: Eclipse Sparkplug 3.0.0. An edge node has its own connection, because its death certificate (NDEATH) is the last
//! will of that connection. Both certificates of a connection carry the same `bdSeq`. After the birth of the node (NBIRTH)
//! comes that of each device (DBIRTH), then data (DDATA). A device whose source is gone dies (DDEATH). The command *Rebirth*
//! is answered with all births.
//!
//! Values that come while the broker is away wait in memory, up to [`BACKLOG`] for each gateway, and are sent as historical.

mod message;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use prost::Message as _;
use rumqttc::{AsyncClient, Event, LastWill, Packet, QoS};
use tokio::sync::{mpsc, watch};
use tokio::time::{sleep, timeout};

use self::message::{Metric, Payload, PropertySet, PropertyValue, Value, datatype};
use crate::clock::Wall;
use crate::config::Mqtt;
use crate::hub::{GatewayState, Hub, News, Told};
use crate::say::say;
use crate::sensor::{Outcome, degrees};

/// Values of a gateway that wait while the broker is away: five minutes of 32 sensors at 1 Hz.
const BACKLOG: usize = 9_600;
const TRY_AGAIN: Duration = Duration::from_secs(2);
/// Messages on their way to the client.
const ROOM: usize = 64;
const FAREWELL: Duration = Duration::from_secs(1);
/// `seq` and `bdSeq` count modulo 256.
const MODULUS: u64 = 256;
const REBIRTH: &str = "Node Control/Rebirth";

/// Runs the edge node of a gateway until `over` is true.
pub async fn run(
    mqtt: Mqtt,
    hub: Arc<Hub>,
    gateway: usize,
    over: watch::Receiver<bool>,
    news: mpsc::UnboundedReceiver<Arc<News>>,
) {
    let Some(name) = hub.gateway(gateway).map(|state| state.config.name.to_string()) else { return };
    let node =
        Node { mqtt, hub, gateway, name, seq: 0, birth: 0, alive: BTreeSet::new(), backlog: VecDeque::new() };
    node.run(over, news).await;
}

struct Node {
    mqtt: Mqtt,
    hub: Arc<Hub>,
    gateway: usize,
    name: String,
    seq: u64,
    birth: u64,
    /// Devices that were born on this connection.
    alive: BTreeSet<u16>,
    backlog: VecDeque<(u16, Outcome)>,
}

impl Node {
    async fn run(mut self, mut over: watch::Receiver<bool>, mut news: mpsc::UnboundedReceiver<Arc<News>>) {
        loop {
            match self.connect(&mut over, &mut news).await {
                Ok(()) => return,
                Err(why) => say(format_args!("broker, edge node {}: {why}", self.name)),
            }
            self.birth = (self.birth + 1) % MODULUS;
            self.alive.clear();
            let pause = sleep(TRY_AGAIN);
            tokio::pin!(pause);
            loop {
                tokio::select! {
                    () = &mut pause => break,
                    () = ended(&mut over) => return,
                    Some(news) = news.recv() => self.keep(&news),
                }
            }
        }
    }

    fn topic(&self, kind: &str, device: Option<u16>) -> String {
        let device = device.map(|slot| format!("/slot-{slot}")).unwrap_or_default();
        format!("spBv1.0/{}/{kind}/{}{device}", self.mqtt.group, self.name)
    }

    async fn connect(
        &mut self,
        over: &mut watch::Receiver<bool>,
        news: &mut mpsc::UnboundedReceiver<Arc<News>>,
    ) -> Result<(), String> {
        let client = format!("{}-{}", self.mqtt.bridge, self.name);
        let mut options = super::options(&self.mqtt, &client)?;
        let death = Payload { timestamp: Some(now()), metrics: vec![self.birth_metric()], seq: None };
        options.set_last_will(LastWill::new(
            self.topic("NDEATH", None),
            death.encode_to_vec(),
            QoS::AtLeastOnce,
            false,
        ));
        let (client, mut events, pump) = super::connect(options, ROOM);
        let end = self.session(&client, &mut events, over, news).await;
        if end.is_ok() {
            // As the death certificate, but said: the broker drops the will when the client disconnects.
            let farewell = async {
                let _ = client
                    .publish(self.topic("NDEATH", None), QoS::AtLeastOnce, false, death.encode_to_vec())
                    .await;
                let _ = client.disconnect().await;
                while events.recv().await.is_some_and(|event| event.is_ok()) {}
            };
            let _ = timeout(FAREWELL, farewell).await;
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
        let mut is_connected = false;
        loop {
            tokio::select! {
                biased;
                event = events.recv() => match event.ok_or("the client ended")?? {
                    Event::Incoming(Packet::ConnAck(_)) => {
                        is_connected = true;
                        let commands = self.topic("NCMD", None);
                        client.subscribe(commands, QoS::AtLeastOnce).await.map_err(|why| why.to_string())?;
                        self.be_born(client).await?;
                        while let Some((slot, outcome)) = self.backlog.pop_front() {
                            self.data(client, slot, &outcome, true).await?;
                        }
                    }
                    Event::Incoming(Packet::Publish(command)) if asks_for_rebirth(&command.payload) => self.be_born(client).await?,
                    _ => {}
                },
                () = ended(over) => return Ok(()),
                Some(news) = news.recv() => {
                    if is_connected {
                        self.tell(client, &news).await?;
                    } else {
                        self.keep(&news);
                    }
                }
            }
        }
    }

    /// Keeps a value until the broker is there again.
    fn keep(&mut self, news: &News) {
        if let (true, Told::Outcome(slot, outcome)) = (news.gateway == self.gateway, &news.told) {
            if self.backlog.len() >= BACKLOG {
                self.backlog.pop_front();
            }
            self.backlog.push_back((*slot, outcome.clone()));
        }
    }

    async fn tell(&mut self, client: &AsyncClient, news: &News) -> Result<(), String> {
        if news.gateway != self.gateway {
            return Ok(());
        }
        match &news.told {
            Told::Outcome(slot, outcome) if self.alive.contains(slot) => {
                self.data(client, *slot, outcome, false).await
            }
            Told::Outcome(slot, outcome) => {
                self.alive.insert(*slot);
                let metrics = device_metrics(*slot, outcome, self.sensor_name(*slot), false, true);
                self.publish(client, "DBIRTH", Some(*slot), metrics).await
            }
            Told::Gone(_) => {
                for slot in std::mem::take(&mut self.alive) {
                    self.publish(client, "DDEATH", Some(slot), Vec::new()).await?;
                }
                Ok(())
            }
            Told::Start(_) => self.be_born(client).await,
            _ => Ok(()),
        }
    }

    fn sensor_name(&self, slot: u16) -> Option<String> {
        self.hub.gateway(self.gateway)?.config.sensor(slot).map(str::to_owned)
    }

    async fn data(
        &mut self,
        client: &AsyncClient,
        slot: u16,
        outcome: &Outcome,
        is_historical: bool,
    ) -> Result<(), String> {
        if !self.alive.contains(&slot) {
            return Ok(());
        }
        let metrics = device_metrics(slot, outcome, None, is_historical, false);
        self.publish(client, "DDATA", Some(slot), metrics).await
    }

    /// All births: of the node, then of the devices that have a source.
    async fn be_born(&mut self, client: &AsyncClient) -> Result<(), String> {
        self.seq = 0;
        let (node, devices) = {
            let Some(state) = self.hub.gateway(self.gateway) else { return Ok(()) };
            let devices: BTreeMap<u16, Outcome> =
                if state.gone.is_none() { state.sensors.clone() } else { BTreeMap::new() };
            (self.node_metrics(&state), devices)
        };
        self.publish(client, "NBIRTH", None, node).await?;
        self.alive = devices.keys().copied().collect();
        for (slot, outcome) in &devices {
            let metrics = device_metrics(*slot, outcome, self.sensor_name(*slot), false, true);
            self.publish(client, "DBIRTH", Some(*slot), metrics).await?;
        }
        Ok(())
    }

    fn birth_metric(&self) -> Metric {
        metric("bdSeq", datatype::INT64, Some(Value::Long(self.birth)))
    }

    fn node_metrics(&self, state: &GatewayState) -> Vec<Metric> {
        let mut metrics =
            vec![self.birth_metric(), metric(REBIRTH, datatype::BOOLEAN, Some(Value::Boolean(false)))];
        if let Some(start) = &state.start {
            for (name, text) in [
                ("Properties/Firmware", &start.version),
                ("Properties/Boot", &start.boot()),
                ("Properties/Cause", &start.cause),
            ] {
                metrics.push(metric(name, datatype::STRING, Some(Value::Text(text.clone()))));
            }
        }
        metrics
    }

    async fn publish(
        &mut self,
        client: &AsyncClient,
        kind: &str,
        device: Option<u16>,
        metrics: Vec<Metric>,
    ) -> Result<(), String> {
        let payload = Payload { timestamp: Some(now()), metrics, seq: Some(self.seq) };
        self.seq = (self.seq + 1) % MODULUS;
        let sent = client.publish(self.topic(kind, device), QoS::AtMostOnce, false, payload.encode_to_vec());
        sent.await.map_err(|why| why.to_string())
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

fn metric(name: &str, datatype: u32, value: Option<Value>) -> Metric {
    Metric {
        name: Some(name.to_owned()),
        timestamp: Some(now()),
        datatype: Some(datatype),
        is_historical: None,
        is_null: value.is_none().then_some(true),
        properties: None,
        value,
    }
}

/// Metrics of a sensor: its angle, which is null unless it is right and fresh, and why.
fn device_metrics(
    slot: u16,
    outcome: &Outcome,
    name: Option<String>,
    is_historical: bool,
    is_birth: bool,
) -> Vec<Metric> {
    let angle = outcome.value().map(|angle| Value::Double(degrees(angle)));
    let mut angle = metric("Angle", datatype::DOUBLE, angle);
    if let Some(measured) = outcome.measured {
        angle.timestamp = u64::try_from(measured.0).ok();
    }
    let mut metrics = vec![metric("Status", datatype::STRING, Some(Value::Text(outcome.status.to_string())))];
    if is_birth {
        angle.properties = Some(PropertySet {
            keys: vec!["engUnit".into()],
            values: vec![PropertyValue { datatype: Some(datatype::STRING), text: Some("deg".into()) }],
        });
        let place = format!("{} {}", outcome.bus, outcome.address);
        metrics.push(metric("Properties/Place", datatype::STRING, Some(Value::Text(place))));
        let name = name.unwrap_or_else(|| format!("slot {slot}"));
        metrics.push(metric("Properties/Name", datatype::STRING, Some(Value::Text(name))));
    }
    metrics.push(angle);
    if is_historical {
        for metric in &mut metrics {
            metric.is_historical = Some(true);
        }
    }
    metrics
}

fn asks_for_rebirth(payload: &[u8]) -> bool {
    Payload::decode(payload).is_ok_and(|payload| {
        payload.metrics.iter().any(|metric| {
            metric.name.as_deref() == Some(REBIRTH) && metric.value == Some(Value::Boolean(true))
        })
    })
}

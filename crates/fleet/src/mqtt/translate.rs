//! News of the hub into messages for the broker.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::batch::Batches;
use super::connection::Outgoing;
use super::{discovery, payload};
use crate::clock::Wall;
use crate::config::{HomeAssistant, Mqtt};
use crate::hub::{Hub, News, Told};
use crate::store::Message;

/// Turns news into messages.
pub struct Translator {
    hub: Arc<Hub>,
    mqtt: Mqtt,
    batches: Batches,
    /// Messages of each gateway, counted.
    sequence: Vec<u64>,
    /// Since when a gateway speaks or does not.
    since: Vec<Wall>,
    /// When a sensor was last sent to Home Assistant.
    singles: BTreeMap<(usize, u16), Instant>,
    bridge_sequence: u64,
}

/// Bits of `seq` that count the messages of one run of the bridge.
const RUN_SHIFT: u32 = 32;

impl Translator {
    /// For all gateways of the hub; this is the `run`-th start of the bridge.
    pub fn new(hub: Arc<Hub>, mqtt: Mqtt, run: u64) -> Translator {
        let gateways = hub.len();
        let first = run << RUN_SHIFT;
        Translator {
            batches: Batches::new(gateways, Duration::from_millis(mqtt.collect_ms.into())),
            sequence: vec![first; gateways],
            since: vec![Wall::now(); gateways],
            singles: BTreeMap::new(),
            bridge_sequence: first,
            hub,
            mqtt,
        }
    }

    /// What is to be said before there are news: the state of every gateway.
    pub fn first(&self) -> Vec<Outgoing> {
        (0..self.hub.len()).filter_map(|gateway| self.status(gateway)).collect()
    }

    /// When [`Translator::due`] has something to say.
    pub fn due_at(&self) -> Option<Instant> {
        self.batches.due()
    }

    /// Batches that are due.
    pub fn due(&mut self, now: Instant) -> Vec<Outgoing> {
        let mut out = Vec::new();
        while let Some((gateway, values)) = self.batches.take_due(now) {
            out.extend(self.batch(gateway, &values));
        }
        out
    }

    /// Everything that was collected.
    pub fn rest(&mut self) -> Vec<Outgoing> {
        let take = |gateway| self.batches.take(gateway).map(|values| (gateway, values));
        let rest: Vec<_> = (0..self.hub.len()).filter_map(take).collect();
        rest.into_iter().filter_map(|(gateway, values)| self.batch(gateway, &values)).collect()
    }

    /// Something about the bridge itself.
    pub fn bridge_event(&mut self, what: &str, members: &str) -> Outgoing {
        self.bridge_sequence += 1;
        let head = payload::Head { ts: Wall::now(), seq: self.bridge_sequence, boot: None };
        let topic = format!("{}/bridge/{}/event", self.mqtt.prefix, self.mqtt.bridge);
        Outgoing::Kept(Message { topic, payload: payload::event(&head, what, members), retain: false })
    }

    /// News of a gateway.
    pub fn news(&mut self, news: &News) -> Vec<Outgoing> {
        let gateway = news.gateway;
        let mut out = Vec::new();
        if let Told::Outcome(slot, outcome) = &news.told {
            let Some(state) = self.hub.gateway(gateway) else { return out };
            let is_new_to_it = !self.singles.contains_key(&(gateway, *slot));
            let value = payload::value(*slot, state.config.sensor(*slot), outcome);
            if let Some(home) = &self.mqtt.home_assistant {
                if is_new_to_it {
                    out.push(Outgoing::Retained(discovery::device(&self.mqtt, home, &state)));
                }
                if is_due(home, self.singles.get(&(gateway, *slot)), news.at) {
                    self.singles.insert((gateway, *slot), news.at);
                    let topic = discovery::value_topic(&self.mqtt, state.config.name.as_str(), *slot);
                    let message = Message { topic, payload: payload::single(outcome), retain: false };
                    out.push(Outgoing::Live(message));
                }
            }
            drop(state);
            self.batches.add(gateway, value, news.at);
            return out;
        }
        // What was measured before an event is said before it.
        if let Some(values) = self.batches.take(gateway) {
            out.extend(self.batch(gateway, &values));
        }
        let (what, members) = match &news.told {
            Told::Speaks => ("online", String::new()),
            Told::Gone(why) => ("offline", format!("\"why\":{}", payload::quoted(why))),
            Told::Start(start) => ("start", payload::restart(start)),
            Told::Alarm(alarm) => ("alarm", payload::alarm(alarm)),
            Told::Summary(_) => {
                out.extend(self.status(gateway));
                return out;
            }
            Told::Bus(_) | Told::Outcome(..) => return out,
        };
        if matches!(news.told, Told::Speaks | Told::Gone(_))
            && let Some(since) = self.since.get_mut(gateway)
        {
            *since = news.wall;
        }
        if matches!(news.told, Told::Gone(_)) {
            // Its sensors have no value any more: said once for each.
            let Some(state) = self.hub.gateway(gateway) else { return out };
            let gone: Vec<_> = state
                .sensors
                .iter()
                .map(|(slot, outcome)| payload::value(*slot, state.config.sensor(*slot), &outcome.gone()))
                .collect();
            if self.mqtt.home_assistant.is_some() {
                for (slot, outcome) in &state.sensors {
                    let topic = discovery::value_topic(&self.mqtt, state.config.name.as_str(), *slot);
                    out.push(Outgoing::Live(Message {
                        topic,
                        payload: payload::single(&outcome.gone()),
                        retain: false,
                    }));
                }
            }
            drop(state);
            if !gone.is_empty() {
                out.extend(self.batch(gateway, &gone));
            }
        }
        let head = self.head(gateway);
        if let Some(topic) = self.topic(gateway, "event") {
            out.push(Outgoing::Kept(Message {
                topic,
                payload: payload::event(&head, what, &members),
                retain: false,
            }));
        }
        out.extend(self.status(gateway));
        out
    }

    fn topic(&self, gateway: usize, last: &str) -> Option<String> {
        let state = self.hub.gateway(gateway)?;
        Some(format!("{}/{}/{last}", self.mqtt.prefix, state.config.name))
    }

    fn head(&mut self, gateway: usize) -> payload::Head {
        let boot = self.hub.gateway(gateway).and_then(|state| Some(state.start.as_ref()?.boot()));
        let mut seq = 0;
        if let Some(sequence) = self.sequence.get_mut(gateway) {
            *sequence += 1;
            seq = *sequence;
        }
        payload::Head { ts: Wall::now(), seq, boot }
    }

    fn batch(&mut self, gateway: usize, values: &[String]) -> Option<Outgoing> {
        let head = self.head(gateway);
        let topic = self.topic(gateway, "state")?;
        Some(Outgoing::Kept(Message { topic, payload: payload::state(&head, values), retain: false }))
    }

    fn status(&self, gateway: usize) -> Option<Outgoing> {
        let state = self.hub.gateway(gateway)?;
        let topic = format!("{}/{}/status", self.mqtt.prefix, state.config.name);
        let payload = payload::status(&state, *self.since.get(gateway)?);
        Some(Outgoing::Retained(Message { topic, payload, retain: true }))
    }
}

/// Whether Home Assistant wants another value of a sensor.
fn is_due(home: &HomeAssistant, last: Option<&Instant>, now: Instant) -> bool {
    let every = Duration::from_millis(home.every_ms.into());
    last.is_none_or(|last| now.saturating_duration_since(*last) >= every)
}

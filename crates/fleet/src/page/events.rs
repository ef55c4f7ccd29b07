//! Server-sent events: what has changed, ten times a second.
//!
//! All browsers get the same text. One that does not keep up misses some and is told to read the whole state again.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::State;
use axum::response::Sse;
use axum::response::sse::{Event, KeepAlive};
use futures_util::stream::{Stream, unfold};
use serde_json::{Value, json};
use tokio::sync::broadcast::{self, error::RecvError};
use tokio::time::{MissedTickBehavior, interval};

use super::Shared;
use super::state::{self, Memory};
use crate::hub::{Hub, Told};

/// Ten times a second: what a person sees as at once.
const EVERY: Duration = Duration::from_millis(100);
/// Events that a browser may be behind.
const BEHIND: usize = 32;
/// Less than the time after which proxies close a silent connection.
const ALIVE: Duration = Duration::from_secs(5);

/// What all browsers listen to.
#[derive(Clone)]
pub struct Events(broadcast::Sender<Arc<str>>);

/// Begins to follow the hub.
pub fn start(hub: &Arc<Hub>, memory: &Arc<Memory>) -> Events {
    let (to, _) = broadcast::channel(BEHIND);
    let (hub, memory, events) = (hub.clone(), memory.clone(), Events(to.clone()));
    let mut news = hub.listen();
    tokio::spawn(async move {
        let mut tick = interval(EVERY);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut changed: BTreeMap<usize, Changed> = BTreeMap::new();
        loop {
            tokio::select! {
                Some(news) = news.recv() => {
                    memory.note(&news);
                    let changed = changed.entry(news.gateway).or_default();
                    match &news.told {
                        Told::Outcome(slot, _) => _ = changed.slots.insert(*slot),
                        Told::Alarm(alarm) => _ = changed.slots.insert(alarm.slot),
                        Told::Gone(_) | Told::Start(_) => (changed.is_all, changed.is_gateway) = (true, true),
                        Told::Speaks | Told::Summary(_) | Told::Bus(_) => changed.is_gateway = true,
                    }
                }
                _ = tick.tick() => {
                    if !changed.is_empty() && to.receiver_count() > 0 {
                        // No browser may have stayed.
                        let _ = to.send(text(&hub, &std::mem::take(&mut changed)).into());
                    }
                    changed.clear();
                }
            }
        }
    });
    events
}

#[derive(Default)]
struct Changed {
    slots: BTreeSet<u16>,
    is_gateway: bool,
    is_all: bool,
}

fn text(hub: &Hub, changed: &BTreeMap<usize, Changed>) -> String {
    let now = Instant::now();
    let gateways: Vec<Value> = changed
        .iter()
        .filter_map(|(number, changed)| {
            let state = hub.gateway(*number)?;
            let mut object = if changed.is_gateway {
                state::gateway(&state)
            } else {
                json!({ "name": state.config.name.as_str() })
            };
            let sensors: Vec<_> = state
                .sensors
                .iter()
                .filter(|(slot, _)| changed.is_all || changed.slots.contains(slot))
                .map(|(slot, outcome)| state::sensor(&state, *slot, outcome, now))
                .collect();
            let removed: Vec<_> =
                changed.slots.iter().filter(|slot| !state.sensors.contains_key(slot)).collect();
            let members = object.as_object_mut()?;
            members.insert("sensors".into(), Value::Array(sensors));
            members.insert("removed".into(), json!(removed));
            Some(object)
        })
        .collect();
    json!({ "gateways": gateways }).to_string()
}

/// The events of one browser.
pub async fn stream(State(shared): State<Arc<Shared>>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let receiver = shared.events.0.subscribe();
    let events = unfold(receiver, |mut receiver| async {
        let event = match receiver.recv().await {
            Ok(text) => Event::default().data(&*text),
            Err(RecvError::Lagged(_)) => Event::default().event("again").data("{}"),
            Err(RecvError::Closed) => return None,
        };
        Some((Ok(event), receiver))
    });
    Sse::new(events).keep_alive(KeepAlive::new().interval(ALIVE).text("alive"))
}

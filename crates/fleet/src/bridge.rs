//! `clino bridge`: gateways to a broker, to Prometheus, to InfluxDB.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use rumqttc::LastWill;
use tokio::sync::{mpsc, watch};
use tokio::time::{interval, sleep_until};

use crate::clock::{JumpWatch, Wall};
use crate::config::{Config, Dialect, Mqtt, state_folder};
use crate::health::BridgeHealth;
use crate::hub::Hub;
use crate::mqtt::{self, Closing, Connection, Outgoing, Translator};
use crate::queue::{Bounds, Queue};
use crate::say::say;
use crate::source::{ReadBus, Sources};
use crate::store::{Lane, Message, Store};
use crate::{influx, prometheus};

/// From one look at the clock, and at what has become of the bridge, to the next.
const LOOK: Duration = Duration::from_secs(1);
const BYTES_PER_MB: u64 = 1_000_000;

/// Runs until the program is asked to end.
///
/// # Errors
/// What of the configuration cannot be had: a secret, a certificate, the store, an address to listen at.
pub async fn bridge(config: Config, read_bus: ReadBus) -> Result<(), String> {
    if config.mqtt.is_none() && config.influx.is_none() && config.prometheus.is_none() {
        return Err("nothing to feed: expected at least one of `[mqtt]`, `[influx]`, `[prometheus]`".into());
    }
    let hub = Arc::new(Hub::new(&config));
    let (end, over) = watch::channel(false);
    let health = Arc::new(BridgeHealth::default());
    let mut at_work = vec![tokio::spawn(watch_clock(health.clone(), over.clone()))];
    // Those who listen come before those who tell.
    if let Some(mqtt) = &config.mqtt {
        let folder = config.store.folder.clone().unwrap_or_else(state_folder);
        let most_bytes = u64::from(config.store.most_mb) * BYTES_PER_MB;
        match mqtt.dialect {
            Dialect::Json => {
                let store = folder.join(format!("{}.redb", mqtt.bridge));
                at_work.extend(json(mqtt, &store, most_bytes, &hub, &health, &over)?);
            }
            Dialect::Sparkplug => {
                let store = folder.join(format!("{}-sparkplug.redb", mqtt.bridge));
                at_work.push(mqtt::sparkplug(mqtt, &store, most_bytes, &hub, &health, &over)?);
            }
        }
    }
    if let Some(influx) = &config.influx {
        at_work.push(influx::start(influx, &hub, health.clone(), over.clone())?);
    }
    if let Some(prometheus) = &config.prometheus {
        at_work.push(prometheus::start(prometheus, &hub, (health.clone(), &config), over.clone()).await?);
    }
    let sources = Sources::start(&config, &hub, &read_bus);
    say(format_args!("{} gateways", hub.len()));
    asked_to_end().await;
    drop(sources);
    let _ = end.send(true);
    for task in at_work {
        let _ = task.await;
    }
    Ok(())
}

/// Ctrl-C, or what a service manager sends.
pub async fn asked_to_end() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut terminate) = signal(SignalKind::terminate()) {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = tokio::signal::ctrl_c() => {}
            }
            return;
        }
    }
    let _ = tokio::signal::ctrl_c().await;
}

/// The tasks of our own dialect: one translates, one is connected.
fn json(
    mqtt: &Mqtt,
    store: &Path,
    most_bytes: u64,
    hub: &Arc<Hub>,
    health: &Arc<BridgeHealth>,
    over: &watch::Receiver<bool>,
) -> Result<[tokio::task::JoinHandle<()>; 2], String> {
    let store = Store::open(store)?;
    let (lane, opened) = Lane::of(&store, None)?;
    if !opened.waiting.is_empty() {
        say(format_args!("{} messages wait from before", opened.waiting.end - opened.waiting.start));
    }
    let queue = Queue::new((lane, opened), Bounds::shared(most_bytes, 1));
    let mut options = mqtt::options(mqtt, mqtt.bridge.as_str())?;
    let status = |is_online| Message {
        topic: format!("{}/bridge/{}/status", mqtt.prefix, mqtt.bridge),
        payload: mqtt::bridge_status(is_online),
        retain: true,
    };
    let gone = status(false);
    options.set_last_will(LastWill::new(&gone.topic, gone.payload.clone(), rumqttc::QoS::AtLeastOnce, true));
    let (to_broker, input) = mpsc::unbounded_channel();
    let connection = Connection { options, first: status(true), queue, input, health: health.clone() };
    let connected = tokio::spawn(connection.run(Closing { last: gone }));
    let translator = Translator::new(hub.clone(), mqtt.clone(), store.run());
    let translating =
        tokio::spawn(translate(translator, hub.listen(), to_broker, health.clone(), over.clone()));
    Ok([translating, connected])
}

/// Notices jumps of the wall clock, until the program ends.
async fn watch_clock(health: Arc<BridgeHealth>, mut over: watch::Receiver<bool>) {
    let mut jumps = JumpWatch::new();
    let mut look = interval(LOOK);
    loop {
        tokio::select! {
            _ = look.tick() => {
                if let Some(jump) = jumps.look(Instant::now(), Wall::now()) {
                    say(format_args!("the clock of this computer has jumped by {jump} ms: times from here on follow it"));
                    health.clock_jumped_ms.fetch_add(jump, Ordering::Relaxed);
                    health.clock_jumps.fetch_add(1, Ordering::Relaxed);
                }
            }
            _ = over.wait_for(|over| *over) => return,
        }
    }
}

/// Turns news into messages until the program ends.
async fn translate(
    mut translator: Translator,
    mut news: mpsc::UnboundedReceiver<Arc<crate::hub::News>>,
    to_broker: mpsc::UnboundedSender<Outgoing>,
    health: Arc<BridgeHealth>,
    mut over: watch::Receiver<bool>,
) {
    let mut look = interval(LOOK);
    let mut known = Known::default();
    // If the connection has ended, so does the program.
    let send = |messages: Vec<Outgoing>| messages.into_iter().for_each(|message| _ = to_broker.send(message));
    send(translator.first());
    loop {
        let due = translator.due_at();
        tokio::select! {
            news = news.recv() => match news {
                Some(news) => send(translator.news(&news)),
                None => break,
            },
            () = async { sleep_until(due.unwrap_or_else(Instant::now).into()).await }, if due.is_some() => {
                send(translator.due(Instant::now()));
            }
            _ = look.tick() => {
                for (what, members) in known.look(&health) {
                    send(vec![translator.bridge_event(what, &members)]);
                }
            }
            _ = over.wait_for(|over| *over) => break,
        }
    }
    // What the sources have told by now is kept. The connection ends when `to_broker` does, after all that was sent before.
    while let Ok(news) = news.try_recv() {
        send(translator.news(&news));
    }
    send(translator.rest());
}

/// What was told of the bridge itself.
#[derive(Default)]
struct Known {
    dropped: u64,
    clock_jumped_ms: i64,
    has_disk_trouble: bool,
}

impl Known {
    /// Events since the last look, with their members.
    fn look(&mut self, health: &BridgeHealth) -> Vec<(&'static str, String)> {
        let mut events = Vec::new();
        let dropped = health.dropped.load(Ordering::Relaxed);
        if dropped != self.dropped {
            events.push(("dropped", format!("\"messages\":{}", dropped - self.dropped)));
            self.dropped = dropped;
        }
        let jumped = health.clock_jumped_ms.load(Ordering::Relaxed);
        if jumped != self.clock_jumped_ms {
            events.push(("clock_jumped", format!("\"by_ms\":{}", jumped - self.clock_jumped_ms)));
            self.clock_jumped_ms = jumped;
        }
        let has_disk_trouble = health.has_disk_trouble.load(Ordering::Relaxed);
        if has_disk_trouble != self.has_disk_trouble {
            events.push((if has_disk_trouble { "store_failed" } else { "store_works" }, String::new()));
            self.has_disk_trouble = has_disk_trouble;
        }
        events
    }
}

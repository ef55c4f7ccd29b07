//! `clino bridge`: gateways to a broker, to Prometheus, to InfluxDB.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use rumqttc::LastWill;
use tokio::sync::{mpsc, watch};
use tokio::time::{interval, sleep_until};

use crate::config::{Config, Dialect, Mqtt, state_folder};
use crate::hub::Hub;
use crate::mqtt::{self, BrokerHealth, Closing, Connection, Outgoing, Translator};
use crate::queue::Queue;
use crate::say::say;
use crate::source::{ReadBus, Sources};
use crate::store::{Message, Opened, Store};
use crate::{influx, prometheus};

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
    let health = Arc::new(BrokerHealth::default());
    let mut at_work = Vec::new();
    // Those who listen come before those who tell.
    if let Some(mqtt) = &config.mqtt {
        match mqtt.dialect {
            Dialect::Json => at_work.extend(json(mqtt, &config, &hub, &health, &over)?),
            Dialect::Sparkplug => {
                for gateway in 0..hub.len() {
                    // An unreadable secret is told now, not from a task.
                    mqtt::options(mqtt, "check")?;
                    let news = hub.listen();
                    at_work.push(tokio::spawn(mqtt::sparkplug(
                        mqtt.clone(),
                        hub.clone(),
                        gateway,
                        over.clone(),
                        news,
                    )));
                }
            }
        }
    }
    if let Some(influx) = &config.influx {
        at_work.push(influx::start(influx, &hub, over.clone())?);
    }
    if let Some(prometheus) = &config.prometheus {
        let broker = config.mqtt.as_ref().map(|_| health.clone());
        at_work.push(prometheus::start(prometheus, &hub, broker, over.clone()).await?);
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
    config: &Config,
    hub: &Arc<Hub>,
    health: &Arc<BrokerHealth>,
    over: &watch::Receiver<bool>,
) -> Result<[tokio::task::JoinHandle<()>; 2], String> {
    let folder = config.store.folder.clone().unwrap_or_else(state_folder);
    let (store, run) = open_store(&folder.join(format!("{}.redb", mqtt.bridge)))?;
    let queue = Queue::new(Some(store), u64::from(config.store.most_mb) * 1_000_000);
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
    let translator = Translator::new(hub.clone(), mqtt.clone(), run);
    let translating =
        tokio::spawn(translate(translator, hub.listen(), to_broker, health.clone(), over.clone()));
    Ok([translating, connected])
}

fn open_store(path: &Path) -> Result<((Store, Opened), u64), String> {
    let (store, opened) = Store::open(path)?;
    let run = opened.run;
    if !opened.waiting.is_empty() {
        say(format_args!("{} messages wait from before", opened.waiting.end - opened.waiting.start));
    }
    Ok(((store, opened), run))
}

/// Turns news into messages until the program ends.
async fn translate(
    mut translator: Translator,
    mut news: mpsc::UnboundedReceiver<Arc<crate::hub::News>>,
    to_broker: mpsc::UnboundedSender<Outgoing>,
    health: Arc<BrokerHealth>,
    mut over: watch::Receiver<bool>,
) {
    let mut look = interval(std::time::Duration::from_secs(1));
    let mut dropped = 0;
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
                send(translator.look_at_clock().into_iter().collect());
                let now = health.dropped.load(Ordering::Relaxed);
                if now != dropped {
                    send(vec![translator.bridge_event("dropped", &format!("\"messages\":{}", now - dropped))]);
                    dropped = now;
                }
            }
            _ = over.wait_for(|over| *over) => break,
        }
    }
    // The connection ends when `to_broker` does, after all that was sent before.
    send(translator.rest());
}

//! Sparkplug B: a gateway is an edge node, a slot is a device.
//!
//! Source: Eclipse Sparkplug 3.0.0. An edge node has its own connection, because its death certificate (NDEATH) is the last
//! will of that connection. Both certificates of a connection carry the same `bdSeq`. After the birth of the node (NBIRTH)
//! comes that of each device (DBIRTH), then data (DDATA). A device whose source is gone dies (DDEATH). The command *Rebirth*
//! is answered with all births.
//!
//! Readings wait in a lane of the store for each gateway, as messages of the JSON dialect do. What came before the births of a
//! connection is sent as historical, in its order, several readings of a device in one message. A device of which there is
//! history and no source is born for it, and dies when the history is told. `outbox.rs` says how it is known what the broker
//! has.

mod message;
mod node;
mod outbox;
mod reading;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet, block_in_place};
use tokio::time::{MissedTickBehavior, interval};

use self::node::Node;
use crate::config::Mqtt;
use crate::health::BridgeHealth;
use crate::hub::Hub;
use crate::queue::{self, Bounds, Queue, TICK};
use crate::store::{Lane, Store};

/// The queue of a gateway, which its edge node shares with what writes all of them to disk.
type Shared = Arc<Mutex<Queue>>;

/// Begins the edge nodes of all gateways; they end with `over`.
///
/// # Errors
/// What of the configuration cannot be had: a secret, a certificate, the store.
pub fn start(
    mqtt: &Mqtt,
    store: &Path,
    most_bytes: u64,
    hub: &Arc<Hub>,
    health: &Arc<BridgeHealth>,
    over: &watch::Receiver<bool>,
) -> Result<JoinHandle<()>, String> {
    // An unreadable secret is told now, not from a task.
    super::options(mqtt, "check")?;
    let store = Store::open(store)?;
    let bounds = Bounds::shared(most_bytes, hub.len());
    let connected = Arc::new(AtomicUsize::new(0));
    let mut queues = Vec::new();
    let mut nodes = JoinSet::new();
    for gateway in 0..hub.len() {
        let Some(name) = hub.gateway(gateway).map(|state| state.config.name.to_string()) else { continue };
        let queue = Arc::new(Mutex::new(Queue::new(Lane::of(&store, Some(&name))?, bounds)));
        queues.push(queue.clone());
        let node = Node::new(mqtt, hub, (gateway, name), queue, (health.clone(), connected.clone()));
        nodes.spawn(node.run(over.clone(), hub.listen_to(gateway)));
    }
    Ok(tokio::spawn(keep(queues, nodes, health.clone(), connected)))
}

/// Writes to disk what waits, until all nodes have ended.
async fn keep(
    mut queues: Vec<Shared>,
    mut nodes: JoinSet<()>,
    health: Arc<BridgeHealth>,
    connected: Arc<AtomicUsize>,
) {
    let mut tick = interval(TICK);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            _ = tick.tick() => {
                block_in_place(|| queue::tick(&mut queues, Instant::now()));
                health.note(&mut queues);
                let all = connected.load(Ordering::Relaxed) == queues.len();
                health.is_connected.store(all, Ordering::Relaxed);
            }
            ended = nodes.join_next() => if ended.is_none() { break },
        }
    }
    block_in_place(|| queue::close(&mut queues));
}

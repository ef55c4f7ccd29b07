//! MQTT: values, states and events of gateways to one broker.
//!
//! | topic | retained | what |
//! |---|---|---|
//! | `clino/<gateway>/state` | no | a batch: values of sensors that came within 20 ms |
//! | `clino/<gateway>/status` | yes | whether the gateway speaks, and its start |
//! | `clino/<gateway>/event` | no | restarts, alarms, what came and went |
//! | `clino/<gateway>/<slot>/value` | no | for Home Assistant: one sensor, at most once in its period |
//! | `clino/bridge/<bridge>/status` | yes | whether the bridge is connected; its last will |
//!
//! The first level is the prefix of the configuration. What each message says is in `payload.rs`.

mod batch;
mod connection;
mod discovery;
mod payload;
mod sparkplug;
mod tls;
mod translate;

pub use connection::{Closing, Connection, Outgoing};
pub use payload::bridge as bridge_status;
pub use sparkplug::start as sparkplug;
pub use translate::Translator;

use rumqttc::{AsyncClient, Event, EventLoop, MqttOptions, NetworkOptions};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use crate::config::Mqtt;

/// Ports of MQTT, registered with IANA.
const PORT: u16 = 1_883;
const TLS_PORT: u16 = 8_883;
/// In seconds. A broker declares a client dead after one and a half of it (MQTT 3.1.1, section 3.1.2.10).
const KEEP_ALIVE: std::time::Duration = std::time::Duration::from_secs(10);
/// How long a connection may take, in seconds: hundreds of edge nodes connect at once.
const CONNECT_S: u64 = 20;
/// Larger than any batch: 48 sensors of 200 characters.
const PACKET: usize = 256 * 1_024;
/// Messages sent and not confirmed. At 5 ms to a broker this carries 20 000 a second.
pub const WINDOW: u16 = 100;

/// How to reach the broker.
///
/// # Errors
/// The password or the certificates cannot be read.
pub fn options(mqtt: &Mqtt, client: &str) -> Result<MqttOptions, String> {
    let has_tls = mqtt.tls || mqtt.ca_file.is_some();
    let port = mqtt.port.unwrap_or(if has_tls { TLS_PORT } else { PORT });
    let mut options = MqttOptions::new(client, &mqtt.host, port);
    options.set_keep_alive(KEEP_ALIVE);
    options.set_max_packet_size(PACKET, PACKET);
    options.set_inflight(WINDOW);
    // What was not confirmed is sent again by `Queue`, which also knows what is on disk.
    options.set_clean_session(true);
    if let Some(user) = &mqtt.user {
        let password = mqtt.password.as_ref().map_or(Ok(String::new()), crate::config::Secret::read)?;
        options.set_credentials(user, password);
    }
    if has_tls {
        options.set_transport(tls::transport(mqtt.ca_file.as_deref())?);
    }
    Ok(options)
}

/// Begins a connection: its client, what happens on it up to an error, and the task that keeps it going. A task of its own,
/// because what the client's `poll` has begun must not be dropped.
pub fn connect(
    options: MqttOptions,
    room: usize,
) -> (AsyncClient, mpsc::Receiver<Result<Event, String>>, JoinHandle<()>) {
    let (client, mut eventloop) = AsyncClient::new(options, room);
    eventloop.set_network_options(network());
    let (to, events) = mpsc::channel(room * 2);
    (client, events, tokio::spawn(async move { pump(&mut eventloop, to).await }))
}

async fn pump(eventloop: &mut EventLoop, to: mpsc::Sender<Result<Event, String>>) {
    loop {
        let event = eventloop.poll().await.map_err(|why| why.to_string());
        let is_last = event.is_err();
        if to.send(event).await.is_err() || is_last {
            return;
        }
    }
}

/// A message goes at once: waiting for more to fill a packet costs up to 40 ms.
fn network() -> NetworkOptions {
    let mut network = NetworkOptions::new();
    network.set_tcp_nodelay(true);
    network.set_connection_timeout(CONNECT_S);
    network
}

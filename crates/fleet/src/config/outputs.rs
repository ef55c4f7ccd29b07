//! Where values go: page, broker, store, Prometheus, InfluxDB.

use std::net::SocketAddr;
use std::path::PathBuf;

use serde::Deserialize;

use super::{Name, Secret};

/// The live page.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Serve {
    /// Where it listens.
    pub listen: SocketAddr,
    /// Whether it may change anything: zero, scan, acknowledge.
    pub allow_writes: bool,
    /// What a reader has to show, beyond loopback.
    pub token: Option<Secret>,
}

impl Default for Serve {
    fn default() -> Serve {
        Serve { listen: SocketAddr::from(([127, 0, 0, 1], 8080)), allow_writes: false, token: None }
    }
}

/// The broker.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mqtt {
    /// Host name or address.
    pub host: String,
    /// Its port; 1883, or 8883 with TLS.
    pub port: Option<u16>,
    /// Name of this bridge: client identifier and topic of its own status.
    #[serde(default = "bridge_name")]
    pub bridge: Name,
    /// The first level of all topics.
    #[serde(default = "prefix")]
    pub prefix: Name,
    /// Which conventions.
    #[serde(default)]
    pub dialect: Dialect,
    /// User name.
    pub user: Option<String>,
    /// Its password.
    pub password: Option<Secret>,
    /// TLS, with the certificates of the system.
    #[serde(default)]
    pub tls: bool,
    /// TLS, with the certificate authority in this file.
    pub ca_file: Option<PathBuf>,
    /// How long readings are collected for one message.
    #[serde(default = "collect_ms")]
    pub collect_ms: u16,
    /// Discovery by Home Assistant.
    pub home_assistant: Option<HomeAssistant>,
    /// Group of Sparkplug B.
    #[serde(default = "group")]
    pub group: Name,
}

/// Which conventions of MQTT.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// Topics and JSON of our own.
    #[default]
    Json,
    /// Sparkplug B.
    Sparkplug,
}

/// Discovery by Home Assistant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HomeAssistant {
    /// The first level of its topics.
    #[serde(default = "discovery_prefix")]
    pub prefix: Name,
    /// From one value of a sensor to the next, in ms.
    #[serde(default = "every_ms")]
    pub every_ms: u32,
}

/// What waits for the broker, on disk.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Store {
    /// Its folder; without it the folder of this user's programs.
    pub folder: Option<PathBuf>,
    /// The most that waits, in MB (10⁶ bytes) of messages. The oldest are dropped beyond, which is told.
    pub most_mb: u32,
}

impl Default for Store {
    fn default() -> Store {
        Store { folder: None, most_mb: 1_000 }
    }
}

/// The endpoint that Prometheus scrapes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prometheus {
    /// Where it listens.
    pub listen: SocketAddr,
}

/// Where lines for InfluxDB go.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Influx {
    /// File, standard output, or HTTP.
    pub to: InfluxTo,
    /// API token for HTTP.
    pub token: Option<Secret>,
}

/// Where lines for InfluxDB go.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(try_from = "String")]
pub enum InfluxTo {
    /// Standard output.
    Stdout,
    /// A file that is added to.
    File(PathBuf),
    /// The write address of a server, such as `http://host:8086/api/v2/write?bucket=tilt`.
    Http(String),
}

impl TryFrom<String> for InfluxTo {
    type Error = String;

    fn try_from(text: String) -> Result<InfluxTo, String> {
        match text.as_str() {
            "-" => Ok(InfluxTo::Stdout),
            _ if text.starts_with("http://") || text.starts_with("https://") => Ok(InfluxTo::Http(text)),
            "" => Err("expected `-`, a file, or http://…".into()),
            _ if text.contains("://") => {
                Err(format!("{text:?}, expected `-`, a file, http://… or https://…"))
            }
            _ => Ok(InfluxTo::File(text.into())),
        }
    }
}

fn known(text: &str) -> Name {
    Name::try_from(text.to_owned()).expect("a name that is written here is one")
}

fn bridge_name() -> Name {
    known("bridge")
}

fn prefix() -> Name {
    known("clino")
}

fn group() -> Name {
    known("clino")
}

fn discovery_prefix() -> Name {
    known("homeassistant")
}

/// Below the 50 ms from reception to broker that a fleet is measured by.
fn collect_ms() -> u16 {
    20
}

fn every_ms() -> u32 {
    1_000
}

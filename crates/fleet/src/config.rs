//! The configuration file: TOML, one for `clino serve` and `clino bridge`.
//!
//! An error names file, line, key, and what was expected. A key that does not exist is an error: a misspelt one would
//! otherwise be a setting that is silently not set. An example is `docs/bridge.example.toml`.

mod endpoint;
mod fault;
mod gateway;
mod name;
mod outputs;
mod secret;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use fault::Fault;
use gateway::GatewayTable;

pub use endpoint::{Endpoint, ModbusEndpoint};
pub use name::Name;
pub use outputs::{Dialect, HomeAssistant, Influx, InfluxTo, Mqtt, Prometheus, Serve, Store};
pub use secret::Secret;

/// All of it.
#[derive(Clone, Debug, Default)]
pub struct Config {
    /// The gateways, and buses that are read directly.
    pub gateway: Vec<Gateway>,
    /// The live page.
    pub serve: Serve,
    /// The broker.
    pub mqtt: Option<Mqtt>,
    /// What waits for the broker.
    pub store: Store,
    /// The endpoint that Prometheus scrapes.
    pub prometheus: Option<Prometheus>,
    /// Where lines for InfluxDB go.
    pub influx: Option<Influx>,
}

/// All of it as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    gateway: Vec<Spanned<GatewayTable>>,
    #[serde(default)]
    serve: Serve,
    mqtt: Option<Mqtt>,
    #[serde(default)]
    store: Store,
    prometheus: Option<Prometheus>,
    influx: Option<Influx>,
}

/// A gateway, or a bus that is read directly.
#[derive(Clone, Debug)]
pub struct Gateway {
    /// In topics, tags, labels and on the page.
    pub name: Name,
    /// How it is read.
    pub source: Source,
    /// Names of its sensors, by slot.
    pub sensors: BTreeMap<u16, String>,
}

/// How a gateway is read.
#[derive(Clone, Debug)]
pub enum Source {
    /// JSON lines of its console.
    Console(Endpoint),
    /// Registers of its Modbus port.
    Modbus(Modbus),
    /// No gateway: sensors on a bus.
    Bus(Bus),
}

/// A Modbus port.
#[derive(Clone, Debug)]
pub struct Modbus {
    /// Where it is.
    pub port: ModbusEndpoint,
    /// Address of the server.
    pub unit: u8,
    /// Bit rate of a serial line.
    pub baud: u32,
    /// Parity of a serial line.
    pub parity: Parity,
    /// From one reading to the next.
    pub every: Duration,
}

/// Parity of a serial line.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Parity {
    /// None.
    None,
    /// Even: the standard's, and the gateway's as delivered.
    #[default]
    Even,
    /// Odd.
    Odd,
}

/// Sensors on a bus, without a gateway.
#[derive(Clone, Debug)]
pub struct Bus {
    /// Which sensors.
    pub make: Make,
    /// Serial port or `tcp://host:port`, as `clino t7 --port` takes it.
    pub port: String,
    /// Their addresses.
    pub addresses: Vec<u8>,
    /// Bit rate.
    pub baud: u32,
}

/// Which sensors are on a bus.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Make {
    /// US Digital T7.
    T7,
    /// STT ISU.
    Isu,
}

/// Factory settings of the gateway's Modbus port (`docs/modbus.md`, *Line*).
const MODBUS_UNIT: u8 = 1;
const MODBUS_BAUD: u32 = 19_200;
/// From one reading of a Modbus port to the next, unless another time is set.
const MODBUS_EVERY_MS: u32 = 1_000;

impl Modbus {
    /// A port as the gateway is delivered.
    #[must_use]
    pub fn at(port: ModbusEndpoint) -> Modbus {
        Modbus {
            port,
            unit: MODBUS_UNIT,
            baud: MODBUS_BAUD,
            parity: Parity::default(),
            every: Duration::from_millis(MODBUS_EVERY_MS.into()),
        }
    }
}

impl Gateway {
    /// The name that was given to a sensor.
    #[must_use]
    pub fn sensor(&self, slot: u16) -> Option<&str> {
        self.sensors.get(&slot).map(String::as_str)
    }
}

impl Config {
    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong with it: file, line, key, and what was expected.
    pub fn read(path: &Path) -> Result<Config, String> {
        let text = fs::read_to_string(path).map_err(|why| format!("{}: {why}", path.display()))?;
        Config::parse(&text).map_err(|why| format!("{}: {why}", path.display()))
    }

    /// The text of a file.
    ///
    /// # Errors
    /// As [`Config::read`], without the file.
    pub fn parse(text: &str) -> Result<Config, String> {
        let file = toml::from_str(text).map_err(|why| Fault::from(why).told(text))?;
        Config::checked(file).map_err(|fault| fault.told(text))
    }

    fn checked(file: File) -> Result<Config, Fault> {
        let File { gateway, serve, mqtt, store, prometheus, influx } = file;
        if gateway.is_empty() {
            return Err(Fault::new("there is no `[[gateway]]`: expected at least one"));
        }
        let mut names = BTreeSet::new();
        let mut gateways = Vec::new();
        for table in gateway {
            let name = table.get_ref().name.clone();
            if !names.insert(name.get_ref().clone()) {
                let why = format!("two gateways are named `{}`: expected names that differ", name.get_ref());
                return Err(Fault::at(&name, why));
            }
            gateways.push(gateway::read(table)?);
        }
        Ok(Config { gateway: gateways, serve, mqtt, store, prometheus, influx })
    }

    /// The configuration of `clino serve` without a file: one gateway.
    #[must_use]
    pub fn of_one(source: Source, name: Name) -> Config {
        Config { gateway: vec![Gateway { name, source, sensors: BTreeMap::new() }], ..Config::default() }
    }
}

/// The folder in which programs of this user keep what has to last: `$STATE_DIRECTORY` of systemd, or the XDG one.
#[must_use]
pub fn state_folder() -> PathBuf {
    let of = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    of("STATE_DIRECTORY")
        .or_else(|| of("XDG_STATE_HOME").map(|state| state.join("clino")))
        .or_else(|| of("HOME").map(|home| home.join(".local/state/clino")))
        .unwrap_or_else(|| PathBuf::from("."))
}

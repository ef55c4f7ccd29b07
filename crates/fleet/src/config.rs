//! The configuration file: TOML, one for `clino serve` and `clino bridge`.
//!
//! An error names file, line, key, and what was expected. A key that does not exist is an error: a misspelt one would
//! otherwise be a setting that is silently not set. An example is `docs/bridge.example.toml`.

mod endpoint;
mod name;
mod outputs;
mod secret;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;

pub use endpoint::{Endpoint, ModbusEndpoint};
pub use name::Name;
pub use outputs::{Dialect, HomeAssistant, Influx, InfluxTo, Mqtt, Prometheus, Serve, Store};
pub use secret::Secret;

/// All of it.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The gateways, and buses that are read directly.
    #[serde(default)]
    pub gateway: Vec<Gateway>,
    /// The live page.
    #[serde(default)]
    pub serve: Serve,
    /// The broker.
    pub mqtt: Option<Mqtt>,
    /// What waits for the broker.
    #[serde(default)]
    pub store: Store,
    /// The endpoint that Prometheus scrapes.
    pub prometheus: Option<Prometheus>,
    /// Where lines for InfluxDB go.
    pub influx: Option<Influx>,
}

/// A gateway, or a bus that is read directly.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "GatewayTable")]
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

/// A gateway as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GatewayTable {
    name: Name,
    console: Option<Endpoint>,
    modbus: Option<ModbusEndpoint>,
    unit: Option<u8>,
    parity: Option<Parity>,
    every_ms: Option<u32>,
    bus: Option<Make>,
    port: Option<String>,
    addresses: Option<Vec<u8>>,
    baud: Option<u32>,
    #[serde(default)]
    sensors: BTreeMap<String, String>,
}

/// Slots of a gateway.
const SLOTS: u16 = clino_gateway::MAX_SLOTS as u16;
/// Factory settings of the gateway's Modbus port (`docs/modbus.md`, *Line*).
const MODBUS_UNIT: u8 = 1;
const MODBUS_BAUD: u32 = 19_200;
const MODBUS_UNITS: std::ops::RangeInclusive<u8> = 1..=247;
/// Bit rates of the sensors as they leave the factory.
const T7_BAUD: u32 = 115_200;
const ISU_BAUD: u32 = 9_600;
/// From one reading of a Modbus port to the next, unless another time is set.
const MODBUS_EVERY_MS: u32 = 1_000;
/// The gateway's own ages reach as far as a u16 of milliseconds: a slower reader could miss that a value is new.
const MODBUS_EVERY_MOST_MS: u32 = 60_000;

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

impl TryFrom<GatewayTable> for Gateway {
    type Error = String;

    fn try_from(mut table: GatewayTable) -> Result<Gateway, String> {
        let sensors = std::mem::take(&mut table.sensors);
        let sensors = sensors
            .into_iter()
            .map(|(slot, name)| Ok((slot_number(&slot)?, name)))
            .collect::<Result<_, String>>()?;
        let name = table.name.clone();
        Ok(Gateway { name, sensors, source: table.source()? })
    }
}

impl GatewayTable {
    fn source(self) -> Result<Source, String> {
        let GatewayTable { console, modbus, bus, unit, parity, every_ms, port, addresses, baud, .. } = self;
        let modbus_only =
            [("unit", unit.is_some()), ("parity", parity.is_some()), ("every_ms", every_ms.is_some())];
        let bus_only = [("port", port.is_some()), ("addresses", addresses.is_some())];
        let refuse = |keys: &[(&str, bool)], with: &str| match keys.iter().find(|(_, is_there)| *is_there) {
            Some((key, _)) => Err(format!("`{key}` does not go with `{with}`")),
            None => Ok(()),
        };
        match (console, modbus, bus) {
            (Some(console), None, None) => {
                refuse(&modbus_only, "console")?;
                refuse(&bus_only, "console")?;
                refuse(&[("baud", baud.is_some())], "console")?;
                Ok(Source::Console(console))
            }
            (None, Some(port), None) => {
                refuse(&bus_only, "modbus")?;
                let usual = Modbus::at(port);
                let unit = unit.unwrap_or(usual.unit);
                if !MODBUS_UNITS.contains(&unit) {
                    return Err(format!("`unit` is {unit}, expected 1 to 247"));
                }
                let every_ms = every_ms.unwrap_or(MODBUS_EVERY_MS);
                if !(10..=MODBUS_EVERY_MOST_MS).contains(&every_ms) {
                    return Err(format!("`every_ms` is {every_ms}, expected 10 to {MODBUS_EVERY_MOST_MS}"));
                }
                Ok(Source::Modbus(Modbus {
                    unit,
                    baud: baud.unwrap_or(usual.baud),
                    parity: parity.unwrap_or(usual.parity),
                    every: Duration::from_millis(every_ms.into()),
                    ..usual
                }))
            }
            (None, None, Some(make)) => {
                refuse(&modbus_only, "bus")?;
                let port = port.ok_or("`bus` needs `port`")?;
                let addresses = addresses.ok_or("`bus` needs `addresses`, such as [1, 2]")?;
                if addresses.is_empty() || addresses.len() > usize::from(SLOTS) {
                    return Err(format!("{} `addresses`, expected 1 to {SLOTS}", addresses.len()));
                }
                let (valid, expected) = match make {
                    Make::T7 => {
                        (addresses.iter().all(|address| matches!(address, 1..=100 | 127)), "1 to 100, or 127")
                    }
                    Make::Isu => (addresses.iter().all(|address| matches!(address, 1..=14)), "1 to 14"),
                };
                if !valid {
                    return Err(format!("`addresses` {addresses:?}, expected {expected}"));
                }
                let usual = if make == Make::T7 { T7_BAUD } else { ISU_BAUD };
                Ok(Source::Bus(Bus { make, port, addresses, baud: baud.unwrap_or(usual) }))
            }
            (None, None, None) => Err("a gateway needs one of `console`, `modbus`, `bus`".into()),
            _ => Err("a gateway has only one of `console`, `modbus`, `bus`".into()),
        }
    }
}

/// A key of `sensors`.
fn slot_number(key: &str) -> Result<u16, String> {
    let slot = key.parse().ok().filter(|slot| *slot < SLOTS);
    slot.ok_or_else(|| format!("`sensors` has `{key}`, expected a slot from 0 to {}", SLOTS - 1))
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
        let config: Config = toml::from_str(text).map_err(|why| why.to_string().trim_end().to_owned())?;
        config.check()?;
        Ok(config)
    }

    /// What no table can tell by itself.
    fn check(&self) -> Result<(), String> {
        if self.gateway.is_empty() {
            return Err("there is no `[[gateway]]`: expected at least one".into());
        }
        let mut names = BTreeSet::new();
        for gateway in &self.gateway {
            if !names.insert(gateway.name.as_str()) {
                return Err(format!("two gateways are named `{}`: expected names that differ", gateway.name));
            }
        }
        Ok(())
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

//! Where a gateway's port is: a serial port of this computer, or a serial server in the network.

use std::fmt;
use std::path::PathBuf;

use serde::Deserialize;

/// A serial port, or raw bytes over TCP.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(try_from = "String")]
pub enum Endpoint {
    /// A serial port or a pseudo-terminal.
    Serial(PathBuf),
    /// `tcp://host:port`, as ser2net gives them.
    Tcp(String),
}

/// A serial port with Modbus RTU, Modbus/TCP, or RTU over TCP.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(try_from = "String")]
pub enum ModbusEndpoint {
    /// RTU at a serial port or through a serial server.
    Rtu(Endpoint),
    /// `tcp://host:port`: Modbus/TCP, as gateways from RTU to TCP give it.
    Tcp(String),
}

/// Host and port, if that is what it is.
fn address(text: &str) -> Result<String, String> {
    let parts = text
        .rsplit_once(':')
        .filter(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0));
    match parts {
        Some(_) => Ok(text.to_owned()),
        None => Err(format!("{text:?}, expected host:port")),
    }
}

impl TryFrom<String> for Endpoint {
    type Error = String;

    fn try_from(text: String) -> Result<Endpoint, String> {
        match text.strip_prefix("tcp://") {
            Some(rest) => Ok(Endpoint::Tcp(address(rest)?)),
            None if text.is_empty() || text.contains("://") => {
                Err(format!("{text:?}, expected a serial port or tcp://host:port"))
            }
            None => Ok(Endpoint::Serial(text.into())),
        }
    }
}

impl TryFrom<String> for ModbusEndpoint {
    type Error = String;

    fn try_from(text: String) -> Result<ModbusEndpoint, String> {
        if let Some(rest) = text.strip_prefix("rtu+tcp://") {
            return Ok(ModbusEndpoint::Rtu(Endpoint::Tcp(address(rest)?)));
        }
        match Endpoint::try_from(text.clone()) {
            Ok(Endpoint::Tcp(rest)) => Ok(ModbusEndpoint::Tcp(rest)),
            Ok(serial) => Ok(ModbusEndpoint::Rtu(serial)),
            Err(_) => {
                Err(format!("{text:?}, expected a serial port, tcp://host:port or rtu+tcp://host:port"))
            }
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Endpoint::Serial(path) => write!(f, "{}", path.display()),
            Endpoint::Tcp(address) => write!(f, "tcp://{address}"),
        }
    }
}

impl fmt::Display for ModbusEndpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ModbusEndpoint::Rtu(Endpoint::Tcp(address)) => write!(f, "rtu+tcp://{address}"),
            ModbusEndpoint::Rtu(port) => port.fmt(f),
            ModbusEndpoint::Tcp(address) => write!(f, "tcp://{address}"),
        }
    }
}

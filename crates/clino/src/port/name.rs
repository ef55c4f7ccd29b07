//! How a port is named on the command line.

use std::fmt::{self, Display};
use std::str::FromStr;

const TCP: &str = "tcp://";

/// A port by its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortName {
    /// A serial port of this system.
    Serial(String),
    /// `host:port` of a server that passes raw bytes.
    Tcp(String),
}

impl FromStr for PortName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some(address) = text.strip_prefix(TCP) else {
            return match text {
                "" => Err("the name of a port is missing; clino ports lists them".to_owned()),
                _ if text.contains("://") => Err("not /dev/..., COM3 or tcp://host:port".to_owned()),
                _ => Ok(Self::Serial(text.to_owned())),
            };
        };
        let is_address = address.rsplit_once(':').is_some_and(|(host, port)| {
            !host.is_empty() && port.parse::<u16>().is_ok_and(|number| number > 0)
        });
        let address = address.to_owned();
        if is_address {
            Ok(Self::Tcp(address))
        } else {
            Err("not tcp://host:port, such as tcp://10.0.0.5:4001".to_owned())
        }
    }
}

impl Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => f.write_str(path),
            Self::Tcp(address) => write!(f, "{TCP}{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart() {
        for serial in ["/dev/ttyUSB0", "COM3", r"\\.\COM12", "/dev/serial/by-id/usb-FTDI:1"] {
            assert_eq!(serial.parse(), Ok(PortName::Serial(serial.to_owned())));
        }
        for (text, address) in [("tcp://localhost:4001", "localhost:4001"), ("tcp://[::1]:1", "[::1]:1")] {
            let name: PortName = text.parse().unwrap();
            assert_eq!(name, PortName::Tcp(address.to_owned()));
            assert_eq!(name.to_string(), text);
        }
        for bad in
            ["", "tcp://", "tcp://host", "tcp://:4001", "tcp://host:0", "tcp://host:65536", "udp://host:1"]
        {
            assert!(bad.parse::<PortName>().is_err(), "{bad}");
        }
    }
}

//! The serial ports of this system, and what keeps this user from opening one.

use std::io;
use std::path::Path;

use clino_adapter::Usb;
use serial2::SerialPort;

use super::{PortError, Problem};

/// A serial port that is there.
#[derive(Debug)]
pub struct Listed {
    /// Its name for `--port`.
    pub port: String,
    /// The USB adapter behind it, if it is one.
    pub usb: Option<Usb>,
    /// A name of it that stays.
    pub stable_name: Option<String>,
    /// For how long an FTDI holds characters back, in milliseconds.
    pub latency_ms: Option<u32>,
    /// What keeps this user from opening it.
    pub problem: Option<PortError>,
}

/// All serial ports, by name. Pseudo-terminals are not among them.
///
/// # Errors
/// Those of the system.
pub fn list() -> io::Result<Vec<Listed>> {
    let mut ports = match SerialPort::available_ports() {
        Ok(ports) => ports,
        // A system without the folder has no port.
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(error),
    };
    ports.sort();
    Ok(ports.iter().map(|path| listed(path)).collect())
}

fn listed(path: &Path) -> Listed {
    let port = path.display().to_string();
    let problem = problem(path).map(|problem| PortError::new(&port, problem));
    let stable_name = clino_adapter::stable_name(path).map(|name| name.display().to_string());
    Listed {
        usb: clino_adapter::usb(path),
        stable_name,
        latency_ms: clino_adapter::timer_ms(path),
        problem,
        port,
    }
}

/// Asked without opening it, which would move its modem lines.
#[cfg(unix)]
fn problem(path: &Path) -> Option<Problem> {
    use rustix::fs::{Access, access};

    let denied = access(path, Access::READ_OK | Access::WRITE_OK).is_err();
    denied.then(|| Problem::NotPermitted { group: super::group::of(path) })
}

#[cfg(not(unix))]
fn problem(_: &Path) -> Option<Problem> {
    None
}

//! The serial ports of this system, and what keeps this user from opening one.

use std::io;
use std::path::Path;

use serial2::SerialPort;

use super::sysfs::{self, Usb};
use super::{PortError, Problem};

/// A serial port that is there.
#[derive(Debug)]
pub struct Listed {
    /// Its name for `--port`.
    pub port: String,
    /// The USB adapter behind it, if it is one.
    pub usb: Option<Usb>,
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
    Listed { usb: sysfs::usb(path), latency_ms: sysfs::timer_ms(path), problem, port }
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

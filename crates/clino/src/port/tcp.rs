//! A serial port behind a TCP connection that passes raw bytes, as ser2net and serial servers do.
//!
//! The server sets the bit rate and switches the transceiver. No lock is possible from here: most servers take one
//! connection at a time.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::Duration;

use clino_codec::character::Character;

use super::{Port, PortError, Problem, Wiring};

/// A server that does not answer for this long is not there.
const CONNECT: Duration = Duration::from_secs(5);
/// A server that takes no byte for this long never will.
const PATIENCE: Duration = Duration::from_secs(2);
/// What a network, the server and its adapter may add. Our choice: a wireless network with a few lost packets.
const LATENCY: Duration = Duration::from_millis(100);
/// A wait of no length would wait without end.
const LEAST: Duration = Duration::from_micros(1);

/// A connection.
pub struct Tcp {
    name: String,
    stream: TcpStream,
}

impl Tcp {
    /// Connects.
    pub fn open(address: &str, wiring: Wiring) -> Result<Self, PortError> {
        let name = format!("tcp://{address}");
        let failed = |problem| PortError::new(&name, problem);
        if wiring.rts_de {
            return Err(failed(Problem::NoRts));
        }
        if wiring.rs485 {
            return Err(failed(Problem::NoRs485));
        }
        let no_server = |error| failed(Problem::NoServer(error));
        let mut last = io::Error::from(ErrorKind::AddrNotAvailable);
        for address in address.to_socket_addrs().map_err(no_server)? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    let set =
                        stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
                    set.map_err(|error| failed(Problem::Io(error)))?;
                    return Ok(Self { name, stream });
                }
                Err(error) => last = error,
            }
        }
        Err(no_server(last))
    }

    fn failed(&self, error: io::Error) -> PortError {
        PortError::in_use(&self.name, error)
    }
}

impl Port for Tcp {
    fn receive(&mut self, wait: Duration, heard: &mut Vec<Character>) -> Result<(), PortError> {
        let mut buffer = [0; 256];
        self.stream.set_read_timeout(Some(wait.max(LEAST))).map_err(|error| self.failed(error))?;
        match self.stream.read(&mut buffer) {
            Ok(0) => Err(PortError::new(&self.name, Problem::Vanished)),
            Ok(count) => {
                heard.extend(buffer.iter().take(count).map(|&byte| Character::clean(byte)));
                Ok(())
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(()),
                _ => Err(self.failed(error)),
            },
        }
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), PortError> {
        self.stream.write_all(frame).map_err(|error| match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => PortError::new(&self.name, Problem::Stuck),
            _ => self.failed(error),
        })
    }

    fn sent(&mut self) -> Result<(), PortError> {
        Ok(())
    }

    fn set_baud(&mut self, _: u32) -> Result<(), PortError> {
        self.can_change_baud()
    }

    fn can_change_baud(&self) -> Result<(), PortError> {
        Err(PortError::new(&self.name, Problem::FixedRate))
    }

    fn latency(&self) -> Duration {
        LATENCY
    }
}

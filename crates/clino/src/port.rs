//! Ports: what bytes go through on their way to an RS485 pair.
//!
//! | name | what it is | file |
//! |---|---|---|
//! | `/dev/ttyUSB0`, `COM3`, a pseudo-terminal | a serial port of the system, locked for others while in use | `port/serial.rs` |
//! | `tcp://host:port` | raw bytes, as ser2net and serial servers give them; the server sets the bit rate | `port/tcp.rs` |
//!
//! A port moves bytes and knows how late it delivers them. It knows no protocol, and no time but its own waits.

mod driver;
mod error;
#[cfg(unix)]
mod group;
mod list;
#[cfg(target_os = "linux")]
mod marks;
mod name;
mod serial;
mod tcp;

use std::time::Duration;

use clino_codec::character::Character;

pub use error::{PortError, Problem};
pub use list::{Listed, list};
pub use name::PortName;

/// How a serial port is set up, besides its bit rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// RTS switches the driver of the transceiver: high while a frame goes out.
    pub rts_de: bool,
    /// The kernel's RS485 mode: its driver switches the transceiver.
    pub rs485: bool,
}

/// A port that is open.
pub trait Port {
    /// Waits up to `wait` for characters, and adds what is there. Less is waited if a signal comes.
    ///
    /// # Errors
    /// It has vanished, or the system says no.
    fn receive(&mut self, wait: Duration, heard: &mut Vec<Character>) -> Result<(), PortError>;

    /// Hands over a frame; the driver of the pair is on from now until [`Port::sent`].
    ///
    /// # Errors
    /// As [`Port::receive`].
    fn send(&mut self, frame: &[u8]) -> Result<(), PortError>;

    /// The frame is out: the pair is the sensors'.
    ///
    /// # Errors
    /// As [`Port::receive`].
    fn sent(&mut self) -> Result<(), PortError>;

    /// Another bit rate from now on; what was received and not yet read is forgotten.
    ///
    /// # Errors
    /// The port does not have this rate, or cannot change it.
    fn set_baud(&mut self, baud: u32) -> Result<(), PortError>;

    /// Whether [`Port::set_baud`] can work at all.
    ///
    /// # Errors
    /// [`Problem::FixedRate`].
    fn can_change_baud(&self) -> Result<(), PortError>;

    /// How much later than it is on the pair a character may be read here.
    fn latency(&self) -> Duration;
}

/// Opens a port at this bit rate.
///
/// # Errors
/// What is wrong with it, and what to do about it.
pub fn open(name: &PortName, baud: u32, wiring: Wiring) -> Result<Box<dyn Port>, PortError> {
    Ok(match name {
        PortName::Serial(path) => Box::new(serial::Serial::open(path, baud, wiring)?),
        PortName::Tcp(address) => Box::new(tcp::Tcp::open(address, wiring)?),
    })
}

//! A byte stream: a serial port or a TCP connection.

use std::io;
use std::time::Duration;

use serial2_tokio::{CharSize, FlowControl, Parity as SerialParity, SerialPort, Settings, StopBits};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::time::timeout;

use crate::config::{Endpoint, Parity};

/// What is read from and written to.
pub trait Bytes: AsyncRead + AsyncWrite + Send + Unpin + std::fmt::Debug {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin + std::fmt::Debug> Bytes for T {}

/// How long a connection may take to be made.
const CONNECT: Duration = Duration::from_secs(5);

/// Opens a port. Its errors name it.
pub async fn open(port: &Endpoint, baud: u32, parity: Parity) -> Result<Box<dyn Bytes>, String> {
    let named = |why: io::Error| format!("{port}: {why}");
    match port {
        Endpoint::Serial(path) => {
            // Before it is opened, which would set the rate of a port that is in use elsewhere.
            clino_adapter::recognise(path).map_err(|other| format!("{port}: {other}"))?;
            let set_up = |mut settings: Settings| -> io::Result<Settings> {
                settings.set_raw();
                settings.set_baud_rate(baud)?;
                settings.set_char_size(CharSize::Bits8);
                settings.set_stop_bits(StopBits::One);
                settings.set_flow_control(FlowControl::None);
                settings.set_parity(match parity {
                    Parity::None => SerialParity::None,
                    Parity::Even => SerialParity::Even,
                    Parity::Odd => SerialParity::Odd,
                });
                Ok(settings)
            };
            let opened = SerialPort::open(path, set_up).or_else(|why| match parity {
                // A pseudo-terminal has no parity.
                Parity::Even | Parity::Odd if is_terminal_of_a_program(path) => {
                    SerialPort::open(path, |mut settings: Settings| {
                        settings.set_raw();
                        settings.set_baud_rate(baud)?;
                        Ok(settings)
                    })
                }
                _ => Err(why),
            });
            Ok(Box::new(opened.map_err(named)?))
        }
        Endpoint::Tcp(address) => {
            let stream = match timeout(CONNECT, TcpStream::connect(address)).await {
                Ok(connected) => connected.map_err(named)?,
                Err(_) => return Err(format!("{port}: no connection within {} s", CONNECT.as_secs())),
            };
            stream.set_nodelay(true).map_err(named)?;
            Ok(Box::new(stream))
        }
    }
}

fn is_terminal_of_a_program(path: &std::path::Path) -> bool {
    path.canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"))
}

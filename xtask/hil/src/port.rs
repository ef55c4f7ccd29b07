//! A serial port, with a thread that reads it.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use serial2::{CharSize, FlowControl, Parity, SerialPort, Settings, StopBits};

/// What the reading thread waits for bytes before it looks whether it is still wanted.
const READ: Duration = Duration::from_millis(200);
const CHUNK: usize = 512;

/// An open port.
pub struct Port {
    serial: Arc<SerialPort>,
    bytes: Receiver<Result<Vec<u8>, String>>,
    /// From a character that is sent to the next, if the port does not see to that.
    pace: Option<Duration>,
}

impl Port {
    /// Opens it with 8 data bits and one stop bit. A pseudo-terminal has no parity, whatever is wanted.
    ///
    /// # Errors
    /// The system's words, and the port's name.
    pub fn open(path: &str, baud: u32, parity: Parity) -> Result<Port, String> {
        let failed = |why: io::Error| format!("{path}: {why}");
        let parity = if path.starts_with("/dev/pts/") { Parity::None } else { parity };
        let set = |mut settings: Settings| {
            settings.set_raw();
            settings.set_baud_rate(baud)?;
            settings.set_char_size(CharSize::Bits8);
            settings.set_stop_bits(StopBits::One);
            settings.set_parity(parity);
            settings.set_flow_control(FlowControl::None);
            Ok(settings)
        };
        let mut serial = SerialPort::open(path, set).map_err(failed)?;
        serial.set_read_timeout(READ).map_err(failed)?;
        let serial = Arc::new(serial);
        let (sender, bytes) = channel();
        let reader = Arc::clone(&serial);
        thread::spawn(move || {
            let mut buffer = [0; CHUNK];
            loop {
                match reader.read(&mut buffer) {
                    Ok(length) => {
                        if sender.send(Ok(buffer.get(..length).unwrap_or_default().to_vec())).is_err() {
                            return;
                        }
                    }
                    Err(why) if why.kind() == io::ErrorKind::TimedOut => {
                        // An empty piece is nothing, and fails when nothing listens.
                        if sender.send(Ok(Vec::new())).is_err() {
                            return;
                        }
                    }
                    Err(why) if why.kind() == io::ErrorKind::Interrupted => {}
                    Err(why) => {
                        // Whoever waits for bytes hears it, if anyone does.
                        let _ = sender.send(Err(format!("the port has vanished: {why}")));
                        return;
                    }
                }
            }
        });
        Ok(Port { serial, bytes, pace: None })
    }

    /// The same port, which has no bit rate of its own: so much time is left to each character.
    pub fn paced(self, pace: Duration) -> Port {
        Port { pace: Some(pace), ..self }
    }

    /// Sends all of it.
    ///
    /// # Errors
    /// The system's words.
    pub fn send(&self, bytes: &[u8]) -> Result<(), String> {
        let failed = |why: io::Error| format!("cannot send: {why}");
        let Some(pace) = self.pace else { return self.serial.write_all(bytes).map_err(failed) };
        bytes.iter().try_for_each(|byte| {
            thread::sleep(pace);
            self.serial.write_all(&[*byte]).map_err(failed)
        })
    }

    /// What comes within this time; empty if nothing does.
    ///
    /// # Errors
    /// The port is gone.
    pub fn receive(&self, longest: Duration) -> Result<Vec<u8>, String> {
        use std::sync::mpsc::RecvTimeoutError as Error;
        match self.bytes.recv_timeout(longest) {
            Ok(bytes) => bytes,
            Err(Error::Timeout) => Ok(Vec::new()),
            Err(Error::Disconnected) => Err("the port has vanished".to_owned()),
        }
    }
}

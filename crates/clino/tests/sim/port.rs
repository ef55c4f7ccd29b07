//! A serial port as a program uses it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};

use super::server::PATIENCE;

/// An open port.
pub struct Port(File);

impl Port {
    /// Opens it and leaves it as it is.
    pub fn open(path: &str) -> Self {
        let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
        Self(OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).unwrap())
    }

    /// Its bit rate from now on.
    pub fn set_baud(&self, baud: u32) {
        let mut attributes = self.attributes();
        attributes.set_speed(baud).unwrap();
        tcsetattr(&self.0, OptionalActions::Now, &attributes).unwrap();
    }

    /// Its settings.
    pub fn attributes(&self) -> Termios {
        tcgetattr(&self.0).unwrap()
    }

    /// Sends bytes. Linux says of a terminal that is being set up at this instant that it would block.
    pub fn send(&mut self, bytes: &[u8]) {
        let mut left = bytes;
        while !left.is_empty() {
            match self.0.write(left) {
                Ok(count) => left = &left[count..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    std::thread::sleep(Duration::from_micros(100))
                }
                Err(error) => panic!("{error}"),
            }
        }
    }

    /// Sends bytes, as many as are taken.
    ///
    /// # Errors
    /// Those of the system.
    pub fn try_send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    /// The next `count` bytes.
    pub fn read(&mut self, count: usize) -> Vec<u8> {
        let bytes = self.read_within(count, PATIENCE);
        assert_eq!(bytes.len(), count, "{bytes:02X?} is all that came");
        bytes
    }

    /// At most `count` bytes, and those only that come within that time.
    pub fn read_within(&mut self, count: usize, time: Duration) -> Vec<u8> {
        let deadline = Instant::now() + time;
        let mut bytes = vec![0; count];
        let mut got = 0;
        while got < count {
            let left = deadline.saturating_duration_since(Instant::now());
            let left = Timespec { tv_sec: left.as_secs() as i64, tv_nsec: left.subsec_nanos().into() };
            if poll(&mut [PollFd::new(&self.0, PollFlags::IN)], Some(&left)).unwrap() == 0 {
                break;
            }
            match self.0.read(&mut bytes[got..]) {
                Ok(count) => got += count,
                // What was there was forgotten: the other end is set up anew.
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => panic!("{error}"),
            }
        }
        bytes.truncate(got);
        bytes
    }

    /// Everything from the first byte on, for which it waits, up to this much silence.
    pub fn read_until_silent(&mut self, silence: Duration) -> Vec<u8> {
        let mut bytes = self.read(1);
        while let [byte] = self.read_within(1, silence)[..] {
            bytes.push(byte);
        }
        bytes
    }

    /// Sends bytes; the next `count` bytes.
    pub fn ask(&mut self, bytes: &[u8], count: usize) -> Vec<u8> {
        self.send(bytes);
        self.read(count)
    }
}

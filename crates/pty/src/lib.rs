//! A pseudo-terminal as a serial port: bytes both ways, the bit rate that the program has set, and whether it is open.
//!
//! A real port loses what comes in while no program has it open. So bytes are handed over only to an open terminal, and
//! what a program left unread is thrown away when it closes: the next one does not read answers to questions it never
//! asked. That is why the terminal's own end is not held open, which would also keep a program's exclusive lock alive.
//!
//! The terminal is raw from the start: no echo, no translation, no signals, whether or not the program asks for it.
//!
//! Limits: Linux only. Its pseudo-terminals keep no parity, no character length, no break and no modem lines; of what a
//! program sets there remain the bit rate, the number of stop bits, and whether a parity bit would be odd.
#![cfg(target_os = "linux")]

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::{Errno, retry_on_intr};
use rustix::pty::OpenptFlags;
use rustix::termios::{ControlModes, OptionalActions, QueueSelector};

const AT_ONCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };

/// What is left of the settings that a program has made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PtySettings {
    /// Bit rate in bit/s; 0 hangs up.
    pub baud: u32,
    /// Two stop bits instead of one.
    pub two_stop_bits: bool,
    /// If there is a parity bit, which cannot be told, it is odd.
    pub odd_parity: bool,
}

/// The computer's end of a serial line.
#[derive(Debug)]
pub struct Terminal {
    master: OwnedFd,
    path: String,
    /// Bytes have been handed over since it was last emptied.
    may_hold_bytes: bool,
}

impl Terminal {
    /// A raw terminal at this bit rate.
    ///
    /// # Errors
    /// The system has no more of them.
    pub fn open(baud: u32) -> io::Result<Self> {
        Self::open_with(PtySettings { baud, two_stop_bits: false, odd_parity: false })
    }

    /// A raw terminal with these settings.
    ///
    /// # Errors
    /// The system has no more of them.
    pub fn open_with(settings: PtySettings) -> io::Result<Self> {
        let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        rustix::pty::grantpt(&master)?;
        rustix::pty::unlockpt(&master)?;
        rustix::io::ioctl_fionbio(&master, true)?;
        let path = rustix::pty::ptsname(&master, Vec::new())?;
        let path = path.into_string().map_err(|_| io::Error::other("a terminal whose name is no text"))?;
        let terminal = Self { master, path, may_hold_bytes: false };
        let port = terminal.port()?;
        let mut attributes = rustix::termios::tcgetattr(&port)?;
        attributes.make_raw();
        attributes.set_speed(settings.baud)?;
        attributes.control_modes.set(ControlModes::CSTOPB, settings.two_stop_bits);
        attributes.control_modes.set(ControlModes::PARODD, settings.odd_parity);
        rustix::termios::tcsetattr(&port, OptionalActions::Now, &attributes)?;
        Ok(terminal)
    }

    /// Where a program finds it.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The bit rate that was last set, in bit/s; `None` for 0, which hangs up.
    ///
    /// # Errors
    /// Those of the system.
    pub fn baud(&self) -> io::Result<Option<u32>> {
        Ok(Some(self.settings()?.baud).filter(|&baud| baud > 0))
    }

    /// The settings that were last made.
    ///
    /// # Errors
    /// Those of the system.
    pub fn settings(&self) -> io::Result<PtySettings> {
        let attributes = rustix::termios::tcgetattr(&self.master)?;
        Ok(PtySettings {
            baud: attributes.output_speed(),
            two_stop_bits: attributes.control_modes.contains(ControlModes::CSTOPB),
            odd_parity: attributes.control_modes.contains(ControlModes::PARODD),
        })
    }

    /// Takes bytes that the program has written, as many as there are and fit.
    ///
    /// # Errors
    /// Those of the system.
    pub fn read<'a>(&self, buffer: &'a mut [u8]) -> io::Result<&'a [u8]> {
        match rustix::io::read(&self.master, &mut *buffer) {
            Ok(count) => Ok(buffer.get(..count).unwrap_or(buffer)),
            // Nothing there, or no program.
            Err(Errno::AGAIN | Errno::IO | Errno::INTR) => Ok(&[]),
            Err(error) => Err(error.into()),
        }
    }

    /// Hands bytes to the program; they are lost if it is not there, or does not read.
    ///
    /// # Errors
    /// Those of the system.
    pub fn deliver(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.is_open()? {
            return self.forget_unread();
        }
        if bytes.is_empty() {
            return Ok(());
        }
        self.may_hold_bytes = true;
        match rustix::io::write(&self.master, bytes) {
            Ok(_) | Err(Errno::AGAIN | Errno::IO | Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Whether a program has it open.
    fn is_open(&self) -> io::Result<bool> {
        let mut terminal = [PollFd::new(&self.master, PollFlags::empty())];
        // A signal that comes just now interrupts even what does not wait.
        retry_on_intr(|| poll(&mut terminal, Some(&AT_ONCE)))?;
        Ok(!terminal.iter().any(|terminal| terminal.revents().contains(PollFlags::HUP)))
    }

    fn forget_unread(&mut self) -> io::Result<()> {
        if core::mem::take(&mut self.may_hold_bytes) {
            rustix::termios::tcflush(self.port()?, QueueSelector::IFlush)?;
        }
        Ok(())
    }

    /// The program's end.
    fn port(&self) -> io::Result<OwnedFd> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        Ok(rustix::fs::open(self.path.as_str(), flags, Mode::empty())?)
    }
}

impl AsFd for Terminal {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

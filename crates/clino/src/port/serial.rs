//! A serial port of this system: `serial2` opens it and sets the rate, what is here locks it and waits.
//!
//! *Lock.* On Unix `flock`, as picocom, minicom and pyserial's `exclusive` have it, and `TIOCEXCL`, which keeps out programs
//! that ask for no lock. A pseudo-terminal has the former alone: the program at its other end may open it, too. Windows
//! opens a port once only.
//!
//! *Errors of the receiver.* On Linux the terminal marks them in the stream (`port/marks.rs`); elsewhere they are lost.
//!
//! *RTS as DE* (`port/driver.rs`). High before the first byte; low once the system says that all bytes are out, and not before the frame's own
//! time. USB adapters do that a millisecond late or more, which a sensor's first byte may not wait for: an adapter that
//! switches by itself is better.

use std::io;
use std::path::Path;
use std::time::Duration;

use clino_codec::character::Character;
use serial2::{KeepSettings, SerialPort, Settings};

use super::driver::Driver;
use super::{Port, PortError, Problem, Wiring};

/// A port that takes no byte for this long never will.
const PATIENCE: Duration = Duration::from_secs(2);
/// A rate that is this much off is another one, in percent. Source: a UART takes about 2 % from both ends together.
const RATE_TOLERANCE: u32 = 2;
/// Bytes read at once.
const CHUNK: usize = 256;

/// An open serial port.
pub struct Serial {
    name: String,
    port: SerialPort,
    /// As it was found, and is left.
    before: Settings,
    driven_before: Option<Driven>,
    driver: Driver,
    latency: Duration,
    #[cfg(target_os = "linux")]
    marks: super::marks::Marks,
}

impl Serial {
    /// Opens and locks it, and sets it up: raw, 8N1, no flow control.
    pub fn open(path: &str, baud: u32, wiring: Wiring) -> Result<Self, PortError> {
        let failed = |problem| PortError::new(path, problem);
        // Before it is opened, which raises RTS: that may switch the driver of another bus.
        clino_adapter::recognise(Path::new(path)).map_err(|other| failed(Problem::OtherAdapter(other)))?;
        let mut port =
            SerialPort::open(path, KeepSettings).map_err(|error| failed(not_opened(path, error)))?;
        lock(path, &port).map_err(|error| failed(not_opened(path, error)))?;
        let before = port.get_configuration().map_err(|error| failed(not_a_port(error)))?;
        set_up(&mut port, baud).map_err(failed)?;
        let writes = port.set_write_timeout(PATIENCE);
        writes.map_err(|error| failed(Problem::Io(error)))?;
        let mut driven_before = None;
        if wiring.rs485 {
            driven_before = Some(drive_by_kernel(&port).map_err(failed)?);
        }
        if wiring.rts_de {
            port.set_rts(false).map_err(|_| failed(Problem::NoRts))?;
        }
        let mut serial = Self {
            name: path.to_owned(),
            port,
            before,
            driven_before,
            driver: Driver { by_rts: wiring.rts_de },
            latency: clino_adapter::latency(path),
            #[cfg(target_os = "linux")]
            marks: super::marks::Marks::default(),
        };
        serial.forget_input()?;
        Ok(serial)
    }

    fn failed(&self, error: io::Error) -> PortError {
        match error.kind() {
            io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => PortError::new(&self.name, Problem::Stuck),
            _ => PortError::in_use(&self.name, error),
        }
    }

    /// Forgets what was received and not yet read.
    fn forget_input(&mut self) -> Result<(), PortError> {
        #[cfg(target_os = "linux")]
        {
            self.marks = super::marks::Marks::default();
        }
        self.port.discard_input_buffer().map_err(|error| self.failed(error))
    }

    /// Bytes as the system has them, within `wait`.
    #[cfg(unix)]
    fn read(&mut self, wait: Duration, buffer: &mut [u8]) -> Result<usize, PortError> {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        use rustix::io::Errno;

        let seconds = i64::try_from(wait.as_secs()).unwrap_or(i64::MAX);
        let wait = Timespec { tv_sec: seconds, tv_nsec: wait.subsec_nanos().into() };
        match poll(&mut [PollFd::new(&self.port, PollFlags::IN)], Some(&wait)) {
            Ok(0) | Err(Errno::INTR) => return Ok(0),
            Ok(_) => {}
            Err(error) => return Err(self.failed(error.into())),
        }
        match rustix::io::read(&self.port, buffer) {
            // Readable, and nothing there: the other end is closed.
            Ok(0) => Err(PortError::new(&self.name, Problem::Vanished)),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => Err(self.failed(error.into())),
        }
    }

    /// Bytes as the system has them, within `wait`, which it takes in milliseconds.
    #[cfg(not(unix))]
    fn read(&mut self, wait: Duration, buffer: &mut [u8]) -> Result<usize, PortError> {
        let whole =
            Duration::from_millis(u64::try_from(wait.as_micros().div_ceil(1_000)).unwrap_or(u64::MAX));
        let set = self.port.set_read_timeout(whole.max(Duration::from_millis(1)));
        set.map_err(|error| self.failed(error))?;
        match self.port.read(buffer) {
            Ok(count) => Ok(count),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => Ok(0),
            Err(error) => Err(self.failed(error)),
        }
    }
}

impl Port for Serial {
    fn receive(&mut self, wait: Duration, heard: &mut Vec<Character>) -> Result<(), PortError> {
        let mut buffer = [0; CHUNK];
        let count = self.read(wait, &mut buffer)?;
        let bytes = buffer.get(..count).unwrap_or(&buffer);
        #[cfg(target_os = "linux")]
        heard.extend(bytes.iter().filter_map(|&byte| self.marks.take(byte)));
        #[cfg(not(target_os = "linux"))]
        heard.extend(bytes.iter().map(|&byte| Character::clean(byte)));
        Ok(())
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), PortError> {
        self.driver.send(&self.port, frame).map_err(|error| self.failed(error))
    }

    fn sent(&mut self) -> Result<(), PortError> {
        self.driver.sent(&self.port).map_err(|error| self.failed(error))
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), PortError> {
        set_up(&mut self.port, baud).map_err(|problem| match problem {
            Problem::Io(error) => self.failed(error),
            problem => PortError::new(&self.name, problem),
        })?;
        self.forget_input()
    }

    fn can_change_baud(&self) -> Result<(), PortError> {
        Ok(())
    }

    fn latency(&self) -> Duration {
        self.latency
    }
}

impl Drop for Serial {
    fn drop(&mut self) {
        if self.driver.by_rts {
            // The pair is left to the others, whatever happened. A port that has vanished drives nothing.
            let _ = self.port.set_rts(false);
        }
        // A program that sets up nothing finds what it found before: no marks in the stream, its bit rate.
        let _ = self.port.set_configuration(&self.before);
        if let Some(driven) = self.driven_before.take() {
            drive_as(&self.port, driven);
        }
    }
}

/// Raw, 8N1, no flow control, at this rate; what the port then says it runs at is compared.
fn set_up(port: &mut SerialPort, baud: u32) -> Result<(), Problem> {
    let mut settings = port.get_configuration().map_err(not_a_port)?;
    let set = |settings: &mut Settings| {
        settings.set_raw();
        settings.set_baud_rate(baud)
    };
    set(&mut settings).map_err(|_| Problem::NoSuchRate { baud })?;
    if let Err(error) = port.set_configuration(&settings) {
        // EINVAL, or what `serial2` says when the port did not take all of it: a device that is gone says something else.
        let is_refused = matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Other)
            && error.raw_os_error().is_none_or(|_| error.kind() == io::ErrorKind::InvalidInput);
        return Err(if is_refused { Problem::NoSuchRate { baud } } else { Problem::Io(error) });
    }
    let real = port.get_configuration().and_then(|settings| settings.get_baud_rate());
    let real = real.map_err(Problem::Io)?;
    if u64::from(real.abs_diff(baud)) * 100 > u64::from(baud) * u64::from(RATE_TOLERANCE) {
        return Err(Problem::NoSuchRate { baud });
    }
    mark_errors(port).map_err(Problem::Io)
}

/// How the transceiver is switched.
#[cfg(target_os = "linux")]
type Driven = serial2::rs4xx::TransceiverMode;
/// Linux alone has a mode to be put back.
#[cfg(not(target_os = "linux"))]
type Driven = std::convert::Infallible;

/// Has the kernel's driver switch the transceiver: RTS high while it sends, no delays. Returns how it was switched before.
#[cfg(target_os = "linux")]
fn drive_by_kernel(port: &SerialPort) -> Result<Driven, Problem> {
    let before = port.get_rs4xx_mode().map_err(|_| Problem::NoRs485)?;
    port.set_rs4xx_mode(serial2::rs4xx::Rs485Config::new()).map_err(|_| Problem::NoRs485)?;
    Ok(before)
}

#[cfg(not(target_os = "linux"))]
fn drive_by_kernel(_: &SerialPort) -> Result<Driven, Problem> {
    Err(Problem::NoRs485)
}

/// Has it switched as before. A port that has vanished forgets its mode by itself.
#[cfg(target_os = "linux")]
fn drive_as(port: &SerialPort, driven: Driven) {
    let _ = port.set_rs4xx_mode(driven);
}

#[cfg(not(target_os = "linux"))]
fn drive_as(_: &SerialPort, driven: Driven) {
    match driven {}
}

/// The settings of what is no terminal cannot be read.
fn not_a_port(error: io::Error) -> Problem {
    #[cfg(unix)]
    if error.raw_os_error() == Some(rustix::io::Errno::NOTTY.raw_os_error()) {
        return Problem::NotAPort;
    }
    Problem::Io(error)
}

/// Has the terminal mark what the receiver says of a character.
#[cfg(target_os = "linux")]
fn mark_errors(port: &SerialPort) -> io::Result<()> {
    use rustix::termios::{InputModes, OptionalActions, tcgetattr, tcsetattr};

    let mut attributes = tcgetattr(port)?;
    attributes.input_modes.remove(InputModes::IGNBRK | InputModes::BRKINT | InputModes::IGNPAR);
    attributes.input_modes.insert(InputModes::PARMRK | InputModes::INPCK);
    Ok(tcsetattr(port, OptionalActions::Now, &attributes)?)
}

#[cfg(not(target_os = "linux"))]
#[expect(clippy::unnecessary_wraps, reason = "on Linux it can fail")]
fn mark_errors(_: &SerialPort) -> io::Result<()> {
    Ok(())
}

/// Keeps other programs out, or says that one is there.
#[cfg(unix)]
fn lock(path: &str, port: &SerialPort) -> io::Result<()> {
    use rustix::fs::{FlockOperation, flock};

    flock(port, FlockOperation::NonBlockingLockExclusive)?;
    if !is_pseudo_terminal(path) {
        rustix::termios::ioctl_tiocexcl(port)?;
    }
    Ok(())
}

#[cfg(not(unix))]
#[expect(clippy::unnecessary_wraps, reason = "on Unix it can fail")]
fn lock(_: &str, _: &SerialPort) -> io::Result<()> {
    Ok(())
}

/// Whether the other end is a program of this computer.
#[cfg(unix)]
fn is_pseudo_terminal(path: &str) -> bool {
    Path::new(path).canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"))
}

/// Why a port cannot be opened, or locked.
fn not_opened(path: &str, error: io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::NotFound => Problem::Missing,
        #[cfg(unix)]
        io::ErrorKind::PermissionDenied => Problem::NotPermitted { group: super::group::of(Path::new(path)) },
        // Windows says so of a port that another program has.
        #[cfg(not(unix))]
        io::ErrorKind::PermissionDenied => Problem::Busy,
        io::ErrorKind::ResourceBusy | io::ErrorKind::WouldBlock => Problem::Busy,
        io::ErrorKind::IsADirectory => Problem::NotAPort,
        _ if !Path::new(path).exists() => Problem::Missing,
        _ => not_a_port(error),
    }
}

//! What is wrong with a port, and what to do about it.

use std::io;

use clino_adapter::OtherAdapter;

use crate::bad::Bad;

/// A port that cannot be used.
#[derive(Debug)]
pub struct PortError {
    /// Its name, as on the command line.
    pub port: String,
    /// What is wrong with it.
    pub problem: Problem,
}

/// What is wrong with a port.
#[derive(Debug)]
pub enum Problem {
    /// There is no port of this name.
    Missing,
    /// Another program has it.
    Busy,
    /// This user may not open it. The group that may, if the system says so.
    #[cfg_attr(not(unix), expect(dead_code, reason = "Windows lets every user open every port"))]
    NotPermitted { group: Option<String> },
    /// There is something of this name, but it is no serial port.
    NotAPort,
    /// It does not have this bit rate.
    NoSuchRate { baud: u32 },
    /// Its bit rate is set elsewhere.
    FixedRate,
    /// Its driver has no RS485 mode.
    NoRs485,
    /// It has no RTS line.
    NoRts,
    /// It was there, and is gone.
    Vanished,
    /// Another adapter has its name since this program opened it first.
    OtherAdapter(OtherAdapter),
    /// No server answers at this address.
    NoServer(io::Error),
    /// It takes no more bytes.
    Stuck,
    /// The system says something else.
    Io(io::Error),
}

impl PortError {
    /// A problem of that port.
    pub fn new(port: &str, problem: Problem) -> Self {
        Self { port: port.to_owned(), problem }
    }

    /// What an error of an open port means.
    pub fn in_use(port: &str, error: io::Error) -> Self {
        Self::new(port, if is_gone(&error) { Problem::Vanished } else { Problem::Io(error) })
    }

    /// Its kind, for programs.
    pub fn kind(&self) -> &'static str {
        match self.problem {
            Problem::Missing => "port_missing",
            Problem::Busy => "port_busy",
            Problem::NotPermitted { .. } => "port_not_permitted",
            Problem::NotAPort => "not_a_port",
            Problem::NoSuchRate { .. } => "no_such_rate",
            Problem::FixedRate => "fixed_rate",
            Problem::NoRs485 => "no_rs485",
            Problem::NoRts => "no_rts",
            Problem::Vanished => "port_vanished",
            Problem::OtherAdapter(_) => "port_other",
            Problem::NoServer(_) => "no_server",
            Problem::Stuck => "port_stuck",
            Problem::Io(_) => "port_failed",
        }
    }

    /// One sentence for people.
    pub fn message(&self) -> String {
        let port = &self.port;
        match &self.problem {
            Problem::Missing => format!("there is no port {port}"),
            Problem::Busy => format!("another program uses {port}"),
            Problem::NotPermitted { .. } => format!("you may not open {port}"),
            Problem::NotAPort => format!("{port} is not a serial port"),
            Problem::NoSuchRate { baud } => format!("{port} does not take {baud} bit/s"),
            Problem::FixedRate => format!("the bit rate of {port} is set at its server"),
            Problem::NoRs485 => format!("the driver of {port} has no RS485 mode"),
            Problem::NoRts => format!("{port} has no RTS line to switch"),
            Problem::Vanished => format!("{port} has vanished"),
            Problem::OtherAdapter(other) => format!("{port}: {other}"),
            Problem::NoServer(error) => format!("no server answers at {port}: {error}"),
            Problem::Stuck => format!("{port} takes no more bytes"),
            Problem::Io(error) => format!("{port}: {error}"),
        }
    }

    /// What to do next.
    pub fn next(&self) -> String {
        match &self.problem {
            Problem::Missing => "plug the adapter in; clino ports lists the ports".to_owned(),
            Problem::Busy => format!("end the other program; on Linux fuser -v {} names it", self.port),
            Problem::NotPermitted { group: Some(group) } => {
                format!("sudo usermod -aG {group} $USER, then log out and in again")
            }
            Problem::NotPermitted { group: None } => {
                "ask the owner of this computer for access to it".to_owned()
            }
            Problem::NotAPort => "clino ports lists the serial ports".to_owned(),
            Problem::NoSuchRate { .. } => "choose another rate, or another adapter".to_owned(),
            Problem::FixedRate => {
                "give --baud the rate of the server; set the server to another rate to look there".to_owned()
            }
            Problem::NoRs485 => {
                "leave --rs485 out: most USB adapters switch by themselves; --rts-de if RTS switches yours"
                    .to_owned()
            }
            Problem::NoRts => "leave --rts-de out".to_owned(),
            Problem::Vanished => {
                "check the plug and the cable of the adapter; clino ports lists the ports".to_owned()
            }
            Problem::OtherAdapter(_) => {
                "plug the former one in, or start this program again; clino ports lists names that stay"
                    .to_owned()
            }
            Problem::NoServer(_) => {
                "check that the server runs, its address, and a firewall between".to_owned()
            }
            Problem::Stuck => {
                "unplug the adapter and plug it in again; flow control must be off at a server".to_owned()
            }
            Problem::Io(_) => "unplug the adapter and plug it in again".to_owned(),
        }
    }

    /// As an object for programs.
    pub fn object(&self) -> Bad {
        let bad = Bad::new(self.kind(), self.message());
        bad.with("port", self.port.as_str()).with("next", self.next().as_str())
    }
}

/// Whether an error says that the device, or the other end, is not there any more.
fn is_gone(error: &io::Error) -> bool {
    use io::ErrorKind as K;
    let by_kind = matches!(
        error.kind(),
        K::NotFound
            | K::BrokenPipe
            | K::ConnectionReset
            | K::ConnectionAborted
            | K::NotConnected
            | K::UnexpectedEof
    );
    by_kind || error.raw_os_error().is_some_and(|code| GONE.contains(&code))
}

/// EIO, ENXIO, ENODEV: the same numbers on every Unix.
#[cfg(unix)]
const GONE: [i32; 3] = [5, 6, 19];
/// ERROR_ACCESS_DENIED, ERROR_BAD_COMMAND, ERROR_GEN_FAILURE, ERROR_OPERATION_ABORTED, ERROR_DEVICE_REMOVED: what drivers
/// of adapters say that were unplugged.
#[cfg(not(unix))]
const GONE: [i32; 5] = [5, 22, 31, 995, 1_617];

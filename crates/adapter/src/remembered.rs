//! Whether a port's name still stands for the adapter that it stood for.
//!
//! The kernel hands out `ttyUSB0`, `ttyUSB1`, … in the order in which adapters appear. Two that are unplugged, or whose hub loses
//! its supply for a moment, may change places: the sensors of one bus would be read as those of the other, each with a good
//! checksum. So the first adapter that a program opens by such a name is the one that the name stands for until the program ends.
//!
//! *The same.* An adapter with a serial number is the same in any socket. One without, or with a number that another one beside it
//! has, too, as cheap ones do, is the same in the same socket.
//!
//! *Links.* A name that is a link follows a rule of its own, such as `/dev/serial/by-id/…` or one of the user's: what it leads to
//! is right.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::{TERMINALS, Usb, device, usb_below};

/// Where names are that stay, best first: by the adapter's serial number, by its socket.
const STABLE: [&str; 2] = ["/dev/serial/by-id", "/dev/serial/by-path"];

/// By name, what this program has found first.
static FIRST: Mutex<BTreeMap<PathBuf, Adapter>> = Mutex::new(BTreeMap::new());

/// Another adapter has the port's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherAdapter {
    /// What had it first.
    pub was: String,
    /// What has it now; none if that is no USB adapter.
    pub is: Option<String>,
}

impl fmt::Display for OtherAdapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is = self.is.as_deref().unwrap_or("no USB adapter");
        write!(f, "it is another adapter now: {is}, before {}", self.was)
    }
}

/// An adapter as it is told from others.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Adapter {
    usb: Usb,
    /// Where it is plugged in, and which of its ports this is: `1-4:1.0`.
    socket: String,
    /// No other port has its serial number.
    has_own_serial: bool,
}

impl Adapter {
    fn behind(terminals: &Path, port: &Path) -> Option<Self> {
        let usb = usb_below(terminals, port)?;
        let socket = socket(terminals, port)?;
        let is_twin = |other: &PathBuf| {
            usb_below(terminals, other).as_ref() == Some(&usb)
                && self::socket(terminals, other)
                    .is_some_and(|other| other != socket && port_of(&other) == port_of(&socket))
        };
        let others = fs::read_dir(terminals).into_iter().flatten().flatten();
        let has_twin =
            others.map(|other| Path::new("/dev").join(other.file_name())).any(|other| is_twin(&other));
        Some(Self { has_own_serial: usb.serial.is_some() && !has_twin, usb, socket })
    }

    fn is(&self, before: &Self) -> bool {
        let alike = self.usb == before.usb && port_of(&self.socket) == port_of(&before.socket);
        alike && (self.socket == before.socket || (self.has_own_serial && before.has_own_serial))
    }
}

impl fmt::Display for Adapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.usb.name.is_empty() { &self.usb.id } else { &self.usb.name };
        match &self.usb.serial {
            Some(serial) => write!(f, "{name} {serial} at {}", self.socket),
            None => write!(f, "{name} at {}", self.socket),
        }
    }
}

/// Which of an adapter's ports: what follows the colon of `1-4:1.0`.
fn port_of(socket: &str) -> &str {
    socket.rsplit(':').next().unwrap_or(socket)
}

/// The folder below that of the adapter, on the way to the terminal.
fn socket(terminals: &Path, port: &Path) -> Option<String> {
    let device = device(terminals, port)?;
    let mut names = device.ancestors().filter_map(|folder| folder.file_name()?.to_str());
    names.find(|name| name.contains(':')).map(str::to_owned)
}

/// Remembers the adapter behind a port the first time; later, whether it is still that one. To be called before the port is opened:
/// another one is not to be touched.
///
/// # Errors
/// Another one has its name.
pub fn recognise(port: &Path) -> Result<(), OtherAdapter> {
    let mut first = FIRST.lock().unwrap_or_else(PoisonError::into_inner);
    recognise_below(Path::new(TERMINALS), &mut first, port)
}

fn recognise_below(
    terminals: &Path,
    first: &mut BTreeMap<PathBuf, Adapter>,
    port: &Path,
) -> Result<(), OtherAdapter> {
    if port.is_symlink() {
        return Ok(());
    }
    let now = Adapter::behind(terminals, port);
    let Some(before) = first.get(port) else {
        first.extend(now.map(|now| (port.to_owned(), now)));
        return Ok(());
    };
    if now.as_ref().is_some_and(|now| now.is(before)) {
        return Ok(());
    }
    Err(OtherAdapter { was: before.to_string(), is: now.map(|now| now.to_string()) })
}

/// A name of this port that stays when adapters are unplugged or the computer starts again; `None` where there is none, or for a
/// name that is a link already.
pub fn stable_name(port: &Path) -> Option<PathBuf> {
    if port.is_symlink() {
        return None;
    }
    // The number of a twin leads to one of both.
    let by_serial = Adapter::behind(Path::new(TERMINALS), port)?.has_own_serial;
    STABLE.iter().skip(usize::from(!by_serial)).find_map(|folder| link_to(Path::new(folder), port))
}

/// The link of a folder that leads there.
fn link_to(folder: &Path, port: &Path) -> Option<PathBuf> {
    let port = port.canonicalize().ok()?;
    let mut links = fs::read_dir(folder).ok()?.flatten().map(|link| link.path());
    links.find(|link| link.canonicalize().is_ok_and(|leads_to| leads_to == port))
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// A `/sys` in which adapters can be plugged in and out.
    struct Sys(PathBuf);

    impl Sys {
        fn new(name: &str) -> Self {
            let root = std::env::temp_dir().join(format!("clino-adapter-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&root);
            fs::create_dir_all(root.join("tty")).unwrap();
            Self(root)
        }

        /// Plugs an adapter with a number of ports in; the kernel gives them these names.
        fn plug(&self, socket: &str, serial: Option<&str>, terminals: &[&str]) {
            let adapter = self.0.join("devices/usb1").join(socket);
            fs::create_dir_all(&adapter).unwrap();
            let files = [("idVendor", "0403"), ("idProduct", "6001"), ("product", "UART")];
            files.into_iter().chain(serial.map(|serial| ("serial", serial))).for_each(|(name, text)| {
                fs::write(adapter.join(name), text).unwrap();
            });
            for (number, terminal) in terminals.iter().enumerate() {
                let device = adapter.join(format!("{socket}:1.{number}")).join(terminal);
                fs::create_dir_all(&device).unwrap();
                let tty = self.0.join("tty").join(terminal);
                fs::create_dir_all(&tty).unwrap();
                symlink(device, tty.join("device")).unwrap();
            }
        }

        fn unplug_all(&self) {
            fs::remove_dir_all(&self.0).unwrap();
            fs::create_dir_all(self.0.join("tty")).unwrap();
        }

        fn terminals(&self) -> PathBuf {
            self.0.join("tty")
        }
    }

    impl Drop for Sys {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// What a program finds, one look after another.
    #[derive(Default)]
    struct Program(BTreeMap<PathBuf, Adapter>);

    impl Program {
        fn looks(&mut self, sys: &Sys, terminal: &str) -> Result<(), OtherAdapter> {
            // There is no such name in `/dev`: it is no link.
            recognise_below(&sys.terminals(), &mut self.0, &Path::new("/dev").join(terminal))
        }
    }

    #[test]
    fn two_that_change_places_are_told() {
        for serials in [[Some("A1"), Some("A2")], [None, None], [Some("0001"), Some("0001")]] {
            let sys = Sys::new("places");
            let mut program = Program::default();
            sys.plug("1-4", serials[0], &["ttyT0"]);
            sys.plug("1-5", serials[1], &["ttyT1"]);
            assert_eq!((program.looks(&sys, "ttyT0"), program.looks(&sys, "ttyT1")), (Ok(()), Ok(())));
            // The supply of their hub fails: first one is back, then the other.
            sys.unplug_all();
            sys.plug("1-5", serials[1], &["ttyT0"]);
            let other = program.looks(&sys, "ttyT0").unwrap_err();
            let names = serials.map(|serial| serial.map_or(String::new(), |serial| format!("{serial} ")));
            assert_eq!(other.was, format!("UART {}at 1-4:1.0", names[0]));
            assert_eq!(other.is, Some(format!("UART {}at 1-5:1.0", names[1])));
            sys.plug("1-4", serials[0], &["ttyT1"]);
            assert!(program.looks(&sys, "ttyT0").is_err() && program.looks(&sys, "ttyT1").is_err());
            // They are as before.
            sys.unplug_all();
            sys.plug("1-4", serials[0], &["ttyT0"]);
            sys.plug("1-5", serials[1], &["ttyT1"]);
            assert_eq!((program.looks(&sys, "ttyT0"), program.looks(&sys, "ttyT1")), (Ok(()), Ok(())));
        }
    }

    #[test]
    fn one_with_a_serial_number_of_its_own_may_move_to_another_socket() {
        let sys = Sys::new("socket");
        let mut program = Program::default();
        sys.plug("1-4", Some("A1"), &["ttyT0"]);
        assert_eq!(program.looks(&sys, "ttyT0"), Ok(()));
        sys.unplug_all();
        sys.plug("2-1.3", Some("A1"), &["ttyT0"]);
        assert_eq!(program.looks(&sys, "ttyT0"), Ok(()));
        // Now another one has that number, too.
        sys.plug("2-1.4", Some("A1"), &["ttyT1"]);
        assert!(program.looks(&sys, "ttyT0").is_err());
    }

    #[test]
    fn the_ports_of_one_adapter_are_told_apart() {
        let sys = Sys::new("ports");
        let mut program = Program::default();
        sys.plug("1-4", Some("A1"), &["ttyT0", "ttyT1"]);
        assert_eq!((program.looks(&sys, "ttyT0"), program.looks(&sys, "ttyT1")), (Ok(()), Ok(())));
        sys.unplug_all();
        sys.plug("1-4", Some("A1"), &["ttyT1", "ttyT0"]);
        assert!(program.looks(&sys, "ttyT0").is_err() && program.looks(&sys, "ttyT1").is_err());
    }

    #[test]
    fn what_is_no_usb_adapter_is_not_remembered_and_takes_no_place_of_one() {
        let sys = Sys::new("none");
        let mut program = Program::default();
        assert_eq!(program.looks(&sys, "ttyT0"), Ok(()));
        sys.plug("1-4", None, &["ttyT0"]);
        assert_eq!(program.looks(&sys, "ttyT0"), Ok(()));
        sys.unplug_all();
        assert_eq!(program.looks(&sys, "ttyT0").unwrap_err().is, None);
    }

    #[test]
    fn a_link_is_followed_and_found_again() {
        let sys = Sys::new("link");
        let [port, link] = ["port", "link"].map(|name| sys.0.join(name));
        fs::write(&port, "").unwrap();
        symlink(&port, &link).unwrap();
        let mut program = Program::default();
        let usb = Usb { id: "0403:6001".to_owned(), name: "UART".to_owned(), serial: None };
        let other = Adapter { usb, socket: "1-4:1.0".to_owned(), has_own_serial: false };
        program.0.extend([&port, &link].map(|name| (name.clone(), other.clone())));
        let mut looks = |name| recognise_below(&sys.terminals(), &mut program.0, name);
        assert_eq!((looks(&link), looks(&port).is_err()), (Ok(()), true));
        let [empty, links] = ["empty", "links"].map(|name| sys.0.join(name));
        fs::create_dir(&empty).unwrap();
        fs::create_dir(&links).unwrap();
        symlink(&port, links.join("usb-UART")).unwrap();
        symlink(&empty, links.join("another")).unwrap();
        assert_eq!((link_to(&empty, &port), link_to(&links, &port)), (None, Some(links.join("usb-UART"))));
    }
}

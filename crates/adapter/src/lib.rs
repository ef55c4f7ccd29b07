//! What Linux knows of the USB adapter behind a serial port: its name, how long it holds characters back, and whether it is
//! the one that this program found there before.
//!
//! ```text
//! /sys/class/tty/ttyUSB0/device ──▶ …/usb1/1-4/1-4:1.0/ttyUSB0
//!                                        │             latency_timer   FTDI alone: ms, 1 to 255
//!                                        └ idVendor, idProduct, manufacturer, product, serial
//! ```
//! An FTDI sends what it has when its timer runs out, 16 ms after the last time. 1 ms is a USB frame: no adapter is faster.
//!
//! Elsewhere there is no such file: every port has the usual delay, and nothing is remembered. On macOS the name of a port has
//! the serial number in it, and Windows keeps COM numbers by it.

mod remembered;

pub use remembered::{OtherAdapter, recognise, stable_name};

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where the terminals are.
const TERMINALS: &str = "/sys/class/tty";
/// The shortest time of an FTDI's timer.
const SHORTEST_MS: u32 = 1;

/// From the adapter to this program: two USB frames of 1 ms, with the kernel's part in them. A busy computer needs no more: what
/// comes while this program stands still is heard, because it looks before it judges.
const COMPUTER: Duration = Duration::from_millis(2);
/// What other adapters hold back, and what the program at the other end of a pseudo-terminal may need. Our choice: the
/// longest that is usual, an FTDI's 16 ms.
const USUAL: Duration = Duration::from_millis(16);

/// A USB adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usb {
    /// Vendor and product, four hexadecimal digits each: `0403:6001`.
    pub id: String,
    /// Manufacturer and product, as the adapter has them.
    pub name: String,
    /// Its serial number, if it has one.
    pub serial: Option<String>,
}

/// How much later than on the pair a character is read from this port; an FTDI is set to its shortest time before, if the
/// system allows.
pub fn latency(port: &str) -> Duration {
    COMPUTER + held_back(Path::new(TERMINALS), Path::new(port))
}

/// The USB adapter behind a port.
pub fn usb(port: &Path) -> Option<Usb> {
    usb_below(Path::new(TERMINALS), port)
}

/// An FTDI's timer behind a port, in milliseconds.
pub fn timer_ms(port: &Path) -> Option<u32> {
    number(&timer(Path::new(TERMINALS), port)?)
}

fn held_back(terminals: &Path, port: &Path) -> Duration {
    let Some(timer) = timer(terminals, port) else { return USUAL };
    if number(&timer).is_some_and(|ms| ms > SHORTEST_MS) {
        // Not allowed to everyone: what it then says counts.
        let _ = fs::write(&timer, SHORTEST_MS.to_string());
    }
    number(&timer).map_or(USUAL, |ms| Duration::from_millis(ms.into()))
}

/// The file of an FTDI's timer.
fn timer(terminals: &Path, port: &Path) -> Option<PathBuf> {
    Some(device(terminals, port)?.join("latency_timer")).filter(|path| path.exists())
}

fn usb_below(terminals: &Path, port: &Path) -> Option<Usb> {
    let device = device(terminals, port)?;
    let adapter = device.ancestors().find(|folder| folder.join("idVendor").exists())?;
    let of = |file: &str| text(&adapter.join(file));
    let names = [of("manufacturer"), of("product")].into_iter().flatten().collect::<Vec<_>>();
    Some(Usb {
        id: format!("{}:{}", of("idVendor")?, of("idProduct")?),
        name: names.join(" "),
        serial: of("serial"),
    })
}

/// The folder of the device behind a port, links followed: `/dev/serial/by-id/…` is a link, too.
fn device(terminals: &Path, port: &Path) -> Option<PathBuf> {
    let port = port.canonicalize().unwrap_or_else(|_| port.to_owned());
    terminals.join(port.file_name()?).join("device").canonicalize().ok()
}

fn number(path: &Path) -> Option<u32> {
    text(path)?.parse().ok()
}

fn text(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    const PORT: &str = "/dev/ttyUSB-of-a-test";

    /// A `/sys` with one FTDI at 16 ms, and one adapter of another make.
    fn sys(name: &str) -> PathBuf {
        let root = std::env::temp_dir().join(format!("clino-sysfs-{name}-{}", std::process::id()));
        let adapter = root.join("devices/usb1/1-4");
        let device = adapter.join("1-4:1.0/ttyUSB0");
        fs::create_dir_all(&device).unwrap();
        let files = [("idVendor", "0403\n"), ("idProduct", "6001\n"), ("manufacturer", "FTDI\n")];
        let files = files.into_iter().chain([("product", "FT232R USB UART\n"), ("serial", "A50285BI\n")]);
        files.for_each(|(name, text)| fs::write(adapter.join(name), text).unwrap());
        fs::write(device.join("latency_timer"), "16\n").unwrap();
        let other = root.join("devices/usb1/1-5/1-5:1.0/ttyUSB1");
        fs::create_dir_all(&other).unwrap();
        for (name, text) in [("idVendor", "1a86\n"), ("idProduct", "7523\n"), ("product", "USB Serial\n")] {
            fs::write(root.join("devices/usb1/1-5").join(name), text).unwrap();
        }
        for (name, device) in [(PORT, device), ("/dev/ttyUSB-of-another", other)] {
            let tty = root.join("tty").join(Path::new(name).file_name().unwrap());
            fs::create_dir_all(&tty).unwrap();
            std::os::unix::fs::symlink(device, tty.join("device")).unwrap();
        }
        root
    }

    #[test]
    fn an_adapter_is_named_as_it_names_itself() {
        let root = sys("names");
        let usb = |port: &str| usb_below(&root.join("tty"), Path::new(port));
        let ftdi = Usb {
            id: "0403:6001".to_owned(),
            name: "FTDI FT232R USB UART".to_owned(),
            serial: Some("A50285BI".to_owned()),
        };
        assert_eq!(usb(PORT), Some(ftdi));
        let other = Usb { id: "1a86:7523".to_owned(), name: "USB Serial".to_owned(), serial: None };
        assert_eq!(usb("/dev/ttyUSB-of-another"), Some(other));
        assert_eq!(usb("/dev/ttyS-of-a-test"), None);
        fs::remove_dir_all(root).unwrap();
    }

    #[test]
    fn an_ftdi_is_set_to_its_shortest_time_where_that_is_allowed() {
        let root = sys("timer");
        let held_back = |port: &str| held_back(&root.join("tty"), Path::new(port)).as_millis();
        let timer = root.join("devices/usb1/1-4/1-4:1.0/ttyUSB0/latency_timer");
        assert_eq!(held_back(PORT), 1);
        assert_eq!(fs::read_to_string(&timer).unwrap(), "1");
        assert_eq!(held_back("/dev/ttyUSB-of-another"), 16);
        // A timer that cannot be written, even by root: what it says is allowed for.
        fs::remove_file(&timer).unwrap();
        std::os::unix::fs::symlink(root.join("devices/elsewhere"), &timer).unwrap();
        assert_eq!(held_back(PORT), 16);
        fs::remove_dir_all(root).unwrap();
    }
}

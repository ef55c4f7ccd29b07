//! `vboard` with the self-test firmware in real time: a program on the Modbus port's pseudo-terminal gets its bytes
//! back.
//!
//! Times are generous: the computer may have other things to do, and the board says so and takes its time.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process};
use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};

const PATIENCE: Duration = Duration::from_secs(60);
/// Longer than an echo takes.
const QUIET: Duration = Duration::from_secs(1);

/// What gets the firmware to its end: characters on the T7 bus and edges on both PWM inputs.
const SCENARIO: &str = r#"
t7 = [{ address = 1, motion.constant = 0, babble = [{ from = "0s", until = "2s" }] }]
pwm = [
    { channel = 1, frequency = 1000, motion.constant = 90 },
    { channel = 2, frequency = 1000, motion.constant = 90 },
]
"#;

/// A running board; it ends with its owner.
struct Served {
    child: Child,
    modbus: File,
    /// What is left of its output. The board would end if nobody took it.
    _console: Receiver<String>,
}

impl Served {
    fn start() -> Self {
        let scenario = Path::new(env!("CARGO_TARGET_TMPDIR")).join("served.toml");
        std::fs::write(&scenario, SCENARIO).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_vboard"))
            .arg("--elf")
            .arg(super::elf())
            .arg("--scenario")
            .arg(scenario)
            .arg("--modbus-pty")
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        let line = lines.recv_timeout(PATIENCE).unwrap();
        let path = line.strip_prefix("modbus ").unwrap_or_else(|| panic!("not {line:?}"));
        let modbus = OpenOptions::new().read(true).write(true).open(path).unwrap();
        Self { child, modbus, _console: lines }
    }

    /// What comes until there has been nothing for a while.
    fn heard(&mut self) -> Vec<u8> {
        let mut heard = Vec::new();
        let wait = Timespec { tv_sec: QUIET.as_secs().cast_signed(), tv_nsec: 0 };
        while poll(&mut [PollFd::new(&self.modbus, PollFlags::IN)], Some(&wait)).unwrap() > 0 {
            let mut buffer = [0; 256];
            let count = self.modbus.read(&mut buffer).unwrap();
            assert_ne!(count, 0, "the board has ended");
            heard.extend(&buffer[..count]);
        }
        heard
    }

    fn asks(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.modbus.write_all(bytes).unwrap();
        self.heard()
    }

    fn set(&self, change: impl FnOnce(&mut rustix::termios::Termios)) {
        let mut settings = tcgetattr(&self.modbus).unwrap();
        change(&mut settings);
        tcsetattr(&self.modbus, OptionalActions::Now, &settings).unwrap();
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::INT);
        let _ = self.child.wait();
    }
}

#[test]
#[ignore = "needs the thumb target"]
fn a_program_on_a_pseudo_terminal_talks_to_the_modbus_port() {
    let mut served = Served::start();
    // The firmware has other stages before.
    let since = Instant::now();
    while served.asks(&[0x55]) != [0x55] {
        assert!(since.elapsed() < PATIENCE, "no echo");
    }
    let all: Vec<u8> = (0..32).map(|n| n * 8 + n / 4).collect();
    assert_eq!(served.asks(&all), all, "one frame, without a gap that would end it");
    // Another bit rate is another language.
    served.set(|settings| settings.set_speed(9_600).unwrap());
    assert_ne!(served.asks(&[1, 2, 3]), [1, 2, 3]);
    // With two stop bits there is no parity bit, and the firmware hears a wrong one.
    served.set(|settings| {
        settings.set_speed(19_200).unwrap();
        settings.control_modes.insert(ControlModes::CSTOPB);
    });
    served.asks(&[1]);
    served.set(|settings| settings.control_modes.remove(ControlModes::CSTOPB));
    assert_eq!(served.asks(&all), all);
}

//! `vboard` with the self-test firmware in real time: a program on the Modbus port's pseudo-terminal gets its bytes
//! back.
//!
//! The computer may have other things to do: what must come is waited for, and a late echo is not taken for that of
//! the next request.

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
/// Longer than an echo takes on a quiet computer.
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
    /// What is left of its output. The board would end if it were not read.
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

    /// The next `count` bytes, or fewer if no more come within that time.
    fn hears(&mut self, count: usize, patience: Duration) -> Vec<u8> {
        let deadline = Instant::now() + patience;
        let mut heard = vec![0; count];
        let mut length = 0;
        while length < count {
            let left = deadline.saturating_duration_since(Instant::now());
            let left = Timespec { tv_sec: left.as_secs().cast_signed(), tv_nsec: left.subsec_nanos().into() };
            if poll(&mut [PollFd::new(&self.modbus, PollFlags::IN)], Some(&left)).unwrap() == 0 {
                break;
            }
            let more = self.modbus.read(&mut heard[length..]).unwrap();
            assert_ne!(more, 0, "the board has ended");
            length += more;
        }
        heard.truncate(length);
        heard
    }

    fn sends(&mut self, bytes: &[u8]) {
        self.modbus.write_all(bytes).unwrap();
    }

    /// The echo of these bytes.
    fn echo(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.sends(bytes);
        self.hears(bytes.len(), PATIENCE)
    }

    /// Waits until the firmware echoes, and nothing of earlier requests is left to come.
    fn synchronize(&mut self) {
        let since = Instant::now();
        for number in 1_u8.. {
            assert!(since.elapsed() < PATIENCE, "no echo");
            let mark = [0xA5, 0x5A, number, !number];
            self.sends(&mark);
            let mut heard = Vec::new();
            loop {
                // Longer each time, for a computer that takes longer.
                let more = self.hears(1, QUIET * number.into());
                heard.extend(&more);
                if heard.ends_with(&mark) {
                    return;
                }
                if more.is_empty() {
                    break;
                }
            }
        }
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
    served.synchronize();
    let all: Vec<u8> = (0..32).map(|n| n * 8 + n / 4).collect();
    assert_eq!(served.echo(&all), all, "one frame, without a gap that would end it");
    // Another bit rate is another language.
    served.set(|settings| settings.set_speed(9_600).unwrap());
    served.sends(&[1, 2, 3]);
    assert_ne!(served.hears(3, QUIET), [1, 2, 3]);
    // With two stop bits there is no parity bit, and the firmware hears a wrong one.
    served.set(|settings| {
        settings.set_speed(19_200).unwrap();
        settings.control_modes.insert(ControlModes::CSTOPB);
    });
    served.sends(&[1]);
    served.hears(1, QUIET);
    served.set(|settings| settings.control_modes.remove(ControlModes::CSTOPB));
    served.synchronize();
    assert_eq!(served.echo(&all), all);
}

//! The image on QEMU, as a smoke test: machine `netduinoplus2`, an STM32F405, with what it lacks made up for from outside.
//!
//! | QEMU | here |
//! |---|---|
//! | no device number, no system memory | the image's check of the chip is skipped; reads of system memory are answered |
//! | the crystal is never ready | `RCC` is given the values of a board that runs on its crystal |
//! | timers count at 1 GHz, and do not compare | the clock's prescaler is set; both levels that wait for alarms are woken all the time |
//! | a reset of a peripheral of APB2 crashes QEMU 10 | it runs under a debugger, which returns from the crash |
//! | no GPIO, watchdog, flash controller, cycle counter, PWM inputs | not checked |
//!
//! Each port is a pseudo-terminal. Nothing here is about time: answers only are checked. The image is restarted by planted
//! faults only: after a reset the machine's timers end no round for as long as it has run before.

mod guest;
mod part;
mod tester;

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clino_testkit::programs::Qemu as Programs;
use serde_json::Value;

use crate::ports::Ports;
use guest::Guest;
pub use guest::{PC, SP};
use part::Part;
use tester::Tester;

/// For QEMU to open its sockets.
const START: Duration = Duration::from_secs(60);
/// Between two looks at what the part lacks.
const LOOK: Duration = Duration::from_micros(500);

/// Returns from calls of `qemu_set_irq` with what is no interrupt: the machine's clock controller has fewer reset lines than it
/// looks up.
const SCRIPT: &str = "\
set pagination off
set confirm off
handle SIGSEGV stop nopass
handle SIGUSR1 SIGUSR2 SIGPIPE nostop noprint pass
run
while $_isvoid($_exitcode)
  return
  continue
end
";

/// The machine's serial ports, in its order: USART1, 2, 3, UART4, UART5, USART6.
const SERIAL: [Option<&str>; 6] = [Some("t7"), Some("console"), Some("isu"), None, None, Some("modbus")];

/// A running QEMU.
pub struct Qemu {
    debugger: Child,
    stop: Arc<AtomicBool>,
    part: Option<JoinHandle<()>>,
    /// What has gone wrong beside it.
    trouble: Arc<Mutex<Option<String>>>,
    /// Registers that are to be set.
    planted: Arc<Mutex<Option<(u8, u32)>>>,
    folder: PathBuf,
}

impl Qemu {
    /// Starts the image at `elf`; programs that are missing are unpacked below `place`.
    ///
    /// # Errors
    /// There is no QEMU, or it does not start.
    pub fn start(elf: &Path, place: &Path) -> Result<(Qemu, Ports), String> {
        let programs =
            Programs::get(place).map_err(|why| format!("QEMU 10 or a debugger is missing: {why}"))?;
        let folder = std::env::temp_dir().join(format!("clino-qemu-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|why| format!("{}: {why}", folder.display()))?;
        let script = folder.join("return.gdb");
        fs::write(&script, SCRIPT).map_err(|why| format!("{}: {why}", script.display()))?;
        let log = fs::File::create(folder.join("log")).map_err(|why| why.to_string())?;
        let log_too = log.try_clone().map_err(|why| why.to_string())?;
        let mut command = programs.debugged(&script, &arguments(elf, &folder));
        command.stdin(Stdio::null()).stdout(log).stderr(log_too);
        let debugger = command.spawn().map_err(|why| format!("{command:?}: {why}"))?;
        let mut qemu = Qemu {
            debugger,
            stop: Arc::default(),
            part: None,
            trouble: Arc::default(),
            planted: Arc::default(),
            folder,
        };
        let ports = qemu.ports()?;
        let guest = Guest::new(qemu.socket("guest")?)?;
        let mut part = Part::new(elf, guest, Tester::new(qemu.socket("test")?)?)?;
        let (stop, trouble) = (Arc::clone(&qemu.stop), Arc::clone(&qemu.trouble));
        let planted = Arc::clone(&qemu.planted);
        qemu.part = Some(thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                let wanted = *planted.lock().unwrap_or_else(PoisonError::into_inner);
                let done = wanted.map_or(Ok(false), |register| part.plant(&[register]));
                if done == Ok(true) {
                    *planted.lock().unwrap_or_else(PoisonError::into_inner) = None;
                }
                if let Err(why) = done.and_then(|_| part.make_up()) {
                    *trouble.lock().unwrap_or_else(PoisonError::into_inner) = Some(why);
                    return;
                }
                thread::sleep(LOOK);
            }
        }));
        Ok((qemu, ports))
    }

    /// Has a register of the core set, once the main loop executes.
    pub fn plant(&self, register: u8, value: u32) {
        *self.planted.lock().unwrap_or_else(PoisonError::into_inner) = Some((register, value));
    }

    /// What QEMU has to say when something goes wrong.
    pub fn last_words(&self) -> String {
        let log = fs::read_to_string(self.folder.join("log")).unwrap_or_default();
        let last: Vec<&str> = log.lines().rev().take(5).collect();
        let trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone();
        trouble.iter().map(String::as_str).chain(last.into_iter().rev()).collect::<Vec<_>>().join("; ")
    }

    /// Ends it.
    ///
    /// # Errors
    /// What it lacks could not be made up for.
    pub fn end(mut self) -> Result<(), String> {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.part.take().is_none_or(|part| part.join().is_ok());
        let trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner).take();
        match trouble {
            None if ended => Ok(()),
            trouble => Err(trouble.unwrap_or_else(|| "the thread beside QEMU has panicked".to_owned())),
        }
    }

    /// The pseudo-terminals that it has opened.
    fn ports(&self) -> Result<Ports, String> {
        let mut control = self.socket("control")?;
        let failed = |why: std::io::Error| format!("QEMU's monitor: {why}");
        let mut answers = BufReader::new(control.try_clone().map_err(failed)?);
        let mut answer = |command: &str| {
            control.write_all(format!("{{\"execute\":\"{command}\"}}\n").as_bytes()).map_err(failed)?;
            loop {
                let mut line = String::new();
                if answers.read_line(&mut line).map_err(failed)? == 0 {
                    return Err(format!("QEMU's monitor does not answer {command}"));
                }
                let object: Value = serde_json::from_str(&line).map_err(|why| format!("{line:?}: {why}"))?;
                if let Some(returned) = object.get("return") {
                    return Ok(returned.clone());
                }
            }
        };
        answer("qmp_capabilities")?;
        let devices = answer("query-chardev")?;
        let port = |name: &str| {
            let device = devices.as_array().into_iter().flatten().find(|device| device["label"] == name);
            let path = device.and_then(|device| device["filename"].as_str()?.strip_prefix("pty:"));
            path.map(str::to_owned).ok_or_else(|| format!("QEMU has no port {name}: {devices}"))
        };
        Ok(Ports {
            console: port("console")?,
            t7: Some(port("t7")?),
            isu: Some(port("isu")?),
            modbus: Some(port("modbus")?),
        })
    }

    /// One of its sockets, once it is there.
    fn socket(&self, name: &str) -> Result<UnixStream, String> {
        let path = self.folder.join(name);
        let deadline = Instant::now() + START;
        loop {
            match UnixStream::connect(&path) {
                Ok(stream) => return Ok(stream),
                Err(why) if Instant::now() > deadline => {
                    return Err(format!("{}: {why}; {}", path.display(), self.last_words()));
                }
                Err(_) => thread::sleep(LOOK),
            }
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        // The debugger's end is QEMU's.
        let _ = self.debugger.kill();
        let _ = self.debugger.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn arguments(elf: &Path, folder: &Path) -> Vec<String> {
    let socket = |name: &str| format!("unix:{},server=on,wait=off", folder.join(name).display());
    let mut arguments: Vec<String> = ["-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-S"]
        // 4 ns an instruction.
        .into_iter()
        .chain(["-icount", "shift=2", "-qtest-log", "/dev/null", "-kernel"])
        .map(str::to_owned)
        .collect();
    arguments.push(elf.display().to_string());
    for (option, name) in [("-qmp", "control"), ("-gdb", "guest"), ("-qtest", "test")] {
        arguments.extend([option.to_owned(), socket(name)]);
    }
    for port in SERIAL {
        match port {
            Some(name) => {
                let [device, serial] = [format!("pty,id={name}"), format!("chardev:{name}")];
                arguments.extend(["-chardev".to_owned(), device, "-serial".to_owned(), serial]);
            }
            None => arguments.extend(["-serial", "null"].map(str::to_owned)),
        }
    }
    arguments
}

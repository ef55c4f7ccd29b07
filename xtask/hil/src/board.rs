//! The board: a real one behind an ST-LINK, or the virtual one or QEMU with a pseudo-terminal for each port.

use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use defmt_decoder::Table;

use crate::arguments::Arguments;
use crate::ports::Ports;
use crate::qemu::Qemu;

/// What the virtual board has at its PWM inputs, in degrees.
pub const VIRTUAL_PWM: [f64; 2] = [89.56, 333.3];

/// A board that runs the image.
pub enum Board {
    /// Behind a probe, with the lines of its log so far; without, if it is not flashed.
    Real(Option<(Child, Arc<Mutex<Vec<String>>>)>),
    /// A process.
    Virtual(Box<VirtualBoard>),
    /// Another emulator.
    Qemu(Qemu),
}

/// The virtual board's process.
pub struct VirtualBoard {
    child: Child,
    output: BufReader<ChildStdout>,
    /// Where it writes its levels when it ends.
    capture: PathBuf,
    /// Where its log comes, as a probe reads it; the image explains it.
    log: PathBuf,
    elf: PathBuf,
    /// What it says on standard error.
    notes: PathBuf,
}

impl Board {
    /// Where the ports of the board are that these arguments name, and the virtual board or QEMU if it is one of them.
    ///
    /// # Errors
    /// It does not start.
    pub fn ports(arguments: &Arguments) -> Result<(Ports, Option<Board>), String> {
        if arguments.on_virtual_board {
            let (board, ports) = VirtualBoard::start(arguments)?;
            return Ok((ports, Some(Board::Virtual(Box::new(board)))));
        }
        if arguments.on_qemu {
            // Where the tests have theirs.
            let place = arguments.programs.join("../tmp");
            let (qemu, ports) = Qemu::start(&arguments.elf, &place)?;
            return Ok((ports, Some(Board::Qemu(qemu))));
        }
        let Arguments { console, t7, isu, modbus, .. } = arguments;
        let ports = Ports {
            console: console.clone().unwrap_or_default(),
            t7: t7.clone(),
            isu: isu.clone(),
            modbus: modbus.clone(),
        };
        Ok((ports, None))
    }

    /// Flashes a real board and starts it.
    ///
    /// # Errors
    /// The probe's program cannot be started.
    pub fn flash(elf: &Path, chip: &str) -> Result<Board, String> {
        let mut probe = Command::new("probe-rs");
        probe.args(["run", "--chip", chip]).arg(elf).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = probe.spawn().map_err(|why| {
            format!("probe-rs: {why}; `cargo install probe-rs-tools --locked` installs it, --no-flash does without it")
        })?;
        let lines = Arc::new(Mutex::new(Vec::new()));
        let streams: [Option<Box<dyn std::io::Read + Send>>; 2] = [
            child.stdout.take().map(|stream| Box::new(stream) as _),
            child.stderr.take().map(|stream| Box::new(stream) as _),
        ];
        for stream in streams.into_iter().flatten() {
            let lines = Arc::clone(&lines);
            thread::spawn(move || {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    lines.lock().unwrap_or_else(PoisonError::into_inner).push(line);
                }
            });
        }
        Ok(Board::Real(Some((child, lines))))
    }

    /// The log so far; `None` if it is not read.
    pub fn log(&self) -> Option<Result<Vec<String>, String>> {
        match self {
            Board::Virtual(board) => Some(board.log()),
            Board::Real(Some((_, lines))) => {
                Some(Ok(lines.lock().unwrap_or_else(PoisonError::into_inner).clone()))
            }
            Board::Real(None) | Board::Qemu(_) => None,
        }
    }

    /// What the virtual board or QEMU has to say when something goes wrong.
    pub fn last_words(&self) -> String {
        match self {
            Board::Virtual(board) => {
                let notes = fs::read_to_string(&board.notes).unwrap_or_default();
                format!("; the virtual board: {}", notes.replace('\n', "; "))
            }
            Board::Qemu(qemu) => format!("; QEMU: {}", qemu.last_words()),
            Board::Real(_) => String::new(),
        }
    }

    /// Ends the virtual board or QEMU; the levels of all lines of the virtual board since power-up. A real board goes on.
    ///
    /// # Errors
    /// It does not end as it should.
    pub fn end(self) -> Result<Option<PathBuf>, String> {
        match self {
            Board::Virtual(board) => board.end().map(Some),
            Board::Qemu(qemu) => qemu.end().map(|()| None),
            Board::Real(probe) => {
                if let Some((mut child, _)) = probe {
                    // The board goes on without its probe.
                    let _ = child.kill();
                    let _ = child.wait();
                }
                Ok(None)
            }
        }
    }
}

impl VirtualBoard {
    fn start(arguments: &Arguments) -> Result<(VirtualBoard, Ports), String> {
        let folder = std::env::temp_dir().join(format!("clino-hil-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|why| format!("{}: {why}", folder.display()))?;
        let [scenario, capture, log, notes] =
            ["scenario.toml", "board.vcd", "log", "notes"].map(|name| folder.join(name));
        let [pwm1, pwm2] = VIRTUAL_PWM;
        let faults = arguments.scenario.as_deref().map_or(Ok(String::new()), fs::read_to_string);
        let faults = faults.map_err(|why| format!("the scenario: {why}"))?;
        let pwm = format!(
            "{faults}\n[[pwm]]\nchannel = 1\nmotion.constant = {pwm1}\n[[pwm]]\nchannel = 2\nmotion.constant = {pwm2}\n"
        );
        fs::write(&scenario, pwm).map_err(|why| format!("{}: {why}", scenario.display()))?;
        let complaints = File::create(&notes).map_err(|why| format!("{}: {why}", notes.display()))?;
        let program = arguments.programs.join("vboard");
        let failed = |why: std::io::Error| format!("{}: {why}", program.display());
        let mut command = Command::new(&program);
        command
            .arg("--elf")
            .arg(&arguments.elf)
            .args(["--board", &arguments.board])
            .arg("--scenario")
            .arg(&scenario)
            .arg("--vcd")
            .arg(&capture)
            .arg("--rtt")
            .arg(&log);
        command.args(["--realtime", "--console-pty", "--modbus-pty", "--t7-pty", "--isu-pty"]);
        let mut child = command.stdout(Stdio::piped()).stderr(complaints).spawn().map_err(failed)?;
        let output = child.stdout.take().ok_or_else(|| format!("{}: no output", program.display()))?;
        let mut board = VirtualBoard {
            child,
            output: BufReader::new(output),
            capture,
            log,
            elf: arguments.elf.clone(),
            notes,
        };
        let mut port = |name: &str| {
            let mut line = String::new();
            board.output.read_line(&mut line).map_err(failed)?;
            let path = line.trim().strip_prefix(name).map(|path| path.trim().to_owned());
            path.ok_or_else(|| format!("{}: {line:?} instead of `{name} PATH`", program.display()))
        };
        let ports = Ports {
            console: port("console")?,
            modbus: Some(port("modbus")?),
            t7: Some(port("t7")?),
            isu: Some(port("isu")?),
        };
        Ok((board, ports))
    }

    /// What probe-rs does with the log of a real board.
    fn log(&self) -> Result<Vec<String>, String> {
        let read = |path: &Path| fs::read(path).map_err(|why| format!("{}: {why}", path.display()));
        let table = Table::parse(&read(&self.elf)?).map_err(|why| why.to_string())?;
        let table = table.ok_or_else(|| format!("{}: an image without a log", self.elf.display()))?;
        let mut decoder = table.new_stream_decoder();
        decoder.received(&read(&self.log)?);
        let mut lines = Vec::new();
        while let Ok(frame) = decoder.decode() {
            lines.push(frame.display(false).to_string());
        }
        Ok(lines)
    }

    fn end(mut self) -> Result<PathBuf, String> {
        // Ctrl-C, as a person ends it.
        let id = self.child.id().to_string();
        let told = Command::new("kill").args(["-INT", &id]).status().map_err(|why| format!("kill: {why}"))?;
        if !told.success() {
            return Err("the virtual board had ended before".to_owned());
        }
        // Its summary is of no use here: it knows other sensors, and takes each reboot for a crash.
        let mut summary = String::new();
        self.output.read_to_string(&mut summary).map_err(|why| why.to_string())?;
        self.child.wait().map_err(|why| why.to_string())?;
        Ok(self.capture.clone())
    }
}

impl Drop for VirtualBoard {
    fn drop(&mut self) {
        // After `end` no process is left to kill.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

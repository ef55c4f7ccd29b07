//! Simulated sensors behind an adapter: `clino sim`, and a thread between its terminal and the adapter's port.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use serial2::Parity;

use crate::port::Port;

/// How long one side is waited for before the other has its turn: an answer is due within milliseconds.
const TURN: Duration = Duration::from_micros(500);

/// Sensors that answer until they are dropped.
pub struct Sensors {
    child: Child,
    stop: Arc<AtomicBool>,
    between: Option<JoinHandle<()>>,
}

impl Sensors {
    /// Starts them behind the adapter at this port. `sensors` are arguments of `clino sim`.
    ///
    /// # Errors
    /// The program's, or the port's.
    pub fn serve(programs: &Path, sensors: &[String], port: &str, baud: u32) -> Result<Sensors, String> {
        let program = programs.join("clino");
        let failed = |why: std::io::Error| format!("{}: {why}", program.display());
        let mut command = Command::new(&program);
        command.arg("sim").args(sensors).arg("--pty");
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().map_err(failed)?;
        let mut path = String::new();
        if let Some(output) = child.stdout.take() {
            BufReader::new(output).read_line(&mut path).map_err(failed)?;
        }
        let mut sensors = Sensors { child, stop: Arc::default(), between: None };
        let terminal = Port::open(path.trim(), baud, Parity::None)?;
        let adapter = Port::open(port, baud, Parity::None)?;
        let stop = Arc::clone(&sensors.stop);
        sensors.between = Some(thread::spawn(move || copy(&terminal, &adapter, &stop)));
        Ok(sensors)
    }
}

/// Passes what comes to the other side, until it is told to stop or a side is gone.
fn copy(terminal: &Port, adapter: &Port, stop: &AtomicBool) {
    let pass = |from: &Port, to: &Port| {
        let bytes = from.receive(TURN)?;
        if bytes.is_empty() { Ok(()) } else { to.send(&bytes) }
    };
    while !stop.load(Ordering::Relaxed) {
        if pass(adapter, terminal).and_then(|()| pass(terminal, adapter)).is_err() {
            return;
        }
    }
}

impl Drop for Sensors {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        // It holds nothing that has to be put in order.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(between) = self.between.take() {
            let _ = between.join();
        }
    }
}

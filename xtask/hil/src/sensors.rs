//! Simulated sensors behind an adapter: `clino sim --port`.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Sensors that answer until they are dropped.
pub struct Sensors(Child);

impl Sensors {
    /// Starts them behind the adapter at this port; they listen when this returns. `sensors` are arguments of `clino sim`, the
    /// first one has the port's bit rate.
    ///
    /// # Errors
    /// The program's words: what is wrong with the port.
    pub fn serve(programs: &Path, sensors: &[String], port: &str) -> Result<Sensors, String> {
        let program = programs.join("clino");
        let failed = |why: std::io::Error| format!("{}: {why}", program.display());
        let mut command = Command::new(&program);
        command.arg("sim").args(sensors).args(["--port", port]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut sensors = Sensors(command.spawn().map_err(failed)?);
        let mut listens = String::new();
        if let Some(output) = sensors.0.stdout.take() {
            BufReader::new(output).read_line(&mut listens).map_err(failed)?;
        }
        if listens.is_empty() {
            let mut said = String::new();
            if let Some(mut errors) = sensors.0.stderr.take() {
                errors.read_to_string(&mut said).map_err(failed)?;
            }
            return Err(said.split_whitespace().collect::<Vec<_>>().join(" "));
        }
        Ok(sensors)
    }
}

impl Drop for Sensors {
    fn drop(&mut self) {
        // It holds nothing that has to be put in order.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

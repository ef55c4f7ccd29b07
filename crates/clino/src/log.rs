//! `clino log`: readings as rows of a file.
//!
//! ```text
//! time,kind,address,axis,raw,angle_deg,status,age_ms
//! 2026-11-29T21:52:19.123456Z,t7,5,2,12345,12.345,ok,0
//! 2026-11-29T21:52:19.224001Z,t7,6,2,,,no_answer,
//! ```
//! | column | |
//! |---|---|
//! | `time` | UTC. With a value: of its reception, which is the time of the row minus `age_ms`; else of the row |
//! | `raw` | as the sensor says it: 0.001° (T7), 360/65536° (ISU) |
//! | `angle_deg`, `raw`, `age_ms` | empty, `null` in JSON, where there is no value |
//! | `status` | the words of the gateway; or what is wrong with the port |
//!
//! A value is received up to the latency of the port later than it was on the pair. Rows are written at once when a reading
//! ends; with `--every` at fixed times, each with the last value, whose age then counts.

mod file;
mod row;

use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant, SystemTime};

use clap::Args;

use crate::bus::Stop;
use crate::feed::News;
use crate::number::within;
use crate::outcome::{DecodeVerdict, Failure};
use crate::sensors::{Sensor, Sensors};
use crate::session::port_failed;
use file::{File, Rotation};
use row::{Form, Row};

/// A row is on the disk after this, and survives a power failure.
const SYNC: Duration = Duration::from_secs(1);
/// A row is the system's after this, and survives the end of this program.
const HAND_OVER: Duration = Duration::from_millis(250);
/// Longest time between two rows of a sensor.
const MAX_EVERY_MS: u64 = 86_400_000;
/// With `--every`: a value that is older than this many periods is stale, as at the gateway.
const STALE_PERIODS: u32 = 3;
/// The least age at which a value is stale: a busy computer is no reason.
const STALE_LEAST: Duration = Duration::from_millis(500);

/// `clino log`
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    sensors: Sensors,
    /// Append rows of comma-separated values to this file
    #[arg(long, value_name = "FILE", required_unless_present = "jsonl", conflicts_with = "jsonl")]
    csv: Option<PathBuf>,
    /// Append JSON objects, one a line, to this file
    #[arg(long, value_name = "FILE")]
    jsonl: Option<PathBuf>,
    /// Write the last value of each sensor at this interval, in ms, instead of every reading
    #[arg(long, value_name = "MS", value_parser = every)]
    every: Option<u64>,
    /// Begin a new file each `day` (UTC), or when it has this size: 500k, 10M, 1G
    #[arg(long, value_name = "day|SIZE", value_parser = file::rotation, default_value = "never")]
    rotate: Rotation,
}

/// The last that is known of a sensor.
struct Last {
    /// Its last value, and when it was received.
    value: Option<(crate::poll::Measured, Instant)>,
    status: &'static str,
}

/// Logs until Ctrl-C.
pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    let Arguments { sensors, csv, jsonl, every, rotate } = arguments;
    let (form, path) = match (csv, jsonl) {
        (Some(path), _) => (Form::Csv, path),
        (None, path) => (Form::Jsonl, path.unwrap_or_default()),
    };
    let stop = Stop::on_signals()?;
    // The file first: a sensor is asked for what can be kept.
    let mut file = match File::open(&path, form, rotate) {
        Ok(file) => file,
        Err(error) => {
            let next = "name another file, or free some space";
            sensors.port.say().failure("file", &format!("{}: {error}", path.display()), next)?;
            return Err(Failure::PORT);
        }
    };
    if file.cut() > 0 {
        let why = format!("{} characters of an interrupted row were cut off", file.cut());
        sensors.port.say().hint("cut", &why)?;
    }
    let (named, feed) = sensors.start(&stop)?;
    let mut lasts: Vec<Last> = named.iter().map(|_| Last { value: None, status: "never_read" }).collect();
    let interval = every.map(Duration::from_millis);
    let mut tick = interval.map(|interval| Instant::now() + interval);
    let (mut sync, mut hand_over) = (Instant::now() + SYNC, Instant::now() + HAND_OVER);
    let mut was_open = false;
    loop {
        let until = tick.map_or(hand_over, |tick| tick.min(hand_over)).min(sync);
        match feed.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(News::Open) => was_open = true,
            Ok(News::Lost(error)) => {
                if !was_open {
                    return Err(port_failed(&mut sensors.port.say(), &error)?);
                }
                for (sensor, last) in named.iter().zip(&mut lasts) {
                    // The loss of the port is told once; the attempts that follow are not.
                    if last.status != error.kind() && interval.is_none() {
                        file.write(&Row::without(SystemTime::now(), sensor, error.kind()))?;
                    }
                    *last = Last { value: None, status: error.kind() };
                }
            }
            Ok(News::Reading { sensor, at, utc, result }) => {
                let (Some(named), Some(last)) = (named.get(sensor), lasts.get_mut(sensor)) else { continue };
                match result {
                    Ok(measured) => {
                        *last = Last { value: Some((measured, at)), status: "ok" };
                        if interval.is_none() {
                            file.write(&Row::with(utc, at.elapsed(), named, measured, "ok"))?;
                        }
                    }
                    Err(status) => {
                        last.status = status.name();
                        if interval.is_none() {
                            file.write(&Row::without(utc, named, status.name()))?;
                        }
                    }
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let now = Instant::now();
        if let (Some(at), Some(interval)) = (tick, interval)
            && at <= now
        {
            let stale = STALE_LEAST.max(Duration::from_millis(sensors.period_ms().into()) * STALE_PERIODS);
            for (sensor, last) in named.iter().zip(&lasts) {
                file.write(&last.row(sensor, now, stale))?;
            }
            // In step; what was missed, while the computer slept, is not made up for.
            tick = Some(if at + interval > now { at + interval } else { now + interval });
        }
        if sync <= now {
            file.sync()?;
            (sync, hand_over) = (now + SYNC, now + HAND_OVER);
        } else if hand_over <= now {
            file.hand_over()?;
            hand_over = now + HAND_OVER;
        }
    }
    file.sync()?;
    Ok(DecodeVerdict::Good)
}

impl Last {
    fn row(&self, sensor: &Sensor, now: Instant, stale: Duration) -> Row {
        let utc = SystemTime::now();
        match self.value {
            Some((measured, at)) if self.status == "ok" => {
                let age = now.saturating_duration_since(at);
                if age <= stale {
                    Row::with(utc - age, age, sensor, measured, "ok")
                } else {
                    Row::without(utc, sensor, "stale")
                }
            }
            _ => Row::without(utc, sensor, self.status),
        }
    }
}

fn every(text: &str) -> Result<u64, String> {
    within(text, 1..=MAX_EVERY_MS)
}

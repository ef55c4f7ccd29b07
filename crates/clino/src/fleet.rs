//! `clino serve` and `clino bridge`: gateways seen from afar. What they do is in the crate `clino-fleet`; here are their
//! arguments, and the bus master that it reads a bus with.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use clap::Args;
use clino_bus::line::EchoMode;
use clino_codec::angle::Angle;
use clino_codec::t7::Axis;
use clino_fleet::config::{Bus, Config, Endpoint, Make, Modbus, ModbusEndpoint, Name, Secret, Source};
use clino_fleet::source::{BusReading, Feed, ReadBus};
use clino_gateway::Status;

use crate::bus::Stop;
use crate::feed::News;
use crate::outcome::{DecodeVerdict, Failure};
use crate::sensors::{Kind, Sensors};
use crate::session::PortOptions;

/// `clino serve`
#[derive(Args, Clone, Debug)]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub struct ServeArguments {
    /// A gateway's console: a serial port, a pseudo-terminal, or tcp://host:port
    #[arg(long, value_name = "PORT", group = "what", value_parser = parsed::<Endpoint>)]
    port: Option<Endpoint>,
    /// A gateway's Modbus port: a serial port, tcp://host:port (Modbus/TCP), or rtu+tcp://host:port
    #[arg(long, value_name = "PORT", group = "what", value_parser = parsed::<ModbusEndpoint>)]
    modbus: Option<ModbusEndpoint>,
    /// Many gateways, by a configuration file
    #[arg(long, value_name = "FILE", group = "what")]
    config: Option<PathBuf>,
    /// Address at which the page is
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Let the page zero, scan and acknowledge
    #[arg(long)]
    allow_writes: bool,
    /// File with the token that readers have to show; needed beyond loopback
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
}

/// `clino bridge`
#[derive(Args, Clone, Debug)]
pub struct BridgeArguments {
    /// The configuration file; `docs/bridge.example.toml` is one
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
}

/// How often the page reads a Modbus port.
const MODBUS_EVERY: Duration = Duration::from_millis(500);

fn parsed<T: TryFrom<String, Error = String>>(text: &str) -> Result<T, String> {
    T::try_from(text.to_owned())
}

/// Shows the live page.
pub fn serve(arguments: ServeArguments) -> Result<DecodeVerdict, Failure> {
    let name = || Name::try_from("gateway".to_owned()).map_err(Failure::Usage);
    let mut config = match (arguments.port, arguments.modbus, arguments.config) {
        (Some(port), ..) => Config::of_one(Source::Console(port), name()?),
        (_, Some(port), _) => {
            let modbus = Modbus { every: MODBUS_EVERY, ..Modbus::at(port) };
            Config::of_one(Source::Modbus(modbus), name()?)
        }
        (.., file) => Config::read(&file.unwrap_or_default()).map_err(Failure::Usage)?,
    };
    if let Some(listen) = arguments.listen {
        config.serve.listen = listen;
    }
    if let Some(file) = arguments.token_file {
        config.serve.token = Some(Secret::File(file));
    }
    config.serve.allow_writes |= arguments.allow_writes;
    run(clino_fleet::serve(config, read_bus()))
}

/// Feeds a broker, Prometheus and InfluxDB.
pub fn bridge(arguments: &BridgeArguments) -> Result<DecodeVerdict, Failure> {
    let config = Config::read(&arguments.config).map_err(Failure::Usage)?;
    run(clino_fleet::bridge(config, read_bus()))
}

fn run(work: impl Future<Output = Result<(), String>>) -> Result<DecodeVerdict, Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let ended = runtime.block_on(work);
    // What still reads a bus on a thread of its own is left to the end of the process.
    runtime.shutdown_background();
    ended.map_err(Failure::Usage)?;
    Ok(DecodeVerdict::Good)
}

/// Reads a bus with the master of `clino watch`.
fn read_bus() -> ReadBus {
    Arc::new(read)
}

/// A look at whether the program ends.
const LOOK: Duration = Duration::from_millis(200);

fn read(bus: &Bus, feed: &Feed) -> Result<(), String> {
    let stop = Stop::on_signals().map_err(|why| why.to_string())?;
    let (named, readings) = sensors(bus)?.start(&stop).map_err(|_| "it cannot be read")?;
    let mut known = vec![(None, 0_u32); named.len()];
    while !feed.is_over() {
        match readings.recv_timeout(LOOK) {
            Ok(News::Open) => feed.speaks(),
            Ok(News::Lost(error)) => return Err(error.message()),
            Ok(News::Reading { sensor, at, result, .. }) => {
                let (Some(one), Some((measured, outcome))) = (named.get(sensor), known.get_mut(sensor))
                else {
                    continue;
                };
                *outcome = outcome.wrapping_add(1);
                if result.is_ok() {
                    *measured = Some(at);
                }
                let reading = BusReading {
                    slot: u16::try_from(sensor).unwrap_or(u16::MAX),
                    address: one.address,
                    status: result.map_or_else(Status::name, |_| Status::Ok.name()),
                    angle: result.ok().and_then(|measured| Angle::from_mdeg(measured.mdeg)),
                    measured: *measured,
                    outcome: *outcome,
                };
                feed.reading(bus.make, &reading);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err("its reader has ended".to_owned()),
        }
    }
    Ok(())
}

/// The bus as `clino watch` names it.
fn sensors(bus: &Bus) -> Result<Sensors, String> {
    let baud = match bus.make {
        Make::T7 => Some(crate::t7::baud(&bus.baud.to_string())?),
        Make::Isu => None,
    };
    Ok(Sensors {
        kind: if bus.make == Make::T7 { Kind::T7 } else { Kind::Isu },
        addresses: bus.addresses.clone(),
        axis: Axis::Two,
        period: None,
        baud,
        port: PortOptions {
            port: bus.port.parse().map_err(|why| format!("{}: {why}", bus.port))?,
            latency: None,
            echo: EchoMode::Detect,
            rts_de: false,
            rs485: false,
            json: false,
        },
    })
}

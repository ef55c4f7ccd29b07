//! `clino serve` and `clino bridge`: gateways seen from afar. What they do is in the crate `clino-fleet`; here are their
//! arguments, and the bus master that it reads a bus with.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use clino_fleet::config::{Config, Endpoint, Modbus, ModbusEndpoint, Name, Parity, Secret, Source};
use clino_fleet::source::ReadBus;

use crate::outcome::{DecodeVerdict, Failure};

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

/// Address and rate of a gateway's Modbus port as delivered, and how often the page reads it.
const MODBUS_UNIT: u8 = 1;
const MODBUS_BAUD: u32 = 19_200;
const MODBUS_EVERY: std::time::Duration = std::time::Duration::from_millis(500);

fn parsed<T: TryFrom<String, Error = String>>(text: &str) -> Result<T, String> {
    T::try_from(text.to_owned())
}

/// Shows the live page.
pub fn serve(arguments: ServeArguments) -> Result<DecodeVerdict, Failure> {
    let name = || Name::try_from("gateway".to_owned()).map_err(Failure::Usage);
    let mut config = match (arguments.port, arguments.modbus, arguments.config) {
        (Some(port), ..) => Config::of_one(Source::Console(port), name()?),
        (_, Some(port), _) => {
            let modbus =
                Modbus { port, unit: MODBUS_UNIT, baud: MODBUS_BAUD, parity: Parity::Even, every: MODBUS_EVERY };
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

/// Reads a bus with the master of `clino t7` and `clino isu`.
fn read_bus() -> ReadBus {
    Arc::new(|_, _| Err("not yet".to_owned()))
}

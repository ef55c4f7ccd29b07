//! `clino t7 VERB … --port PORT`: the words of the gateway's console.

use clap::{Args, Subcommand, ValueEnum};
use clino_codec::angle::Range;
use clino_codec::t7::{Address, Axis, BaudRate, Direction, Millidegrees};

use super::typed;
use crate::number::within;
use crate::session::{Consent, PortOptions};

/// What can be done with T7s on a bus.
#[derive(Subcommand)]
pub enum Verb {
    /// Find T7s: every address at the port's bit rate, or at all five
    Scan(Scan),
    /// What a sensor is and how it is set
    Info(One),
    /// The angle of one axis
    Angle(OneAxis),
    /// Everything a sensor measures: angles, accelerations, temperature
    All(One),
    /// An axis reads zero as it stands; writes to the sensor
    Zero(Zero),
    /// The offset of an axis, in 0.001 degrees; writes to the sensor
    #[command(allow_negative_numbers = true)]
    Offset(Offset),
    /// The counting direction of an axis; writes to the sensor
    Direction(SetDirection),
    /// The averaging time, in ms; writes to the sensor
    Damping(Damping),
    /// The output range; writes to the sensor
    Range(SetRange),
    /// The bit rate; writes to the sensor
    Baud(Baud),
    /// The address; writes to the sensor
    Address(SetAddress),
}

/// The bus.
#[derive(Args, Clone)]
pub struct BusOptions {
    #[command(flatten)]
    pub port: PortOptions,
    /// Bit rate of the bus: 115200, 57600, 38400, 19200, or 9600
    #[arg(long = "baud", id = "bus_baud", value_name = "RATE", value_parser = typed::baud, default_value = "115200")]
    pub baud: BaudRate,
}

/// Where to look.
#[derive(Args)]
pub struct Scan {
    /// At all five bit rates
    #[arg(value_enum)]
    pub all: Option<All>,
    #[command(flatten)]
    pub bus: BusOptions,
}

/// The word `all`.
#[derive(Clone, Copy, ValueEnum)]
pub enum All {
    All,
}

/// One sensor.
#[derive(Args)]
pub struct One {
    /// Address of the sensor: 1-100 or 127
    #[arg(value_name = "A", value_parser = address)]
    pub address: Address,
    #[command(flatten)]
    pub bus: BusOptions,
}

/// One axis of a sensor.
#[derive(Args)]
pub struct OneAxis {
    #[command(flatten)]
    pub one: One,
    /// 0, 1, or 2; the axis of a T7-1 is 2
    #[arg(long, short, value_parser = typed::axis, default_value = "2")]
    pub axis: Axis,
}

/// `zero A`
#[derive(Args)]
pub struct Zero {
    #[command(flatten)]
    pub sensor: OneAxis,
    #[command(flatten)]
    pub consent: Consent,
}

/// `offset A MDEG`
#[derive(Args)]
pub struct Offset {
    #[command(flatten)]
    pub sensor: OneAxis,
    /// -180000..=359999, within the output range of the sensor
    #[arg(value_name = "MDEG", value_parser = typed::millidegrees)]
    pub offset: Millidegrees,
    #[command(flatten)]
    pub consent: Consent,
}

/// `direction A normal|reversed`
#[derive(Args)]
pub struct SetDirection {
    #[command(flatten)]
    pub sensor: OneAxis,
    /// normal or reversed
    #[arg(value_parser = typed::direction)]
    pub direction: Direction,
    #[command(flatten)]
    pub consent: Consent,
}

/// `damping A MS`
#[derive(Args)]
pub struct Damping {
    #[command(flatten)]
    pub one: One,
    /// 2..=5000
    #[arg(value_name = "MS", value_parser = typed::damping_ms)]
    pub damping_ms: u16,
    #[command(flatten)]
    pub consent: Consent,
}

/// `range A bidirectional|unidirectional`
#[derive(Args)]
pub struct SetRange {
    #[command(flatten)]
    pub one: One,
    /// bidirectional (-180 to 180 degrees) or unidirectional (0 to 360)
    #[arg(value_parser = typed::range)]
    pub range: Range,
    #[command(flatten)]
    pub consent: Consent,
}

/// `baud A RATE`
#[derive(Args)]
pub struct Baud {
    #[command(flatten)]
    pub one: One,
    /// Bit rate for the sensor: 115200, 57600, 38400, 19200, or 9600
    #[arg(value_name = "RATE", value_parser = typed::baud)]
    pub rate: BaudRate,
    #[command(flatten)]
    pub consent: Consent,
}

/// `address A NEW`
#[derive(Args)]
pub struct SetAddress {
    #[command(flatten)]
    pub one: One,
    /// Address for the sensor to take: 1-100
    #[arg(value_name = "NEW", value_parser = typed::new_address)]
    pub new: Address,
    #[command(flatten)]
    pub consent: Consent,
}

fn address(text: &str) -> Result<Address, String> {
    within(text, u8::MIN..=u8::MAX)
        .ok()
        .and_then(Address::new)
        .filter(|address| !address.is_all())
        .ok_or_else(|| "not 1 to 100 or 127".to_owned())
}

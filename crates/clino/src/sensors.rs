//! Which sensors `watch` and `log` read: those that are named, or all that are found.

use clap::{Args, ValueEnum};
use clino_bus::{Duration, Isu, Serial, T7};
use clino_codec::isu::Address as IsuAddress;
use clino_codec::isu::Request as IsuRequest;
use clino_codec::t7::{Address, Axis, BaudRate, Request};
use clino_commissioning::t7::{Found, Rates, Sweep};
use std::sync::mpsc::Receiver;

use crate::bus::Stop;
use crate::feed::{self, Line, News};
use crate::isu::Hunt;
use crate::number::within;
use crate::outcome::Failure;
use crate::poll::Question;
use crate::session::{Collector, PortOptions, port_failed};
use crate::t7;

/// Period of a T7 in ms: ten angles a second.
const T7_PERIOD_MS: u32 = 100;
/// Period of an ISU in ms: twice in each of its own, as the gateway has it.
const ISU_PERIOD_MS: u32 = 266;
/// Longest period in ms.
const MAX_PERIOD_MS: u32 = 1_200_000;

/// Kind of the sensors on a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    T7,
    Isu,
}

impl Kind {
    /// As the console has it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::T7 => "t7",
            Self::Isu => "isu",
        }
    }
}

/// Which sensors on which port.
#[derive(Args, Clone)]
pub struct Sensors {
    /// What is on the bus
    #[arg(value_name = "t7|isu", hide_possible_values = true)]
    pub kind: Kind,
    /// Addresses of the sensors; all that are found if none is given
    #[arg(value_name = "A", value_parser = address)]
    pub addresses: Vec<u8>,
    /// Axis of a T7: 0, 1, or 2, which is that of a T7-1
    #[arg(long, short, value_parser = t7::axis, default_value = "2")]
    pub axis: Axis,
    /// Time from one reading of a sensor to the next, in ms; 0: as often as the bus allows; T7: 100, ISU: 266 if nothing is said
    #[arg(long, value_name = "MS", value_parser = period)]
    pub period: Option<u32>,
    /// Bit rate of a T7 bus
    #[arg(long = "baud", id = "sensors_baud", value_name = "RATE", value_parser = t7::baud)]
    pub baud: Option<BaudRate>,
    #[command(flatten)]
    pub port: PortOptions,
}

/// A sensor that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor {
    pub kind: Kind,
    pub address: u8,
    /// Of a T7.
    pub axis: Option<u8>,
}

impl Sensor {
    /// As a person names it.
    pub fn name(&self) -> String {
        match self.axis {
            Some(axis) if axis != Axis::Two.get() => {
                format!("{} {} axis {axis}", self.kind.name(), self.address)
            }
            _ => format!("{} {}", self.kind.name(), self.address),
        }
    }
}

impl Sensors {
    /// How often a sensor is read.
    pub fn period_ms(&self) -> u32 {
        self.period.unwrap_or(match self.kind {
            Kind::T7 => T7_PERIOD_MS,
            Kind::Isu => ISU_PERIOD_MS,
        })
    }

    /// The sensors, and their readings. Without addresses they are looked for.
    ///
    /// # Errors
    /// Bad usage; the port cannot be used; none is there.
    pub fn start(&self, stop: &Stop) -> Result<(Vec<Sensor>, Receiver<News>), Failure> {
        let period = Duration::from_millis(self.period_ms());
        match self.kind {
            Kind::T7 => {
                let baud = self.baud.unwrap_or(BaudRate::B115200);
                let line = Line::t7(self.port.clone(), Serial { baud: baud.bits_per_second() });
                let named = self.addresses.iter().map(|&address| {
                    Address::new(address)
                        .filter(|address| !address.is_all())
                        .ok_or("a T7 has address 1-100 or 127")
                });
                let mut addresses = named.collect::<Result<Vec<_>, _>>().map_err(usage)?;
                if addresses.is_empty() {
                    let found =
                        self.find::<T7, _>(&line, Sweep::new(line.serial, Rates::NONE.and(baud)), stop)?;
                    addresses = found
                        .into_iter()
                        .filter_map(|found| match found {
                            Found::Device { address, .. } => Some(address),
                            Found::Suspect { .. } => None,
                        })
                        .collect();
                }
                let sensors = addresses.iter().map(|address| self.sensor(address.get())).collect();
                let questions = addresses
                    .iter()
                    .map(|&address| Question { address, request: Request::GetAngle(self.axis) });
                self.is_there(&addresses)?;
                Ok((sensors, feed::start::<T7>(line, questions.collect(), period, stop.clone())))
            }
            Kind::Isu => {
                if self.baud.is_some() {
                    return Err(usage("an ISU bus has 9600 bit/s: leave --baud out"));
                }
                let line = Line::isu(self.port.clone());
                let named = self.addresses.iter().map(|&address| {
                    IsuAddress::new(address)
                        .filter(|_| (1..=14).contains(&address))
                        .ok_or("an ISU has address 1-14")
                });
                let mut addresses = named.collect::<Result<Vec<_>, _>>().map_err(usage)?;
                if addresses.is_empty() {
                    let found = self.find::<Isu, _>(&line, Hunt::new(), stop)?;
                    addresses = found.into_iter().map(|found| found.address).collect();
                }
                let sensors = addresses.iter().map(|address| self.sensor(address.get())).collect();
                let questions =
                    addresses.iter().map(|&address| Question { address, request: IsuRequest::READ_ANGLE });
                self.is_there(&addresses)?;
                Ok((sensors, feed::start::<Isu>(line, questions.collect(), period, stop.clone())))
            }
        }
    }

    fn sensor(&self, address: u8) -> Sensor {
        let axis = (self.kind == Kind::T7).then_some(self.axis.get());
        Sensor { kind: self.kind, address, axis }
    }

    fn find<P, O>(&self, line: &Line, operation: O, stop: &Stop) -> Result<Vec<O::Event>, Failure>
    where
        P: crate::poll::Measures,
        O: clino_commissioning::Operation<Protocol = P>,
    {
        let mut say = self.port.say();
        let mut collector = Collector::new(&mut say);
        let ran = line
            .open::<P>()
            .map_err(crate::bus::Broken::Port)
            .and_then(|mut bus| bus.run(operation, stop, &mut collector));
        match ran {
            Ok(_) => Ok(collector.into_found()),
            Err(crate::bus::Broken::Port(error)) => Err(port_failed(&mut self.port.say(), &error)?),
            Err(crate::bus::Broken::Output(error)) => Err(error.into()),
        }
    }

    fn is_there<T>(&self, addresses: &[T]) -> Result<(), Failure> {
        if !addresses.is_empty() {
            return Ok(());
        }
        let kind = self.kind.name();
        let next = format!("clino {kind} scan --port {} says why", self.port.port);
        self.port.say().failure("no_sensor", "no sensor answers", &next)?;
        Err(Failure::Reported(1))
    }
}

fn usage(why: &str) -> Failure {
    Failure::Usage(why.to_owned())
}

fn address(text: &str) -> Result<u8, String> {
    within(text, u8::MIN..=u8::MAX)
}

fn period(text: &str) -> Result<u32, String> {
    within(text, 0..=MAX_PERIOD_MS)
}

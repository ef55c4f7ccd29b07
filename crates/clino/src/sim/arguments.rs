//! `clino sim …`

use clap::Args;
use clino_segment::Probability;

use super::isu::Isu;
use super::t7::T7;
use crate::port::PortName;

/// Most T7s on a bus. Source: T7 guide §1.
const MOST_T7S: usize = 32;
/// Most ISUs on a bus. Source: AN #201 §4.
const MOST_ISUS: usize = 14;

const SENSORS: &str = "\
With --pty the path of each bus's terminal is printed on a line of its own: the T7 bus
first, then the ISU bus. Open it like a serial port, as often as you like. With --port the
sensors answer on a real pair, at the bit rate of the first one; the path is printed when
they listen. SIGINT or SIGTERM ends it.

A sensor is an address, and what is to be different from the usual, with commas between:
  --t7 5,angle=12.5,baud=9600  --isu 3,angle=ramp:0:10

Keys of both:
  angle=DEGREES                  it stands still; 0 if nothing is said
  angle=ramp:START:RATE          degrees, degrees per second
  angle=sine:CENTRE:AMPLITUDE:PERIOD    degrees, degrees, time
  latency=TIME, TIME..TIME       command to answer, fixed or any time between
                                 (T7 Get commands: 2ms, at most that; ISU: 5ms)
  fault=KIND/N                   befalls every Nth answer: bad-checksum, silent,
                                 late:TIME, truncated:BYTES

Keys of a T7:
  angle0= angle1= angle2=        angle of one axis
  model=t7-1|t7-3                t7-1
  serial=NUMBER                  1001 for the first, 1002 for the second, ...
  baud=115200|57600|38400|19200|9600    115200
  damping=MS                     2..=5000; angles are means over that time
  range=bidirectional|unidirectional    bidirectional
  set-latency=TIME, TIME..TIME   as latency, for Set commands: 25ms, at most that
  length-quirk                   answers Get All Angles as in the guide's example
  flash=fails|erase-fails|program-fails     Set commands store nothing: status 5, 7, 8

Keys of an ISU:
  ascii                          RX is held low: it prints a line every 533 ms, and
                                 hears nothing; it needs the bus for itself
  hard-error                     its EEPROM has a wrong checksum, to be repaired

TIME is a number with a unit: s, ms or us. Two sensors at one address are welcome: they
talk over each other. Settings last until the program ends.";

/// Which sensors there are, and how they are served.
#[derive(Args)]
#[command(after_help = SENSORS)]
pub struct Arguments {
    /// A T7 on the T7 bus: address 1-100 or 127; once for each
    #[arg(long, value_name = "ADDRESS[,KEY=VALUE]", value_parser = T7::parse, required_unless_present = "isu")]
    pub t7: Vec<T7>,
    /// An ISU on the ISU bus: address 1-14; once for each
    #[arg(long, value_name = "ADDRESS[,KEY=VALUE]", value_parser = Isu::parse)]
    pub isu: Vec<Isu>,
    /// Serve each bus on a pseudo-terminal
    #[arg(long, required_unless_present = "port", conflicts_with = "port")]
    pub pty: bool,
    /// Serve the one bus that there is on this port: an adapter on a real pair, or tcp://host:port
    #[arg(long, value_name = "PORT")]
    pub port: Option<PortName>,
    /// With --port: RTS switches the driver of the transceiver
    #[arg(long, conflicts_with_all = ["rs485", "pty"])]
    pub rts_de: bool,
    /// With --port: the kernel's RS485 mode switches the driver
    #[arg(long, conflicts_with = "pty")]
    pub rs485: bool,
    /// The program hears what it sends, as with an adapter whose receiver is always on
    #[arg(long, conflicts_with = "port")]
    pub echo: bool,
    /// Probability that a bit is received inverted, 0..=1
    #[arg(long, value_name = "P", value_parser = probability, default_value = "0")]
    pub bit_error_rate: Probability,
    /// Seed of all random decisions: jitter, bit errors, the winner of a collision
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Print the frames of the buses on standard error
    #[arg(long, short)]
    pub verbose: bool,
}

impl Arguments {
    /// Whether the sensors can be together.
    ///
    /// # Errors
    /// The limit.
    pub fn check(&self) -> Result<(), String> {
        if self.t7.len() > MOST_T7S {
            return Err(format!("{} times --t7: a bus has at most {MOST_T7S}", self.t7.len()));
        }
        if self.isu.len() > MOST_ISUS {
            return Err(format!("{} times --isu: a bus has at most {MOST_ISUS}", self.isu.len()));
        }
        if self.port.is_some() && !self.t7.is_empty() && !self.isu.is_empty() {
            return Err("--port: one protocol on a port; run clino sim once for each".to_owned());
        }
        if self.isu.len() > 1 && self.isu.iter().any(Isu::prints) {
            return Err("--isu …,ascii: a module that prints needs the bus for itself".to_owned());
        }
        Ok(())
    }
}

fn probability(text: &str) -> Result<Probability, String> {
    text.parse().ok().and_then(Probability::new).ok_or_else(|| "not a number in 0..=1".to_owned())
}

//! The command language. The text above each command is what `help` prints.

use embedded_cli::Command;

use crate::arguments::{BusName, Echo, IsuVerb, Kind, Switch, T7Verb};

/// Everything that can be typed.
#[derive(Debug, Command)]
pub enum Typed<'a> {
    /// List all slots in use with their last values
    List,
    /// Show the last value of one slot
    Read {
        /// Number of the slot
        slot: u8,
    },
    /// Print values as they come, until Enter or Ctrl-C
    Watch,
    /// Answer programs (on: JSON lines, no echo) or people (off)
    Json {
        /// on or off
        mode: Switch,
    },
    /// Set what a slot reads
    Slot {
        /// Number of the slot
        slot: u8,
        /// t7, isu, pwm or off
        kind: Kind,
        /// Bus address (t7: 1-100 or 127, isu: 1-14), or number of the PWM input (1 or 2)
        address: Option<u8>,
        /// Axis of a T7: 0, 1 or 2
        #[arg(short = 'a', long)]
        axis: Option<u8>,
        /// From one reading to the next, ms; 0 is as often as the bus can
        #[arg(short = 'p', long)]
        period: Option<u32>,
        /// Further tries within one reading
        #[arg(short = 'r', long)]
        retries: Option<u8>,
        /// Age at which a value is stale, ms
        #[arg(short = 's', long)]
        stale: Option<u32>,
    },
    /// Show or set a bus
    Bus {
        /// t7 or isu
        bus: BusName,
        /// Bit rate, bit/s
        #[arg(short = 'b', long)]
        baud: Option<u32>,
        /// Silence before our driver is switched on, us
        #[arg(short = 'g', long)]
        guard: Option<u32>,
        /// From DE high to the first start bit, us
        #[arg(long)]
        pre: Option<u32>,
        /// From the last stop bit to DE low, us
        #[arg(long)]
        post: Option<u32>,
        /// Whether our own characters come back: off, expected or detect
        #[arg(short = 'e', long)]
        echo: Option<Echo>,
    },
    /// Find and set up T7s: scan, scan all, info, zero, offset, direction, damping, range, address, baud
    #[command(name = "t7")]
    T7 {
        /// scan, scan all; info A; zero A; offset A MDEG; direction A normal|reversed; damping A MS; range A
        /// bidirectional|unidirectional; address A NEW; baud A RATE
        verb: T7Verb,
        /// Address of the device
        address: Option<&'a str>,
        /// The new value
        value: Option<&'a str>,
        /// Axis: 0, 1 or 2
        #[arg(short = 'a', long)]
        axis: Option<u8>,
    },
    /// Set up and repair ISUs: info, reset, zero, null, address, repair
    Isu {
        /// info A; reset A; zero A; null A POSITION; address A NEW; repair A
        verb: IsuVerb,
        /// Address of the module
        address: &'a str,
        /// The new value
        value: Option<&'a str>,
    },
    /// Show the counters of both buses
    Counters,
    /// Show the version and the time since reset
    Version,
}

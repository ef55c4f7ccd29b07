//! `clino isu …`

use clap::{Args, Subcommand};
use clino_codec::isu::{Address, Function};

use super::names;
use super::verb::Verb;
use crate::choice::choose;
use crate::number::{memory_address, within};
use crate::port::PortName;
use crate::stream::Frames;

/// Highest address of a module; 15 is reserved. Source: AN #201 §4.
const MAX_ADDRESS: u8 = 14;
/// Most RAM bytes in an answer. The codec knows how many words of EEPROM fit.
const MAX_COUNT: u8 = clino_codec::isu::MAX_DATA as u8;
/// Name of the command that reads the angle: `read_ram --start 58H --count 2`.
const READ_ANGLE: &str = "read_angle";

const COMMANDS: &str = "\
Commands and the options they need:
  read_angle               read_ram --start 58H --count 2
  read_ram                 --start --count (bytes)
  write_ram                --start --data
  read_eeprom              --start --count (words)
  write_eeprom             --start --words
  reset_null_position
  reset_module
  go_to_soft_error_state

Writes outside RAM 58H-59H and EEPROM 48H-57H, 78H-7FH, D0H-D7H are refused.
A wrong checksum in EEPROM 78H-7FH disables the module.";

/// The subcommands: frames, and ISUs on a bus.
#[derive(Subcommand)]
pub enum Tool {
    /// Frame to JSON
    Decode(Decode),
    /// Command to frame
    #[command(after_help = COMMANDS, allow_negative_numbers = true)]
    Encode(Encode),
    /// ASCII lines to JSON, such as `+ 32.70`: from standard input, or as a module prints them at a port
    Ascii(AsciiLines),
    #[command(flatten)]
    Verb(Verb),
}

/// `clino isu ascii [--port PORT]`
#[derive(Args)]
pub struct AsciiLines {
    /// Serial port, pseudo-terminal, or tcp://host:port; without it, standard input is read
    #[arg(long, value_name = "PORT")]
    pub port: Option<PortName>,
    /// End after this many lines
    #[arg(long, value_name = "N", requires = "port")]
    pub lines: Option<u32>,
}

/// `clino isu decode …`
#[derive(Args)]
pub struct Decode {
    /// The frames are commands from the host, not answers of a module
    #[arg(long)]
    pub command: bool,
    #[command(flatten)]
    pub frames: Frames,
}

/// `clino isu encode …`
#[derive(Args)]
pub struct Encode {
    /// Module address: 1-14, or 0 (every module)
    #[arg(long, value_name = "N", value_parser = address)]
    pub address: Address,
    /// Name of the command; see below
    #[arg(value_parser = command)]
    pub command: Command,
    #[command(flatten)]
    pub parameters: Parameters,
    /// Permit writes to memory that the document does not name
    #[arg(long)]
    pub even_if_it_bricks_the_module: bool,
}

/// A function, or the one use of one that has a name of its own.
#[derive(Clone, Copy)]
pub enum Command {
    ReadAngle,
    Function(Function),
}

impl Command {
    pub const fn name(self) -> &'static str {
        match self {
            Self::ReadAngle => READ_ANGLE,
            Self::Function(function) => names::function(function),
        }
    }
}

/// Everything that some command needs.
#[derive(Args)]
pub struct Parameters {
    /// First memory address: 88, 0x58 and 58H are the same
    #[arg(long, value_name = "ADDRESS", value_parser = memory_address)]
    pub start: Option<u8>,
    /// Bytes of RAM (1..=253) or words of EEPROM (1..=126) to read
    #[arg(long, value_name = "N", value_parser = count)]
    pub count: Option<u8>,
    /// Bytes to write, hexadecimal
    #[arg(long, value_name = "HEX", num_args = 1..)]
    pub data: Option<Vec<String>>,
    /// 16-bit words to write, hexadecimal, one to four digits each
    #[arg(long, value_name = "HEX", num_args = 1..)]
    pub words: Option<Vec<String>>,
}

fn address(text: &str) -> Result<Address, String> {
    within(text, 0..=MAX_ADDRESS)
        .and_then(|address| Address::new(address).ok_or_else(|| format!("{address} is not an address")))
}

fn command(text: &str) -> Result<Command, String> {
    let functions = Function::ALL.map(Command::Function);
    choose(text, [Command::ReadAngle].into_iter().chain(functions), Command::name)
}

fn count(text: &str) -> Result<u8, String> {
    within(text, 1..=MAX_COUNT)
}

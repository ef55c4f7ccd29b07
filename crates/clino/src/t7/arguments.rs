//! `clino t7 …`

use clap::{Args, Subcommand};
use clino_codec::angle::Range;
use clino_codec::t7::{Address, Axis, BaudRate, DeviceType, Direction, Millidegrees, Opcode};

use super::verb::Verb;
use super::{names, typed};
use crate::choice::choose;
use crate::number::within;
use crate::stream::Frames;

const COMMANDS: &str = "\
Commands and the options they need:
  get_all_angles           (80)
  get_angle                (81-83)  --axis
  set_angle                (84)     --axis --angle-mdeg
  get_all_angle_offsets    (85)
  set_angle_offset         (86)     --axis --offset-mdeg
  get_all_data             (87)
  get_all_directions       (88)
  set_direction            (89)     --axis --direction
  get_damping              (8A)
  set_damping              (8B)     --damping-ms
  get_angle_output_range   (8C)
  set_angle_output_range   (8D)     --range
  get_device_information   (8E)
  set_baud_rate            (8F)     --baud
  set_address              (91)     --device-type --serial --new-address

Set commands land in the device's non-volatile memory, which wears.
Commands with a response length value above 8 cannot go to address 126.";

/// The subcommands: frames, and T7s on a bus.
#[derive(Subcommand)]
pub enum Tool {
    /// Frame to JSON
    Decode(Decode),
    /// Command to frame
    #[command(after_help = COMMANDS, allow_negative_numbers = true)]
    Encode(Encode),
    #[command(flatten)]
    Verb(Verb),
}

/// `clino t7 decode …`
#[derive(Args)]
pub struct Decode {
    /// The frames are commands from the host, not answers of a device
    #[arg(long)]
    pub command: bool,
    /// Accept answers with angles, offsets and damping times outside the documented ranges
    #[arg(long, conflicts_with = "command")]
    pub any_value: bool,
    #[command(flatten)]
    pub frames: Frames,
}

/// `clino t7 encode …`
#[derive(Args)]
pub struct Encode {
    /// Device address: 1-100, 127 (as from the factory), or 126 (all devices)
    #[arg(long, value_name = "N", value_parser = address)]
    pub address: Address,
    /// Name of the command; see below
    #[arg(value_parser = command)]
    pub command: Opcode,
    #[command(flatten)]
    pub parameters: Parameters,
}

/// Everything that some command needs.
#[derive(Args)]
pub struct Parameters {
    /// 0, 1, or 2; the axis of a T7-1 is 2
    #[arg(long, value_parser = typed::axis)]
    pub axis: Option<Axis>,
    /// Angle in millidegrees, -180000..=359999
    #[arg(long, value_name = "MDEG", value_parser = typed::millidegrees)]
    pub angle_mdeg: Option<Millidegrees>,
    /// Offset in millidegrees, -180000..=359999
    #[arg(long, value_name = "MDEG", value_parser = typed::millidegrees)]
    pub offset_mdeg: Option<Millidegrees>,
    /// normal or reversed
    #[arg(long, value_parser = typed::direction)]
    pub direction: Option<Direction>,
    /// Averaging time in milliseconds, 2..=5000
    #[arg(long, value_name = "MS", value_parser = typed::damping_ms)]
    pub damping_ms: Option<u16>,
    /// bidirectional (-180 to 180 degrees) or unidirectional (0 to 360)
    #[arg(long, alias = "output-range", value_parser = typed::range)]
    pub range: Option<Range>,
    /// Bit/s: 115200, 57600, 38400, 19200, or 9600
    #[arg(long, value_name = "RATE", value_parser = typed::baud)]
    pub baud: Option<BaudRate>,
    /// t7-1 or t7-3
    #[arg(long, value_parser = device_type)]
    pub device_type: Option<DeviceType>,
    /// Serial number of the device, 0..=4294967295
    #[arg(long, value_name = "NUMBER", value_parser = serial)]
    pub serial: Option<u32>,
    /// Address for the device to take, 1..=100
    #[arg(long, value_name = "N", value_parser = typed::new_address)]
    pub new_address: Option<Address>,
}

fn address(text: &str) -> Result<Address, String> {
    within(text, u8::MIN..=u8::MAX)
        .ok()
        .and_then(Address::of_request)
        .ok_or_else(|| "not in 1..=100, nor 126 (all devices) or 127 (factory)".to_owned())
}

/// Of the commands with one name, the first.
fn command(text: &str) -> Result<Opcode, String> {
    choose(text, Opcode::ALL, names::command)
}

fn device_type(text: &str) -> Result<DeviceType, String> {
    choose(text, names::DEVICE_TYPES, names::device_type)
}

fn serial(text: &str) -> Result<u32, String> {
    within(text, u32::MIN..=u32::MAX)
}

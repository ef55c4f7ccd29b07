//! `clino isu VERB … --port PORT`: the words of the gateway's console.

use clap::{Args, Subcommand};
use clino_codec::isu::Address;
use clino_codec::isu::eeprom::ShutoffBit;

use crate::choice::choose;
use crate::number::within;
use crate::session::{Consent, PortOptions};

/// Highest address of a module; 15 is reserved. Source: AN #201 §4.
const MAX_ADDRESS: u8 = 14;

/// What can be done with ISUs on a bus.
#[derive(Subcommand)]
pub enum Verb {
    /// Find modules: every address from 1 to 14
    Scan(PortOptions),
    /// Where a module is, how it is set, whether its memory is sound
    Info(One),
    /// The angle
    Angle(One),
    /// The module reads zero as it stands; writes to its memory
    Zero(Zero),
    /// The null position, as the module stores it; writes to its memory, and the module starts again
    Null(Null),
    /// The address; writes to the module's memory, and the module starts again
    Address(SetAddress),
    /// The module starts again
    Reset(One),
    /// Makes the checksum of the module's memory right, and starts it again
    Repair(Repair),
    /// Whether the module may switch itself off; writes to its memory if on or off is said, and the module starts again
    AutoShutoff(AutoShutoff),
    /// The module's memory: all words, or whether its checksum is right; writes nothing
    #[command(subcommand)]
    Eeprom(Eeprom),
}

/// `eeprom dump A`, `eeprom audit A`
#[derive(Subcommand)]
pub enum Eeprom {
    /// All 256 words
    Dump(One),
    /// The checksum as it is stored, and as it should be
    Audit(One),
}

/// `auto-shutoff A [on|off]`
#[derive(Args)]
pub struct AutoShutoff {
    #[command(flatten)]
    pub one: One,
    /// on or off
    #[arg(value_name = "on|off", value_parser = on_off, requires = "bit")]
    pub enabled: Option<bool>,
    /// Which bit of the word is the switch: 0, 1 or 7; the document cannot be read there, 0 fits best
    #[arg(long, value_name = "BIT", value_parser = shutoff_bit, requires = "enabled")]
    pub bit: Option<ShutoffBit>,
    #[command(flatten)]
    pub consent: Consent,
}

/// One module.
#[derive(Args, Clone)]
pub struct One {
    /// Address of the module: 1-14, or 0 with --alone
    #[arg(value_name = "A", value_parser = address)]
    pub address: Address,
    /// It is connected alone: it is asked at address 0, which every module answers, whatever its own is
    #[arg(long)]
    pub alone: bool,
    #[command(flatten)]
    pub port: PortOptions,
}

/// `zero A`
#[derive(Args)]
pub struct Zero {
    #[command(flatten)]
    pub one: One,
    #[command(flatten)]
    pub consent: Consent,
}

/// `null A POSITION`
#[derive(Args)]
pub struct Null {
    #[command(flatten)]
    pub one: One,
    /// In 360/65536 of a degree, 0..=65535
    #[arg(value_name = "POSITION", value_parser = position)]
    pub position: u16,
    #[command(flatten)]
    pub consent: Consent,
}

/// `address A NEW`
#[derive(Args)]
pub struct SetAddress {
    #[command(flatten)]
    pub one: One,
    /// Address for the module to take: 1-14, or 0 with --alone
    #[arg(value_name = "NEW", value_parser = address)]
    pub new: Address,
    #[command(flatten)]
    pub consent: Consent,
}

/// `repair A [NEW]`
#[derive(Args)]
pub struct Repair {
    #[command(flatten)]
    pub one: One,
    /// The address it was to take when a change of its address was interrupted
    #[arg(value_name = "NEW", value_parser = address)]
    pub new: Option<Address>,
    #[command(flatten)]
    pub consent: Consent,
}

fn address(text: &str) -> Result<Address, String> {
    within(text, 0..=MAX_ADDRESS)
        .and_then(|address| Address::new(address).ok_or_else(|| format!("{address} is not an address")))
}

fn on_off(text: &str) -> Result<bool, String> {
    choose(text, [true, false], |on| if on { "on" } else { "off" })
}

fn shutoff_bit(text: &str) -> Result<ShutoffBit, String> {
    choose(text, [ShutoffBit::Bit0, ShutoffBit::Bit1, ShutoffBit::Bit7], |bit| bit as u8)
}

fn position(text: &str) -> Result<u16, String> {
    within(text, u16::MIN..=u16::MAX)
}

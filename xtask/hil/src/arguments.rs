//! The command line.

use std::path::PathBuf;

use clap::Parser;

/// The image on a board with this computer at its ports: assertions, and a report (docs/bring-up.md).
///
/// The settings stored in the board are lost: the report has the commands that make them again.
#[derive(Parser, Debug)]
#[command(name = "cargo xtask hil")]
pub struct Arguments {
    /// Run on the virtual board, in real time
    #[arg(long = "virtual", conflicts_with_all = ["console", "t7", "isu", "modbus", "adapter"])]
    pub on_virtual_board: bool,
    /// Run on QEMU, which it unpacks below the target directory if there is none: answers only, no times (docs/witness.md)
    #[arg(long = "qemu", conflicts_with_all = ["on_virtual_board", "console", "t7", "isu", "modbus", "adapter", "analyser"])]
    pub on_qemu: bool,
    /// What goes wrong with the virtual board: a scenario file of docs/scenario.md without sensors
    #[arg(long, value_name = "FILE", requires = "on_virtual_board")]
    pub scenario: Option<PathBuf>,
    /// The board, as `cargo xtask` names it
    #[arg(long, value_name = "NAME", default_value = "f407-disc1")]
    pub board: String,
    /// Its chip, as `probe-rs` names it; `cargo xtask hil` says it
    #[arg(long, value_name = "NAME", default_value = "STM32F407VGTx", hide = true)]
    pub chip: String,
    /// Serial port at the console: a 3.3 V USB-UART, or that of an ST-LINK which has the console
    #[arg(long, value_name = "PORT", required_unless_present_any = ["on_virtual_board", "on_qemu"])]
    pub console: Option<String>,
    /// USB-RS485 adapter on the T7 bus, with no sensor on it
    #[arg(long, value_name = "PORT")]
    pub t7: Option<String>,
    /// USB-RS485 adapter on the ISU bus, with no sensor on it
    #[arg(long, value_name = "PORT")]
    pub isu: Option<String>,
    /// USB-RS485 adapter on the Modbus port's pair
    #[arg(long, value_name = "PORT")]
    pub modbus: Option<String>,
    /// One adapter for all pairs without one of their own: asks to move it
    #[arg(long, value_name = "PORT")]
    pub adapter: Option<String>,
    /// True angle of a source at PWM input 1, in degrees
    #[arg(long, value_name = "DEGREES")]
    pub pwm1: Option<f64>,
    /// True angle of a source at PWM input 2, in degrees
    #[arg(long, value_name = "DEGREES")]
    pub pwm2: Option<f64>,
    /// sigrok driver of a logic analyser, such as fx2lafw; channels D0 T7 RO, D1 T7 DE, D2 ISU RO, D3 ISU DE, where RO is that
    /// of a transceiver whose receiver is always on
    #[arg(long, value_name = "DRIVER")]
    pub analyser: Option<String>,
    /// Leave the image on the board as it is; the log is not read then
    #[arg(long)]
    pub no_flash: bool,
    /// The start, one angle of each bus, one read of the Modbus port, and the times on the wires
    #[arg(long)]
    pub short: bool,
    /// Where the report goes
    #[arg(long, value_name = "FILE", default_value = "hil-report.md")]
    pub report: PathBuf,
    /// The firmware image
    #[arg(long, value_name = "FILE", default_value = "target/thumbv7em-none-eabihf/release/clino-firmware")]
    pub elf: PathBuf,
    /// The programs `clino` and `vboard`
    #[arg(long, value_name = "FOLDER", default_value = "target/debug")]
    pub programs: PathBuf,
}

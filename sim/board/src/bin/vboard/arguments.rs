//! The command line.

use std::path::PathBuf;

use clino_board::BoardModel;
use clino_board::scenario::Time;
use clino_sim::node::Ns;

pub const USAGE: &str = "\
usage: vboard --elf FILE [--board NAME] [--scenario FILE] [--duration TIME] [--bus-log FILE]
              [--vcd FILE] [--rtt FILE] [--realtime] [--console-pty] [--modbus-pty] [--t7-pty] [--isu-pty]
              [--flash FILE] [--cut-power STEP]

  --elf FILE       firmware image to run
  --board NAME     board that it runs on: f407-disc1 (default), f407ve, nucleo-f446re
  --scenario FILE  sensors and what befalls them (docs/scenario.md); default: scenarios/default.toml
  --duration TIME  virtual time to run, such as 5s or 200ms, or `forever`; default: the scenario's,
                   in real time forever
  --bus-log FILE   write every character and every DE edge on both RS485 buses and the Modbus port to FILE
  --vcd FILE       write the levels of the pairs, DE, the console's TX, PWM and the reset pin to FILE,
                   for GTKWave, PulseView and sigrok (docs/bring-up.md)
  --rtt FILE       write the log that the image makes with defmt to FILE, as a probe reads it: defmt-print decodes it
  --realtime       no faster than the wall clock
  --console-pty    in real time, with the console on a pseudo-terminal
  --modbus-pty     in real time, with the Modbus port on a pseudo-terminal
  --t7-pty, --isu-pty
                   in real time, with a pseudo-terminal in place of the sensors of that bus: what another program
                   writes there comes back from the bus, as through an RS485 adapter
  --flash FILE     what firmware stores in flash is in FILE before and after the run; it need not exist before
  --cut-power STEP cut the power in the middle of this step of the flash: a word programmed or a sector erased, from 1
  --help           this text

Each pseudo-terminal is announced on a line of its own before the run begins: `console PATH`, `modbus PATH`,
`t7 PATH`, `isu PATH`;
standard error explains its use.
Ctrl-C ends the run with the summary.

exit status: 0 all well, 1 ran but something is wrong, 2 wrong command line, scenario or image";

/// The arguments.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Arguments {
    /// Firmware image.
    pub elf: PathBuf,
    /// The board.
    pub board: BoardModel,
    /// Scenario file, if not the default one.
    pub scenario: Option<PathBuf>,
    /// How long to run.
    pub duration: Duration,
    /// Where the bus log goes.
    pub bus_log: Option<PathBuf>,
    /// Where the levels of the lines go.
    pub vcd: Option<PathBuf>,
    /// Where the raw log goes.
    pub rtt: Option<PathBuf>,
    /// Virtual time keeps to the wall clock.
    pub realtime: bool,
    /// The console is on a pseudo-terminal.
    pub console_pty: bool,
    /// The Modbus port is on a pseudo-terminal.
    pub modbus_pty: bool,
    /// A pseudo-terminal is in place of the T7s, of the ISUs.
    pub bus_ptys: [bool; 2],
    /// Where the stored contents of flash are kept.
    pub flash: Option<PathBuf>,
    /// Step of the flash in which the power is cut.
    pub cut_power: Option<u64>,
}

/// How long to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Duration {
    /// Not given.
    #[default]
    Usual,
    /// Until the user ends it.
    Forever,
    /// This much virtual time.
    Of(Ns),
}

impl Arguments {
    /// Takes the arguments apart.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn parse(arguments: &[String]) -> Result<Self, String> {
        let mut wanted = Self::default();
        let mut rest = arguments.iter();
        while let Some(flag) = rest.next() {
            let mut value = || rest.next().ok_or_else(|| format!("{flag} needs a value"));
            match flag.as_str() {
                "--elf" => wanted.elf = value()?.into(),
                "--board" => wanted.board = value()?.parse().map_err(|why| format!("{flag}: {why}"))?,
                "--scenario" => wanted.scenario = Some(value()?.into()),
                "--duration" => {
                    wanted.duration = Duration::parse(value()?).map_err(|why| format!("{flag}: {why}"))?;
                }
                "--bus-log" => wanted.bus_log = Some(value()?.into()),
                "--rtt" => wanted.rtt = Some(value()?.into()),
                "--vcd" => wanted.vcd = Some(value()?.into()),
                "--flash" => wanted.flash = Some(value()?.into()),
                "--cut-power" => {
                    let step = value()?;
                    let number = step.parse().map_err(|_| format!("{flag}: `{step}` is not a number"))?;
                    wanted.cut_power = Some(number);
                }
                "--realtime" => wanted.realtime = true,
                "--console-pty" => wanted.console_pty = true,
                "--modbus-pty" => wanted.modbus_pty = true,
                "--t7-pty" => wanted.bus_ptys[0] = true,
                "--isu-pty" => wanted.bus_ptys[1] = true,
                other => return Err(format!("unknown argument `{other}`")),
            }
        }
        // A pseudo-terminal is for programs that live by the wall clock.
        wanted.realtime |= wanted.has_ptys();
        if wanted.elf.as_os_str().is_empty() { Err("--elf FILE is missing".into()) } else { Ok(wanted) }
    }

    /// Whether anything is on a pseudo-terminal.
    pub fn has_ptys(&self) -> bool {
        self.console_pty || self.modbus_pty || self.bus_ptys.contains(&true)
    }

    /// Whether it runs until the user ends it.
    pub fn forever(&self) -> bool {
        self.duration == Duration::Forever || self.realtime && self.duration == Duration::Usual
    }
}

impl Duration {
    fn parse(text: &str) -> Result<Self, String> {
        if text == "forever" {
            return Ok(Self::Forever);
        }
        match text.parse() {
            Ok(Time(0)) => Err("0 s, expected more than that".into()),
            Ok(Time(ns)) => Ok(Self::Of(ns)),
            Err(why) => Err(why.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Arguments, String> {
        let words: Vec<String> = text.split(' ').map(String::from).collect();
        Arguments::parse(&words)
    }

    #[test]
    fn a_pseudo_terminal_implies_real_time_and_real_time_has_no_end() {
        let plain = parse("--elf x").unwrap();
        assert!(!plain.realtime && !plain.forever());
        for option in ["--realtime", "--console-pty", "--modbus-pty", "--t7-pty", "--isu-pty"] {
            let wanted = parse(&format!("--elf x {option}")).unwrap();
            assert!(wanted.realtime && wanted.forever(), "{option}");
        }
        assert!(!parse("--elf x --realtime --duration 2s").unwrap().forever());
        assert!(parse("--elf x --duration forever").unwrap().forever());
    }
}

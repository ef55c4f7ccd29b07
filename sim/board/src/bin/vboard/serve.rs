//! The console and the RS485 pairs on pseudo-terminals: the Modbus port, and buses whose sensors another program serves.

use std::io::{self, Write};

use clino_board::console::{BAUD as CONSOLE_BAUD, SharedTerminal};
use clino_board::modbus::{Framing, Parity, SharedMaster};
use clino_board::run::Run;
use clino_pty::{PtySettings, Terminal};
use clino_sim::node::Ns;

use crate::arguments::Arguments;

/// Bytes taken from a terminal at once: as many as it holds.
const CHUNK: usize = 4_096;
/// A request begins this much after its first bytes were there. A program may write it in pieces; what comes until
/// the last stop bit goes out without a gap.
const GATHERING: Ns = 2_000_000;

/// The ports that are served.
#[derive(Default)]
pub struct Ports {
    console: Option<Console>,
    pairs: Vec<Pair>,
}

struct Console {
    pty: Terminal,
    terminal: SharedTerminal,
}

/// An RS485 pair with the program as the computer on it.
struct Pair {
    pty: Terminal,
    master: SharedMaster,
    /// What the scenario says.
    usual: Framing,
    /// What the program has set.
    settings: PtySettings,
    /// End of what has been given to be sent.
    sending_until: Ns,
}

impl Ports {
    /// Opens the requested terminals, prints the path of each on its own line, and explains its use on standard error.
    ///
    /// # Errors
    /// The system has no more terminals, or the output is closed.
    pub fn open(run: &Run, wanted: &Arguments, out: &mut impl Write) -> io::Result<Self> {
        let mut ports = Self::default();
        if wanted.console_pty {
            let console = Console::open(run.terminal())?;
            let path = console.pty.path();
            writeln!(out, "console {path}")?;
            eprintln!(
                "open the console:  python3 -m serial.tools.miniterm {path} {CONSOLE_BAUD}   (or picocom)"
            );
            ports.console = Some(console);
        }
        if wanted.modbus_pty {
            let modbus = Pair::open(run.modbus())?;
            let path = modbus.pty.path();
            writeln!(out, "modbus {path}")?;
            eprintln!("read angles:       {}", mbpoll(modbus.usual, path));
            ports.pairs.push(modbus);
        }
        for (bus, adapter) in ["t7", "isu"].into_iter().zip(run.adapters()) {
            if let Some(adapter) = adapter {
                let pair = Pair::open(adapter)?;
                writeln!(out, "{bus} {}", pair.pty.path())?;
                ports.pairs.push(pair);
            }
        }
        out.flush()?;
        Ok(ports)
    }

    /// Moves bytes from the terminals to the board; `now` is the board's.
    ///
    /// # Errors
    /// Those of the terminals.
    pub fn bring(&mut self, now: Ns) -> io::Result<()> {
        if let Some(console) = &mut self.console {
            console.bring(now)?;
        }
        self.pairs.iter_mut().try_for_each(|pair| pair.bring(now))
    }

    /// Moves bytes from the board to the terminals.
    ///
    /// # Errors
    /// Those of the terminals.
    pub fn fetch(&mut self) -> io::Result<()> {
        if let Some(console) = &mut self.console {
            console.fetch()?;
        }
        self.pairs.iter_mut().try_for_each(Pair::fetch)
    }
}

impl Console {
    fn open(terminal: SharedTerminal) -> io::Result<Self> {
        terminal.lock().keep_bytes();
        Ok(Self { pty: Terminal::open(CONSOLE_BAUD)?, terminal })
    }

    fn fetch(&mut self) -> io::Result<()> {
        let heard = self.terminal.lock().take_bytes();
        self.pty.deliver(&heard)
    }

    fn bring(&mut self, now: Ns) -> io::Result<()> {
        let mut buffer = [0; CHUNK];
        let typed = self.pty.read(&mut buffer)?;
        self.terminal.lock().type_bytes(now, typed);
        Ok(())
    }
}

impl Pair {
    fn open(master: SharedMaster) -> io::Result<Self> {
        let usual = master.lock().framing();
        let settings = PtySettings {
            baud: usual.baud,
            two_stop_bits: usual.stop_bits == 2,
            odd_parity: usual.parity == Parity::Odd,
        };
        Ok(Self { pty: Terminal::open_with(settings)?, master, usual, settings, sending_until: 0 })
    }

    fn fetch(&mut self) -> io::Result<()> {
        let mut master = self.master.lock();
        // The bytes are all that a serial port has.
        master.take_answers();
        self.pty.deliver(&master.take_bytes())
    }

    fn bring(&mut self, now: Ns) -> io::Result<()> {
        let settings = self.pty.settings()?;
        let mut master = self.master.lock();
        if settings != self.settings {
            self.settings = settings;
            master.set_framing(framing(settings, self.usual));
        }
        // A program cannot know how long this computer takes for the gateway's start: what it has sent waits in the terminal.
        if !master.gateway_has_listened() {
            return Ok(());
        }
        let mut buffer = [0; CHUNK];
        let request = self.pty.read(&mut buffer)?;
        if !request.is_empty() {
            let length = master.framing().character() * request.len() as Ns;
            let at = if now <= self.sending_until { now } else { master.free_from().max(now + GATHERING) };
            master.send(at, request);
            self.sending_until = self.sending_until.max(at) + length;
        }
        Ok(())
    }
}

/// How `mbpoll` reads the angles of six slots in millidegrees, from the first register of the map's fast block on.
fn mbpoll(framing: Framing, path: &str) -> String {
    let Framing { baud, parity, stop_bits } = framing;
    let parity = match parity {
        Parity::None => "none",
        Parity::Even => "even",
        Parity::Odd => "odd",
    };
    format!("mbpoll -m rtu -a 1 -b {baud} -P {parity} -s {stop_bits} -t 4:int -B -r 33 -c 6 {path}")
}

/// What a program's settings amount to. A pseudo-terminal does not keep whether there is a parity bit: there is none
/// with two stop bits, as the standard has it, and otherwise as the scenario says.
fn framing(settings: PtySettings, usual: Framing) -> Framing {
    let PtySettings { baud, two_stop_bits, odd_parity } = settings;
    let none = usual.parity == Parity::None || two_stop_bits && usual.stop_bits == 1;
    let parity = match (odd_parity, none) {
        (true, _) => Parity::Odd,
        (false, true) => Parity::None,
        (false, false) => Parity::Even,
    };
    let baud = if baud == 0 { usual.baud } else { baud };
    Framing { baud, parity, stop_bits: if two_stop_bits { 2 } else { 1 } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_program_sets_is_what_goes_over_the_line() {
        let even = Framing::default();
        let none = Framing { parity: Parity::None, ..even };
        for (baud, two_stop_bits, odd_parity, usual, expected) in [
            (19_200, false, false, even, "19200 8E1"),
            (9_600, false, true, even, "9600 8O1"),
            (115_200, true, false, even, "115200 8N2"),
            (0, false, false, none, "19200 8N1"),
            (38_400, false, true, none, "38400 8O1"),
        ] {
            let settings = PtySettings { baud, two_stop_bits, odd_parity };
            assert_eq!(framing(settings, usual).to_string(), expected);
        }
    }
}

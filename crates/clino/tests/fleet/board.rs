//! The shipped image on the virtual board, in real time: its console and its Modbus port as pseudo-terminals.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;

use clino_testkit::programs::skipped;

/// A board that is ended with its test.
pub struct Board(Child);

impl Board {
    /// With the path of its console; or a loud skip of this test.
    pub fn console(test: &str) -> Option<(Board, String)> {
        let (board, [console]) = Board::start(test, ["console"])?;
        Some((board, console))
    }

    /// With the paths of its console and of its Modbus port; or a loud skip of this test.
    pub fn both(test: &str) -> Option<(Board, [String; 2])> {
        Board::start(test, ["console", "modbus"])
    }

    fn start<const N: usize>(test: &str, ports: [&str; N]) -> Option<(Board, [String; N])> {
        let (Some(elf), Some(vboard)) = (crate::variable("CLINO_ELF"), crate::variable("CLINO_VBOARD"))
        else {
            skipped(test, "CLINO_ELF and CLINO_VBOARD name no image and no virtual board");
            return None;
        };
        let mut command = Command::new(vboard);
        command.args(["--elf", &elf, "--realtime", "--duration", "forever"]);
        command.args(ports.map(|port| format!("--{port}-pty")));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut board = Board(command.spawn().expect("the virtual board starts"));
        let lines = BufReader::new(board.0.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        let (to, from) = channel();
        // Its summary goes to a reader that stays.
        std::thread::spawn(move || lines.for_each(|line| _ = to.send(line)));
        let mut known = Vec::new();
        let paths = ports.map(|port| {
            crate::until("a port of the board", || {
                known.extend(from.try_iter());
                known
                    .iter()
                    .find_map(|line: &String| line.strip_prefix(&format!("{port} ")).map(str::to_owned))
            })
        });
        Some((board, paths))
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

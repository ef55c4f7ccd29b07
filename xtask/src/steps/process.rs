//! A running program, and the processor time of it and all its children.
//!
//! The time comes from `/proc/PID/stat` (proc(5)) of the program when it has ended and is not waited for yet: fields 14
//! to 17, in clock ticks. Elsewhere than on Linux there is none.

use std::fs;
use std::io;
use std::process::{Child, Command, ExitStatus};
use std::time::Duration;

/// `sysconf(_SC_CLK_TCK)`: 100 Hz on every Linux.
const TICK: Duration = Duration::from_millis(10);

/// A program that was started.
pub struct Process(Child);

/// How it ended.
pub struct Ended {
    pub status: ExitStatus,
    /// User and system time, with its children's.
    pub cpu: Option<Duration>,
}

impl Process {
    /// Starts it.
    pub fn start(mut command: Command) -> io::Result<Process> {
        command.spawn().map(Process)
    }

    /// How it ended, if it has.
    pub fn ended(&mut self) -> io::Result<Option<Ended>> {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.0.id())).ok();
        let stat = stat.as_deref().and_then(parse);
        match stat {
            Some((state, _)) if state != 'Z' => Ok(None),
            _ => {
                let cpu = stat.map(|(_, cpu)| cpu);
                Ok(self.0.try_wait()?.map(|status| Ended { status, cpu }))
            }
        }
    }
}

/// State and processor time of a process.
fn parse(stat: &str) -> Option<(char, Duration)> {
    // The second field is the program's name, which may have blanks and parentheses.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace();
    let state = fields.next()?.chars().next()?;
    let times = fields.skip(10).take(4);
    let ticks: u64 = times.map(|field| field.parse::<u64>().ok()).sum::<Option<u64>>()?;
    Some((state, TICK * u32::try_from(ticks).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn state_and_times_are_found_whatever_the_program_is_called() {
        let stat = "4242 (a) Z (b c) Z 1 4242 1 0 -1 4194560 100 200 0 0 150 25 1000 325 20 0 1 0 99 0 0";
        assert_eq!(parse(stat), Some(('Z', Duration::from_secs(15))));
        assert_eq!(parse("4242 (a) R 1"), Some(('R', Duration::ZERO)));
        assert_eq!(parse(""), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_time_of_children_counts() {
        let mut command = Command::new("sh");
        command.args(["-c", "sh -c 'i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done'; exit 3"]);
        let mut process = Process::start(command).unwrap();
        let ended = loop {
            match process.ended().unwrap() {
                Some(ended) => break ended,
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        assert_eq!(ended.status.code(), Some(3));
        assert!(ended.cpu.unwrap() >= TICK, "{:?}", ended.cpu);
    }
}

//! Captures: a value change dump of the virtual board or of `sigrok-cli`, read into lines.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;

use vcd::{Command as Entry, Parser, ScopeItem, TimescaleUnit, Value};

/// A line over time: its level before the first change, and each change in nanoseconds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// The level before the first change.
    pub initial: bool,
    /// Each change and the level from then on.
    pub changes: Vec<(u64, bool)>,
}

/// Bits of a character: start, eight data bits, stop.
pub const BITS: u64 = 10;

impl Line {
    /// The level from `at` on.
    pub fn level(&self, at: u64) -> bool {
        let end = self.changes.partition_point(|&(change, _)| change <= at);
        end.checked_sub(1).and_then(|last| self.changes.get(last)).map_or(self.initial, |&(_, high)| high)
    }

    /// Intervals in which it is high, begun and ended within the capture.
    pub fn highs(&self) -> Vec<(u64, u64)> {
        let mut rise = None;
        let mut intervals = Vec::new();
        for &(at, high) in &self.changes {
            match (high, rise) {
                (true, None) => rise = Some(at),
                (false, Some(from)) => {
                    intervals.push((from, at));
                    rise = None;
                }
                _ => {}
            }
        }
        intervals
    }

    /// Whether it is high at some time between the two.
    pub fn is_high_within(&self, from: u64, until: u64) -> bool {
        self.level(from) || self.changes.iter().any(|&(at, high)| high && (from..=until).contains(&at))
    }

    /// First falling edge from `from` on.
    pub fn falling(&self, from: u64) -> Option<u64> {
        let first = self.changes.partition_point(|&(at, _)| at < from);
        self.changes.get(first..)?.iter().find(|(_, high)| !high).map(|&(at, _)| at)
    }

    /// Last edge after `after`, up to `until`.
    pub fn last_edge(&self, after: u64, until: u64) -> Option<u64> {
        let end = self.changes.partition_point(|&(at, _)| at <= until);
        self.changes.get(..end)?.last().map(|&(at, _)| at).filter(|at| *at > after)
    }

    /// The characters that begin in this interval, 8N1: start, end and byte.
    pub fn bytes(&self, from: u64, until: u64, baud: u64) -> Vec<(u64, u64, u8)> {
        let bits = |halves: u64| halves * 1_000_000_000 / (2 * baud);
        let mut at = from;
        let mut bytes = Vec::new();
        while let Some(start) = self.falling(at).filter(|start| *start < until) {
            let bit = |place: u64| u8::from(self.level(start + bits(2 * place + 3))) << place;
            bytes.push((start, start + bits(2 * BITS), (0..8).map(bit).sum()));
            at = start + bits(2 * BITS - 1);
        }
        bytes
    }
}

/// Reads all lines of a dump in a file.
///
/// # Errors
/// As [`parse`], with the file's name.
pub fn read(path: &Path) -> Result<HashMap<String, Line>, String> {
    let named = |why: String| format!("{}: {why}", path.display());
    let file = File::open(path).map_err(|why| named(why.to_string()))?;
    parse(BufReader::new(file)).map_err(named)
}

/// Reads all lines of a dump.
///
/// # Errors
/// It is none, or cannot be read.
pub fn parse(dump: impl BufRead) -> Result<HashMap<String, Line>, String> {
    let failed = |why: std::io::Error| why.to_string();
    let mut parser = Parser::new(dump);
    let header = parser.parse_header().map_err(failed)?;
    let unit = match header.timescale {
        Some((count, TimescaleUnit::PS)) => (u64::from(count), 1_000),
        Some((count, TimescaleUnit::NS)) => (u64::from(count), 1),
        Some((count, TimescaleUnit::US)) => (u64::from(count) * 1_000, 1),
        other => return Err(format!("time scale {other:?}")),
    };
    let mut names = HashMap::new();
    collect(&header.items, &mut names);
    let mut lines: HashMap<String, Line> =
        names.values().map(|name: &String| (name.clone(), Line::default())).collect();
    let (mut now, mut seen_time) = (0, false);
    for entry in parser {
        match entry.map_err(failed)? {
            Entry::Timestamp(time) => {
                now = time * unit.0 / unit.1;
                seen_time |= now > 0;
            }
            Entry::ChangeScalar(code, value) => {
                let high = value == Value::V1;
                let line = names.get(&code).and_then(|name| lines.get_mut(name));
                let Some(line) = line else { continue };
                if seen_time {
                    line.changes.push((now, high));
                } else {
                    line.initial = high;
                }
            }
            _ => {}
        }
    }
    Ok(lines)
}

fn collect(items: &[ScopeItem], names: &mut HashMap<vcd::IdCode, String>) {
    for item in items {
        match item {
            ScopeItem::Scope(scope) => collect(&scope.items, names),
            ScopeItem::Var(var) => {
                names.insert(var.code, var.reference.clone());
            }
            _ => {}
        }
    }
}

/// Rate at which a logic analyser is read: 83 ns a sample, a hundredth of a bit at 115200 bit/s; cheap ones have it.
const SAMPLES_PER_S: &str = "12m";
/// Long enough for some exchanges of an ISU.
const SPAN: &str = "4s";
/// Channels, in the order of the command line's help.
const CHANNELS: &str = "D0=t7_pair,D1=t7_de,D2=isu_pair,D3=isu_de";

/// Takes a capture with the logic analyser behind this driver of sigrok.
///
/// # Errors
/// What `sigrok-cli` says.
pub fn take(driver: &str) -> Result<PathBuf, String> {
    let path = std::env::temp_dir().join(format!("clino-hil-{}.vcd", std::process::id()));
    let mut sigrok = Command::new("sigrok-cli");
    sigrok.args(["-d", driver, "-c", &format!("samplerate={SAMPLES_PER_S}"), "--time", SPAN]);
    sigrok.args(["-C", CHANNELS, "-O", "vcd", "-o"]).arg(&path);
    let output = sigrok.output().map_err(|why| format!("sigrok-cli: {why}"))?;
    if output.status.success() {
        return Ok(path);
    }
    Err(format!("sigrok-cli -d {driver}: {}", String::from_utf8_lossy(&output.stderr).trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dump_of_sigrok_is_read() {
        // As sigrok-cli 0.7.2 writes it, but for its comments.
        let dump = "$timescale 1 ns $end\n$scope module libsigrok $end\n$var wire 1 ! t7_pair $end\n\
                    $var wire 1 \" t7_de $end\n$upscope $end\n$enddefinitions $end\n\
                    #0 1! 0\"\n#1000 1\"\n#2000 0!\n#9000\n";
        let path = std::env::temp_dir().join(format!("clino-hil-test-{}.vcd", std::process::id()));
        std::fs::write(&path, dump).unwrap();
        let lines = read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(lines["t7_pair"], Line { initial: true, changes: vec![(2_000, false)] });
        assert_eq!(lines["t7_de"], Line { initial: false, changes: vec![(1_000, true)] });
    }
}

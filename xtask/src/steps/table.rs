//! The table of what took how long.

use std::fmt::Write as _;
use std::time::Duration;

/// Steps that took less than this share a line.
const SHORT: Duration = Duration::from_secs(2);

/// A step that has ended, or a part of the step before.
pub struct Row {
    pub name: String,
    pub wall: Duration,
    /// Processor time, where it is known.
    pub cpu: Option<Duration>,
    pub failed: bool,
    /// It is contained in the step before.
    pub part: bool,
}

impl Row {
    /// Whether it has no line of its own.
    fn is_short(&self) -> bool {
        self.wall < SHORT && !self.failed
    }

    fn line(&self, width: usize) -> String {
        let indent = if self.part { "  " } else { "" };
        let name = format!("{indent}{}", self.name);
        let cpu = self.cpu.map_or("-".into(), clock);
        let failed = if self.failed { "  FAILED" } else { "" };
        format!("{name:<width$}  {:>8}  {cpu:>8}{failed}\n", clock(self.wall))
    }
}

/// The table as text: each step, and the whole command. Steps that ran side by side share the time of the clock.
pub fn table(command: &str, rows: &[Row], wall: Duration) -> String {
    let title = format!("cargo xtask {command}");
    let names = rows.iter().map(|row| row.name.chars().count() + 2).chain([title.len()]);
    let width = names.max().unwrap_or_default();
    let mut text = format!("{title:<width$}  {:>8}  {:>8}\n", "time", "CPU");
    for row in rows.iter().filter(|row| !row.is_short()) {
        text += &row.line(width);
    }
    let short: Vec<&Row> = rows.iter().filter(|row| row.is_short()).collect();
    if !short.is_empty() {
        let name = format!("{} shorter ones", short.len());
        let wall = short.iter().map(|row| row.wall).sum();
        let cpu = Some(short.iter().filter_map(|row| row.cpu).sum());
        text += &Row { name, wall, cpu, failed: false, part: false }.line(width);
    }
    let cpu: Duration = rows.iter().filter_map(|row| row.cpu).sum();
    let failed = rows.iter().filter(|row| row.failed && !row.part).count();
    let failed = if failed > 0 { format!("  {failed} FAILED") } else { String::new() };
    write!(text, "{:<width$}  {:>8}  {:>8}{failed}", "all", clock(wall), clock(cpu)).expect("memory");
    text
}

/// Minutes and seconds.
fn clock(time: Duration) -> String {
    let tenths = (time.as_millis() + 50) / 100;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_long_step_has_its_line_and_failures_are_named() {
        let row = |name: &str, ms, cpu: Option<u64>, failed| Row {
            name: name.to_owned(),
            wall: Duration::from_millis(ms),
            cpu: cpu.map(Duration::from_millis),
            failed,
            part: false,
        };
        let rows = [
            row("image", 61_250, Some(119_960), false),
            row("size", 100, None, false),
            row("tests", 30_000, Some(50_000), true),
            Row { part: true, ..row("clino-codec", 1_000, None, true) },
            Row { part: true, ..row("clino-bus", 29_000, None, false) },
            row("formatting", 1_900, Some(1_500), false),
        ];
        let expected = "\
cargo xtask test      time       CPU
image               1:01.3    2:00.0
tests               0:30.0    0:50.0  FAILED
  clino-codec       0:01.0         -  FAILED
  clino-bus         0:29.0         -
2 shorter ones      0:02.0    0:01.5
all                 1:33.0    2:51.5  1 FAILED";
        assert_eq!(table("test", &rows, Duration::from_secs(93)), expected);
    }
}

//! The table of what took how long.

use std::fmt::Write as _;
use std::time::Duration;

/// A step that has ended.
pub struct Row {
    pub name: String,
    pub wall: Duration,
    /// Processor time, where it is known.
    pub cpu: Option<Duration>,
    pub failed: bool,
}

/// The table as text: each step, and the whole command. Steps that ran side by side share the time of the clock.
pub fn table(command: &str, rows: &[Row], wall: Duration) -> String {
    let title = format!("cargo xtask {command}");
    let names = rows.iter().map(|row| row.name.chars().count()).chain([title.len()]);
    let width = names.max().unwrap_or_default();
    let mut text = format!("{title:<width$}  {:>8}  {:>8}\n", "time", "CPU");
    for Row { name, wall, cpu, failed } in rows {
        let cpu = cpu.map_or("-".into(), clock);
        let failed = if *failed { "  FAILED" } else { "" };
        writeln!(text, "{name:<width$}  {:>8}  {cpu:>8}{failed}", clock(*wall)).expect("memory");
    }
    let cpu: Duration = rows.iter().filter_map(|row| row.cpu).sum();
    let failed = rows.iter().filter(|row| row.failed).count();
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
    fn every_step_has_its_line_and_failures_are_named() {
        let row = |name: &str, ms, cpu: Option<u64>, failed| Row {
            name: name.to_owned(),
            wall: Duration::from_millis(ms),
            cpu: cpu.map(Duration::from_millis),
            failed,
        };
        let rows = [row("image", 61_250, Some(119_960), false), row("board suite", 5_040, None, true)];
        let expected = "\
cargo xtask test      time       CPU
image               1:01.3    2:00.0
board suite         0:05.0         -  FAILED
all                 1:03.0    2:00.0  1 FAILED";
        assert_eq!(table("test", &rows, Duration::from_secs(63)), expected);
    }
}

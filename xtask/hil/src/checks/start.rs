//! The start: the first line of the console, the first line of the log, and settings as delivered.

use serde_json::Value;

use super::Bench;
use crate::board::Board;
use crate::console::Console;
use crate::patience;

/// From the reset to the first line, by the image's own clock, ms. Measured: 5 on the virtual board; a slow crystal adds up to 20.
const LONGEST_START_MS: u64 = 60;

/// Lines of the log for the report.
const LOG_LINES: usize = 20;

pub fn check(bench: &mut Bench, board: &Board) -> Result<(), String> {
    let started = match board {
        Board::Qemu(_) => bench.console.for_programs()?,
        Board::Real(None) => {
            bench.console.for_programs()?;
            first_line(bench, |console| console.restart())?
        }
        _ => first_line(bench, |console| {
            let started = console.wait_for("stream", patience::START)?;
            console.for_programs()?;
            Ok(started)
        })?,
    };
    bench.report.check(
        "clock",
        "crystal",
        Ok((started["clock"].to_string(), started["clock"] == "crystal")),
        "the crystal: 8 MHz, its two capacitors, solder; the board runs on its internal oscillator and up to 8 % off",
    );
    bench.report.check(
        "mode",
        "normal",
        Ok((started["mode"].to_string(), started["mode"] == "normal")),
        "`reset-cause`: three crashes in a row bring safe mode",
    );
    bench.report.identity.push(format!(
        "image {}, chip {}, power-ups {}",
        started["version"], started["uid"], started["power_ups"]
    ));
    log(bench, board);
    let export = bench.console.ask("export")?;
    let commands = export.iter().filter_map(|object| object["export"].as_str());
    bench.report.settings = commands.map(str::to_owned).collect();
    if bench.arguments.on_qemu {
        // It has nothing stored, and cannot store anything.
        return Ok(());
    }
    bench.console.ask_flash("factory-reset --yes", "done")?;
    bench.console.restart().map(|_| ())
}

/// What the image says first.
fn first_line(
    bench: &mut Bench,
    start: impl Fn(&mut Console) -> Result<Value, String>,
) -> Result<Value, String> {
    let started = start(&mut bench.console)?;
    let uptime = started["uptime_ms"].as_u64();
    bench.report.check(
        "first line of the console",
        format!("started, uptime at most {LONGEST_START_MS} ms"),
        Ok((
            format!("{}, {} ms", started["stream"], started["uptime_ms"]),
            started["stream"] == "started" && uptime.is_some_and(|uptime| uptime <= LONGEST_START_MS),
        )),
        "the power supply; a watchdog that bites in the start (reset-cause)",
    );
    Ok(started)
}

/// The image says how it has started: `src/bring_up.rs`.
fn log(bench: &mut Bench, board: &Board) {
    const FIRST: &str = "first line of the log";
    let Some(log) = board.log() else {
        bench.report.skip(FIRST, "the log is read through a probe only");
        return;
    };
    let first = log.as_ref().map_err(String::clone).and_then(|lines| {
        let first = lines.iter().find(|line| line.contains("clino ") && line.contains("start "));
        first.cloned().ok_or_else(|| format!("{} lines, none of it", lines.len()))
    });
    bench.report.check(
        FIRST,
        "clino VERSION, start N after CAUSE",
        first.map(|line| (line, true)),
        "SWDIO, SWCLK, ground; `probe-rs list`; an image with its log (not --no-default-features)",
    );
    bench.report.log = log.unwrap_or_default().into_iter().take(LOG_LINES).collect();
}

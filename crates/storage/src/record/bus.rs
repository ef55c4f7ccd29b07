//! How a bus is written: fifteen numbers, then one byte for the echo.
//!
//! Bit rate, guard, latencies of a reading and of a writing request, margin, gap, quiet, patience, late, slack, longest
//! wait for silence; then of the line: bit rate, guard, delays before and after a frame; 0, 1, 2 for echo off, expected,
//! detect. A span longer than 71 minutes, which no bus has, is written as 71 minutes.

use clino_bus::line::{EchoMode, Settings as Line};
use clino_bus::{Micros, Serial, Timing};
use clino_gateway::BusSettings;

use super::Reject;
use super::bytes::{LONGEST_NUMBER, Reader, Writer};

/// Bytes of the longest bus: fifteen numbers and a byte.
pub(crate) const LONGEST: usize = LONGEST_NUMBER.saturating_mul(15).saturating_add(1);

const ECHO: [EchoMode; 3] = [EchoMode::Off, EchoMode::Expected, EchoMode::Detect];

pub(crate) fn encode(settings: &BusSettings, writer: &mut Writer<'_>) {
    let BusSettings { timing, line } = settings;
    writer.number(timing.serial.baud);
    let waits = [timing.guard, timing.get_latency, timing.set_latency, timing.margin, timing.gap];
    let waits = waits.into_iter().chain([timing.quiet, timing.patience, timing.late, timing.slack]);
    waits.chain([timing.line_busy]).for_each(|wait| span(wait, writer));
    writer.number(line.serial.baud);
    [line.guard, line.pre_delay, line.post_delay].into_iter().for_each(|wait| span(wait, writer));
    writer.byte(match line.echo {
        EchoMode::Off => 0,
        EchoMode::Expected => 1,
        EchoMode::Detect => 2,
    });
}

fn span(span: Micros, writer: &mut Writer<'_>) {
    writer.number(u32::try_from(span.0).unwrap_or(u32::MAX));
}

pub(crate) fn decode(reader: &mut Reader<'_>) -> Result<BusSettings, Reject> {
    let serial = Serial { baud: reader.number("bit rate")? };
    let mut span = || reader.number("wait_us").map(|us| Micros(us.into()));
    let timing = Timing {
        serial,
        guard: span()?,
        get_latency: span()?,
        set_latency: span()?,
        margin: span()?,
        gap: span()?,
        quiet: span()?,
        patience: span()?,
        late: span()?,
        slack: span()?,
        line_busy: span()?,
    };
    let serial = Serial { baud: reader.number("bit rate")? };
    let mut span = || reader.number("wait_us").map(|us| Micros(us.into()));
    let (guard, pre_delay, post_delay) = (span()?, span()?, span()?);
    let echo = reader.choice("echo", &ECHO)?;
    Ok(BusSettings { timing, line: Line { serial, guard, pre_delay, post_delay, echo } })
}

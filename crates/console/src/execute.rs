//! What each command does.

use core::fmt::{self, Write};

use clino_gateway::order::{self, Order, Refusal};
use clino_gateway::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source, json};

use clino_bus::{Micros, Serial, Timing, line};

use crate::arguments::{BusName, Echo, Kind, Switch};
use crate::command::Typed;
use crate::error::Error;
use crate::fields::{Value, line};
use crate::host::Host;
use crate::shell::{Audience, Next};
use crate::table;
use crate::tasks::{self, Rest};

const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

/// Carries a command out. What it has to say goes to `out`, whole lines without a carriage return.
pub fn execute<'a>(
    typed: &Typed<'a>,
    audience: Audience,
    host: &mut impl Host,
    out: &mut dyn Write,
) -> Result<Next, Failure<'a>> {
    let now = host.now();
    match *typed {
        Typed::List => {
            if audience == Audience::People {
                table::head(out)?;
            }
            for reading in (0..MAX_SLOTS).map_while(|slot| host.reading(slot)) {
                if reading.source != Source::Off {
                    match audience {
                        Audience::People => table::row(out, &reading, now)?,
                        Audience::Programs => json::reading(out, &reading, now)?,
                    }
                }
            }
        }
        Typed::Read { slot } => {
            let least_most = Error::Refused(Refusal::Range {
                what: "slot",
                value: u64::from(slot),
                least: 0,
                most: MAX_SLOTS.saturating_sub(1) as u64,
            });
            let reading = host.reading(usize::from(slot)).ok_or(least_most)?;
            match audience {
                Audience::People => table::row(out, &reading, now)?,
                Audience::Programs => json::reading(out, &reading, now)?,
            }
        }
        Typed::Watch => return Ok(Next::Stream),
        Typed::Json { mode: Switch(on) } => {
            return Ok(Next::Speak(if on { Audience::Programs } else { Audience::People }));
        }
        Typed::Slot { slot, kind, address, axis, period, retries, stale } => {
            let mut config = SlotConfig::usual(source(kind, address, axis)?);
            if let Some(ms) = period {
                config.period = order::period(ms)?;
            }
            config.retries = retries.unwrap_or(config.retries);
            if let Some(ms) = stale {
                config.stale_after = order::stale_after(ms)?;
            }
            host.order(Order::Slot { slot, config })?;
            done(audience, out)?;
        }
        Typed::Bus { bus: BusName(bus), baud: None, guard: None, pre: None, post: None, echo: None } => {
            if let Some(state) = host.bus(bus) {
                match audience {
                    Audience::People => table::bus(out, bus, &state)?,
                    Audience::Programs => json::bus(out, bus, &state.line)?,
                }
            }
        }
        Typed::Bus { bus: BusName(bus), baud, guard, pre, post, echo } => {
            let Some(state) = host.bus(bus) else { return Ok(Next::Stay) };
            let serial = baud.map_or(state.timing.serial, |baud| Serial { baud });
            let mut timing = match bus {
                _ if baud.is_none() => state.timing,
                Bus::T7 => Timing::t7(serial),
                Bus::Isu => Timing { serial, ..Timing::isu() },
            };
            timing.guard = guard.map_or(timing.guard, |us| Micros(u64::from(us)));
            let micros = |us: u32| Micros(u64::from(us));
            let line = line::Settings {
                pre_delay: pre.map_or(state.line.pre_delay, micros),
                post_delay: post.map_or(state.line.post_delay, micros),
                echo: echo.map_or(state.line.echo, |Echo(mode)| mode),
                ..timing.line()
            };
            host.order(Order::Bus { bus, timing, line })?;
            done(audience, out)?;
        }
        Typed::T7 { verb, address, value, axis } => {
            let baud = host.bus(Bus::T7).map_or(Serial::T7_DEFAULT.baud, |state| state.timing.serial.baud);
            host.order(tasks::t7(verb, Rest { address, value, axis }, baud)?)?;
            return Ok(Next::Task(Bus::T7));
        }
        Typed::Isu { verb, address, value } => {
            host.order(tasks::isu(verb, Rest { address: Some(address), value, axis: None })?)?;
            return Ok(Next::Task(Bus::Isu));
        }
        Typed::Counters => {
            for bus in BUSES {
                let Some(state) = host.bus(bus) else { continue };
                match audience {
                    Audience::People => table::counters(out, bus, &state)?,
                    Audience::Programs => {
                        for topic in json::Topic::ALL {
                            json::statistics(out, bus, topic, &state.counters, &state.driver)?;
                        }
                    }
                }
            }
            match (audience, host.lost_characters()) {
                (Audience::People, lost) => writeln!(out, "console\n  {:<18} {lost:>10}", "lost characters")?,
                (Audience::Programs, lost) => writeln!(out, "{{\"console\":{{\"lost\":{lost}}}}}")?,
            }
        }
        Typed::Version => {
            let fields = [("version", Value::Text(host.version())), ("uptime_ms", now.as_millis().into())];
            line(out, audience, "clino", &fields)?;
        }
    }
    Ok(Next::Stay)
}

/// A command that could not be carried out, or an answer that could not be written.
pub enum Failure<'a> {
    Error(Error<'a>),
    Output,
}

impl<'a, E: Into<Error<'a>>> From<E> for Failure<'a> {
    fn from(error: E) -> Self {
        Failure::Error(error.into())
    }
}

impl From<fmt::Error> for Failure<'_> {
    fn from(_: fmt::Error) -> Self {
        Failure::Output
    }
}

fn done(audience: Audience, out: &mut dyn Write) -> fmt::Result {
    match audience {
        Audience::People => out.write_str("done\n"),
        Audience::Programs => out.write_str("{\"done\":true}\n"),
    }
}

fn source<'a>(kind: Kind, address: Option<u8>, axis: Option<u8>) -> Result<Source, Error<'a>> {
    if kind == Kind::Off {
        return Ok(Source::Off);
    }
    let number = address.ok_or(Error::Missing("address"))?;
    Ok(match kind {
        Kind::Off => Source::Off,
        Kind::T7 => Source::T7 { address: tasks::one_t7(number)?, axis: tasks::axis(axis)? },
        Kind::Isu => Source::Isu { address: tasks::one_isu(number)? },
        Kind::Pwm => Source::Pwm {
            input: match number {
                1 => PwmInput::Pwm1,
                2 => PwmInput::Pwm2,
                _ => {
                    let value = u64::from(number);
                    return Err(Refusal::Range { what: "pwm_input", value, least: 1, most: 2 }.into());
                }
            },
        },
    })
}

//! `export`: the configuration as the commands that make it.
//!
//! Pasted into any gateway, they make the same configuration there; pasted back, they change nothing. A diff of two gateways
//! is a diff of two texts. No line is longer than a line may be that is typed. What has no effect on a slot of its kind is
//! left out.
//!
//! A slot begins with `slot`, which sets the defaults of its kind, and goes on with the settings that differ. Buses, Modbus
//! port and console are written whole.

use core::fmt::{self, Display, Write};

use clino_gateway::config::{Kind, SINGLE_AXIS};
use clino_gateway::settings::slot::{self, SETTINGS, differs, id};
use clino_gateway::settings::{self, Form, Setting};
use clino_gateway::{MAX_SLOTS, SlotConfig, Source};

use crate::job::{Job, Outcome};
use crate::line::LONGEST_LINE;
use crate::meter::BUSES;
use crate::reply::Reply;
use crate::settings::{MOST, value};
use crate::value::Value;

/// `export`
pub fn export(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    for bus in BUSES {
        if let Some(state) = job.host.bus(bus) {
            whole(&mut job.reply, bus.name(), settings::bus::settings(bus), &state.settings);
        }
    }
    if let Some(port) = job.host.modbus() {
        whole(&mut job.reply, "modbus", &settings::port::SETTINGS, &port);
    }
    let console = job.host.console();
    whole(&mut job.reply, "console", &settings::console::SETTINGS, &console);
    for number in 0..MAX_SLOTS as u8 {
        if let Some(config) = job.host.config(number.into()) {
            slot(&mut job.reply, number, &config);
        }
    }
    Ok(())
}

/// All settings of a table.
fn whole<T>(reply: &mut Reply<'_>, target: &'static str, table: &'static [Setting<T>], of: &T) {
    let mut lines = Lines::of(target.into(), reply);
    for setting in table {
        lines.set(setting.name, Typed(value(setting, of)), (setting.get)(of) < 0);
    }
    lines.end();
}

/// The source of a slot, and the settings that differ from the defaults of its kind.
#[inline(never)]
fn slot(reply: &mut Reply<'_>, number: u8, config: &SlotConfig) {
    let source = config.source;
    let (kind, address) = (source.kind(), source.address());
    match source {
        Source::T7 { axis, .. } if axis != SINGLE_AXIS => {
            line(reply, format_args!("slot {number} t7 {address} -a {}", axis.get()));
        }
        Source::T7 { .. } | Source::Isu { .. } | Source::Pwm { .. } => {
            line(reply, format_args!("slot {number} {} {address}", kind.name()));
        }
        Source::Off | Source::Incomplete { .. } => line(reply, format_args!("slot {number} off")),
    }
    let mut lines = Lines::of(number.into(), reply);
    if let Source::Incomplete { .. } = source {
        // An unused slot takes any address, and keeps it when its kind is set.
        if address > 0 {
            lines.set("address", address, false);
            lines.end();
        }
        if kind != Kind::Off {
            lines.set("kind", kind.name(), false);
        }
    }
    let usual = SlotConfig::usual(source);
    for setting in
        SETTINGS.iter().filter(|setting| is_told(setting, config) && differs(setting, config, &usual))
    {
        let number = (setting.get)(config);
        let typed = Typed(value(setting, config));
        if setting.id == id::FILTER && number > 0 {
            lines.set(setting.name, format_args!("{typed} {}", config.samples), false);
        } else {
            lines.set(setting.name, typed, number < 0);
        }
    }
    lines.end();
    let name = config.name.as_str();
    if !name.is_empty() {
        line(reply, format_args!("set {number} name \"{name}\""));
    }
}

/// Whether a setting stands in a line of its own: it is not a part of another.
fn is_told(setting: &Setting<SlotConfig>, config: &SlotConfig) -> bool {
    let kind = config.source.kind();
    match setting.id {
        id::KIND | id::ADDRESS => false,
        _ if setting.form == Form::Characters => false,
        id::AXIS => kind == Kind::Off,
        id::SAMPLES => config.filter == clino_gateway::config::Filter::Off,
        id => kind == Kind::Off || slot::applies(id, kind),
    }
}

/// A value as it is typed.
struct Typed<'a>(Value<'a>);

impl Display for Typed<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Value::Flag(on) => out.write_str(if on { "on" } else { "off" }),
            value => write!(out, "{value}"),
        }
    }
}

/// Lines of `set`: as many settings in each as fit.
struct Lines<'r, 'o> {
    target: Value<'static>,
    reply: &'r mut Reply<'o>,
    text: Buffer,
    settings: usize,
    negative: bool,
}

impl<'r, 'o> Lines<'r, 'o> {
    fn of(target: Value<'static>, reply: &'r mut Reply<'o>) -> Lines<'r, 'o> {
        Lines { target, reply, text: Buffer::new(), settings: 0, negative: false }
    }

    /// The next setting. `--` stands before a negative number.
    fn set(&mut self, name: &'static str, typed: impl Display, negative: bool) {
        let mut text = Buffer::new();
        _ = write!(text, " {name} {typed}");
        let room = LONGEST_LINE.saturating_sub(HEAD).saturating_sub(self.text.length);
        // One that takes two settings ends its line.
        if self.settings.saturating_add(2) > MOST || text.length > room {
            self.end();
        }
        _ = self.text.write_str(text.as_str());
        self.settings = self.settings.saturating_add(1);
        self.negative |= negative;
    }

    /// Writes what has not been written.
    fn end(&mut self) {
        if self.settings > 0 {
            let dashes = if self.negative { " --" } else { "" };
            line(self.reply, format_args!("set {}{dashes}{}", self.target, self.text.as_str()));
        }
        (self.text, self.settings, self.negative) = (Buffer::new(), 0, false);
    }
}

/// Characters of the longest `set TARGET --`.
const HEAD: usize = "set console --".len();

fn line(reply: &mut Reply<'_>, text: fmt::Arguments<'_>) {
    _ = if reply.is_for_people() {
        writeln!(reply.out, "{text}")
    } else {
        writeln!(reply.out, "{{\"export\":\"{}\"}}", Escaped(text))
    };
}

/// Text in a JSON string. Printable ASCII, as all that can be typed.
struct Escaped<'a>(fmt::Arguments<'a>);

impl Display for Escaped<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        struct Out<'a, 'b>(&'a mut fmt::Formatter<'b>);
        impl Write for Out<'_, '_> {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                text.chars().try_for_each(|character| {
                    if matches!(character, '"' | '\\') {
                        self.0.write_char('\\')?;
                    }
                    self.0.write_char(character)
                })
            }
        }
        Out(out).write_fmt(self.0)
    }
}

/// Text of a line; what does not fit is left out.
struct Buffer {
    bytes: [u8; LONGEST_LINE],
    length: usize,
}

impl Buffer {
    const fn new() -> Buffer {
        Buffer { bytes: [0; LONGEST_LINE], length: 0 }
    }

    fn as_str(&self) -> &str {
        self.bytes.get(..self.length).and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or("")
    }
}

impl Write for Buffer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let free = self.bytes.get_mut(self.length..).unwrap_or_default();
        let place = free.get_mut(..text.len()).ok_or(fmt::Error)?;
        place.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = byte);
        self.length = self.length.saturating_add(text.len());
        Ok(())
    }
}

//! `export`: the configuration as the commands that make it.
//!
//! Pasted into any gateway, they make the same configuration there; pasted back, they change nothing. A diff of two gateways
//! is a diff of two texts. No line is longer than a line may be that is typed. What has no effect on a slot of its kind is
//! left out.
//!
//! A slot begins with `slot`, which sets the defaults of its kind, and goes on with the settings that differ. Buses, Modbus
//! port and console are written whole.

use clino_gateway::config::{Filter, Kind, SINGLE_AXIS};
use clino_gateway::settings::slot::{self, SETTINGS, differs, id};
use clino_gateway::settings::{self, Definition, Form, Shown, Tabled};
use clino_gateway::{Bus, MAX_SLOTS, SlotConfig, Source};

use crate::job::{Job, Outcome};
use crate::line::LONGEST_LINE;
use crate::out::{Inside, Out};
use crate::reply::Reply;
use crate::rows::FILTER;
use crate::settings::{MOST, shown};
use crate::value::{Value, print};

/// `export`
pub fn export(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    for bus in Bus::ALL {
        if let Some(settings) = &job.host.bus_settings(bus) {
            let table = settings::bus::settings(bus);
            whole(&mut job.reply, bus.name(), &Tabled::new(table, settings));
        }
    }
    if let Some(port) = &job.host.modbus() {
        whole(&mut job.reply, "modbus", &Tabled::new(&settings::port::SETTINGS, port));
    }
    let console = job.host.console();
    whole(&mut job.reply, "console", &Tabled::new(&settings::console::SETTINGS, &console));
    for number in 0..MAX_SLOTS as u8 {
        if let Some(config) = &job.host.config(number.into()) {
            slot(&mut job.reply, number, config);
        }
    }
    Ok(())
}

/// All settings of a table.
#[inline(never)]
fn whole(reply: &mut Reply<'_>, target: &'static str, of: &dyn Shown) {
    let mut lines = Lines::of(target.into(), reply);
    for (place, row) in of.definitions() {
        lines.setting(row, of.value(place), Value::None);
    }
    lines.end();
}

/// The source of a slot, and the settings that differ from the defaults of its kind.
#[inline(never)]
fn slot(reply: &mut Reply<'_>, number: u8, config: &SlotConfig) {
    let source = config.source;
    let (kind, address) = (source.kind(), source.address());
    let (template, axis) = match source {
        Source::T7 { axis, .. } if axis != SINGLE_AXIS => ("slot {0} {1} {2} -a {3}", axis.get()),
        Source::T7 { .. } | Source::Isu { .. } | Source::Pwm { .. } => ("slot {0} {1} {2}", 0),
        Source::Off | Source::Incomplete { .. } => ("slot {0} off", 0),
    };
    line(reply, template, &[number.into(), kind.name().into(), address.into(), axis.into()]);
    let mut lines = Lines::of(number.into(), reply);
    if let Source::Incomplete { .. } = source {
        // An unused slot takes any address, and keeps it when its kind is set.
        if address > 0 {
            lines.set("address", address.into(), Value::None);
            lines.end();
        }
        if kind != Kind::Off {
            lines.set("kind", kind.name().into(), Value::None);
        }
    }
    let usual = SlotConfig::usual(source);
    for setting in &SETTINGS {
        if is_told(setting, config) && differs(setting, config, &usual) {
            let value = (setting.get)(config);
            let is_filter = setting.name == FILTER && value > 0;
            lines.setting(setting, value, if is_filter { config.samples.into() } else { Value::None });
        }
    }
    lines.end();
    let name = config.name.as_str();
    if !name.is_empty() {
        line(reply, "set {0} name {1}", &[number.into(), Value::Quoted(name)]);
    }
}

/// Whether a setting stands in a line of its own: it is not a part of another.
fn is_told(row: &Definition, config: &SlotConfig) -> bool {
    let kind = config.source.kind();
    match row.id {
        id::KIND | id::ADDRESS => false,
        _ if row.form == Form::Characters => false,
        id::AXIS => kind == Kind::Off,
        id::SAMPLES => config.filter == Filter::Off,
        id => kind == Kind::Off || slot::applies(id, kind),
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

    /// The next setting, as it is typed. `--` stands before a negative number.
    #[inline(never)]
    fn setting(&mut self, row: &Definition, value: i64, second: Value<'static>) {
        let typed = match shown(&row.form, value) {
            Value::Flag(on) => Value::Text(if on { "on" } else { "off" }),
            value => value,
        };
        self.set(row.name, typed, second);
        self.negative |= value < 0;
    }

    /// The next setting, with a second value if there is one.
    #[inline(never)]
    fn set(&mut self, name: &'static str, typed: Value<'static>, second: Value<'static>) {
        let template = if matches!(second, Value::None) { " {0} {1}" } else { " {0} {1} {2}" };
        let mut text = Buffer::new();
        print(&mut text, template, &[name.into(), typed, second]);
        let room = LONGEST_LINE.saturating_sub(HEAD).saturating_sub(self.text.length);
        // One that takes two settings ends its line.
        if self.settings.saturating_add(2) > MOST || text.length > room {
            self.end();
        }
        self.text.put(text.bytes());
        self.settings = self.settings.saturating_add(1);
    }

    /// Writes what has not been written.
    #[inline(never)]
    fn end(&mut self) {
        if self.settings > 0 {
            let template = if self.negative { "set {0} --{1}" } else { "set {0}{1}" };
            let text = core::str::from_utf8(self.text.bytes()).unwrap_or("");
            line(self.reply, template, &[self.target, text.into()]);
        }
        (self.text, self.settings, self.negative) = (Buffer::new(), 0, false);
    }
}

/// Characters of the longest `set TARGET --`.
const HEAD: usize = "set console --".len();

#[inline(never)]
fn line(reply: &mut Reply<'_>, template: &str, values: &[Value<'_>]) {
    reply.either("", "{\"export\":\"");
    if reply.is_for_people() {
        reply.print(template, values);
    } else {
        print(&mut Inside { out: reply.out, escapes: true }, template, values);
    }
    reply.either("\n", "\"}\n");
}

/// Text of a line; what does not fit is left out.
struct Buffer {
    text: [u8; LONGEST_LINE],
    length: usize,
}

impl Buffer {
    const fn new() -> Buffer {
        Buffer { text: [0; LONGEST_LINE], length: 0 }
    }

    fn bytes(&self) -> &[u8] {
        self.text.get(..self.length).unwrap_or_default()
    }
}

impl Out for Buffer {
    fn put(&mut self, text: &[u8]) {
        let free = self.text.get_mut(self.length..).unwrap_or_default();
        let taken = free.iter_mut().zip(text).map(|(place, byte)| *place = *byte).count();
        self.length = self.length.saturating_add(taken);
    }
}

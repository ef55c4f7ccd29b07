//! The tables of `docs/console.md` are what `help` says, and what the gateway's settings begin with.
//!
//! `UPDATE=1 cargo test -p clino-console --test console reference` writes them anew, between their markers.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use clino_codec::{isu, t7};
use clino_gateway::config::Kind;
use clino_gateway::settings::{BusSettings, Form, Setting, bus, console, port, slot};
use clino_gateway::{Bus, PwmInput, SlotConfig, Source};

use crate::desk::Desk;

/// Compares what stands between `<!-- begin NAME -->` and `<!-- end -->` with this, or writes it.
fn settle(name: &str, fresh: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/console.md");
    let page = fs::read_to_string(&path).expect("docs/console.md");
    let begin = format!("<!-- begin {name} -->\n");
    let (before, rest) = page.split_once(&begin).expect("the marker");
    let (found, after) = rest.split_once("<!-- end -->").expect("its end");
    if found.trim() == fresh.trim() {
        return;
    }
    assert!(
        std::env::var_os("UPDATE").is_some(),
        "docs/console.md, {name}: UPDATE=1 cargo test -p clino-console --test console reference writes it anew:\n{fresh}"
    );
    fs::write(&path, format!("{before}{begin}\n{}\n\n<!-- end -->{after}", fresh.trim()))
        .expect("it is written");
}

/// The texts of an object whose values are texts without quotes.
fn texts<const N: usize>(object: &str, names: [&str; N]) -> [String; N] {
    names.map(|name| {
        let (_, rest) = object.split_once(&format!("\"{name}\":\"")).expect(name);
        rest.split('"').next().expect("its end").to_owned()
    })
}

/// A cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// Each form of a command's usage, with its name.
fn forms(name: &str, usage: &str) -> String {
    // What may be added to every form stands behind a semicolon.
    let (forms, options) = usage.split_once("; ").unwrap_or((usage, ""));
    let forms: Vec<String> =
        forms.split(" | ").map(|form| format!("`{}`", cell(format!("{name} {form}").trim_end()))).collect();
    let options = if options.is_empty() { String::new() } else { format!("; with `{}`", cell(options)) };
    forms.join(", ") + &options
}

/// Both in one test: they write one file.
#[test]
fn the_reference_is_what_help_says() {
    let mut desk = Desk::new();
    let mut commands = String::from("| command | what it does |\n|---|---|\n");
    let help = desk.type_in("help\r");
    assert!(help.lines().count() > 20);
    for line in help.lines() {
        let [name, usage, text] = texts(line, ["command", "usage", "help"]);
        writeln!(commands, "| {} | {} |", forms(&name, &usage), cell(&text)).expect("a string");
    }
    settle("commands", &commands);

    let help = desk.type_in("help set\r");
    let mut settings = String::new();
    let usual = [
        Source::T7 { address: t7::Address::new(1).expect("an address"), axis: t7::Axis::Two },
        Source::Isu { address: isu::Address::new(1).expect("an address") },
        Source::Pwm { input: PwmInput::Pwm1 },
    ]
    .map(SlotConfig::usual);
    let of_slot = |setting: &Setting<SlotConfig>| {
        let of_kind = |config: &SlotConfig| match setting.id {
            // They are what `slot` is told.
            slot::id::KIND | slot::id::ADDRESS => "-".to_owned(),
            id if slot::applies(id, config.source.kind()) => value(setting, config),
            _ => "-".to_owned(),
        };
        usual.iter().map(of_kind).collect::<Vec<_>>().join(" | ")
    };
    assert_eq!(usual.map(|config| config.source.kind()), [Kind::T7, Kind::Isu, Kind::Pwm]);
    let title = "### A slot: `set N SETTING VALUE`";
    settings += &table(&help, "slot", title, "T7 | ISU | PWM", &slot::SETTINGS, of_slot);
    for (name, which, title) in [
        ("t7", Bus::T7, "### The T7 bus: `set t7 SETTING VALUE`"),
        ("isu", Bus::Isu, "### The ISU bus: `set isu SETTING VALUE`"),
    ] {
        let first = BusSettings::first(which);
        settings += &table(&help, name, title, "default", bus::settings(which), |it| value(it, &first));
    }
    let title = "### The Modbus port: `set modbus SETTING VALUE`";
    let first = clino_modbus::Settings::DEFAULT;
    settings += &table(&help, "modbus", title, "default", &port::SETTINGS, |it| value(it, &first));
    let title = "### The console: `set console SETTING VALUE`";
    let first = console::ConsoleSettings::DEFAULT;
    settings += &table(&help, "console", title, "default", &console::SETTINGS, |it| value(it, &first));
    settle("settings", &settings);
}

/// The settings of one table, as `help set` has them, with what they begin with.
fn table<T>(
    help: &str,
    of: &str,
    title: &str,
    defaults: &str,
    settings: &[Setting<T>],
    default: impl Fn(&Setting<T>) -> String,
) -> String {
    let rule = "---|".repeat(defaults.split('|').count());
    let mut table =
        format!("{title}\n\n| setting | unit | limits | {defaults} | meaning |\n|---|---|---|{rule}---|\n");
    let own = format!("\"of\":\"{of}\"");
    let mut rows = 0;
    for line in help.lines().filter(|line| line.starts_with("{\"setting\"") && line.contains(&own)) {
        let [label, values, text] = texts(line, ["setting", "values", "help"]);
        let with_unit = |it: &Setting<T>| format!("{}_{}", it.name, it.unit.replace('/', "_"));
        let found = settings.iter().find(|it| label == it.name || label == with_unit(it));
        let setting = found.unwrap_or_else(|| panic!("{label} of {of}"));
        let limits = values.strip_suffix(setting.unit).unwrap_or(&values).trim();
        writeln!(
            table,
            "| `{}` | {} | {} | {} | {} |",
            setting.name,
            setting.unit,
            cell(limits),
            default(setting),
            cell(&text)
        )
        .expect("a string");
        rows += 1;
    }
    assert!(rows > 0, "{of}: {help}");
    table + "\n"
}

/// A value as it is typed.
fn value<T>(setting: &Setting<T>, of: &T) -> String {
    let value = (setting.get)(of);
    match setting.form {
        Form::Flag => if value == 0 { "off" } else { "on" }.to_owned(),
        Form::Choice(words) => words[usize::try_from(value).expect("a place")].to_owned(),
        Form::Slot if value < 0 => "none".to_owned(),
        Form::Characters => "-".to_owned(),
        Form::OneOf(_) | Form::Slot => value.to_string(),
        Form::Number { decimals, .. } => {
            let one = 10_i64.pow(decimals.into());
            let text = format!("{}.{:0width$}", value / one, value % one, width = decimals.into());
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
    }
}

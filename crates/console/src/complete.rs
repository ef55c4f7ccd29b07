//! Completion: Tab completes the word before the cursor as far as it is clear which is meant.
//!
//! What can stand there follows from the words before it: a command, its verb, a kind, a setting or its value. Numbers are not
//! completed. Where nothing can be, a blank is put behind the word: a tab in a text that is pasted keeps its words apart.

use clino_codec::angle::Range;
use clino_codec::t7::Direction;
use clino_gateway::Bus;
use clino_gateway::config::Kind;
use clino_gateway::settings::{Form, Setting, bus, console, port, slot};

use crate::command::{Command, Verb};
use crate::line::Line;
use crate::typed::split;
use crate::words::{IsuVerb, T7Verb, Words};

/// Targets of `show` and `set` beside slots, which have numbers.
const TARGETS: &[&str] = &["t7", "isu", "modbus", "console"];
const ON_OFF: &[&str] = &["on", "off"];

/// What can stand at a place of a line.
#[derive(Clone, Copy)]
enum Expected {
    Command,
    One(&'static [&'static str]),
}

impl Expected {
    const NOTHING: Expected = Expected::One(&[]);

    fn get(self, place: usize) -> Option<&'static str> {
        match self {
            Expected::Command => Command::name_at(place),
            Expected::One(words) => words.get(place).copied(),
        }
    }

    fn all(self) -> impl Iterator<Item = &'static str> {
        (0_usize..).map_while(move |place| self.get(place))
    }
}

/// Completes the word before the cursor, with a blank behind it if it is whole.
#[inline(never)]
pub fn complete(line: &mut Line) {
    let before = line.before_cursor();
    let begun = before.bytes().rev().take_while(|&byte| byte != b' ').count();
    let (words, begun) = before.split_at_checked(before.len().saturating_sub(begun)).unwrap_or((before, ""));
    let mut found: Option<&'static str> = None;
    let mut is_whole = !begun.is_empty();
    for rest in expected(words).all().filter_map(|word| word.strip_prefix(begun)) {
        // A word that is whole is meant, even if another begins with it.
        is_whole = found.is_none() || rest.is_empty();
        found = Some(if rest.is_empty() { rest } else { found.map_or(rest, |found| common(found, rest)) });
        if rest.is_empty() {
            break;
        }
    }
    found.unwrap_or("").bytes().for_each(|byte| line.insert(byte));
    if is_whole {
        line.insert(b' ');
    }
}

/// What both begin with.
fn common(one: &'static str, other: &str) -> &'static str {
    let same = one.bytes().zip(other.bytes()).take_while(|(one, other)| one == other).count();
    one.get(..same).unwrap_or("")
}

/// The next of the words before the cursor.
fn next<'a>(rest: &mut &'a str) -> Option<&'a str> {
    let (word, behind) = split(rest);
    *rest = behind;
    (!word.is_empty()).then_some(word)
}

/// What can follow these words.
fn expected(mut words: &str) -> Expected {
    let Some(first) = next(&mut words) else { return Expected::Command };
    let Some(command) = Command::named(first) else { return Expected::NOTHING };
    let behind = words;
    let (second, third) = (next(&mut words), next(&mut words));
    Expected::One(match (command.verb, second, third) {
        (Verb::Help, None, _) => return Expected::Command,
        (Verb::T7, None, _) => T7Verb::NAMES,
        (Verb::T7, Some("scan"), None) => &["all"],
        (Verb::T7, Some("direction"), Some(_)) => Direction::NAMES,
        (Verb::T7, Some("range"), Some(_)) => Range::NAMES,
        (Verb::Isu, None, _) => IsuVerb::NAMES,
        (Verb::Bus, None, _) => Bus::NAMES,
        (Verb::Json, None, _) => ON_OFF,
        (Verb::Slot, Some(_), None) => Kind::NAMES,
        (Verb::Show | Verb::Set, None, _) => TARGETS,
        (Verb::Set, Some(target), _) => {
            let (_, behind) = split(behind);
            match target {
                "t7" => of_settings(behind, &bus::T7_SETTINGS, &bus::NAMES),
                "isu" => of_settings(behind, &bus::ISU_SETTINGS, &bus::NAMES),
                "modbus" => of_settings(behind, &port::SETTINGS, &port::NAMES),
                "console" => of_settings(behind, &console::SETTINGS, &console::NAMES),
                _ => of_settings(behind, &slot::SETTINGS, &slot::NAMES),
            }
        }
        (Verb::Modbus, ..) => of_settings(behind, &port::SETTINGS, &port::NAMES),
        _ => &[],
    })
}

/// What can follow settings and their values: a name, or the words that its value can be.
fn of_settings<T>(
    mut words: &str,
    table: &'static [Setting<T>],
    names: &'static [&'static str],
) -> &'static [&'static str] {
    while let Some(name) = next(&mut words) {
        let Some(setting) = table.iter().find(|setting| setting.name == name) else { return &[] };
        let Some(value) = next(&mut words) else {
            return match setting.form {
                Form::Flag => ON_OFF,
                Form::Choice(words) => words,
                _ => &[],
            };
        };
        // Behind `mean` and `median` stands how many angles they go over.
        if name == "filter" && value != "off" && next(&mut words).is_none() {
            return &[];
        }
    }
    names
}

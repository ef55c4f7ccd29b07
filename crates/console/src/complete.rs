//! Completion: Tab completes the word before the cursor as far as it is clear which is meant.
//!
//! What can stand there follows from the words before it: a command, its verb, a kind, a setting or its value. Numbers are not
//! completed. Where nothing can be, a blank is put behind the word: a tab in a text that is pasted keeps its words apart.

use clino_codec::angle::Range;
use clino_codec::t7::Direction;
use clino_gateway::Bus;
use clino_gateway::config::Kind;
use clino_gateway::settings::Form;

use crate::choice::Choice;
use crate::command::{Command, Verb};
use crate::line::Line;
use crate::rows::{FILTER, TARGETS, Table, of_target, rows};
use crate::typed::split;
use crate::words::{IsuVerb, T7Verb, Words};

const ON_OFF: &[&str] = &["on", "off"];

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
#[inline(never)]
fn expected(mut words: &str) -> Choice {
    let Some(first) = next(&mut words) else { return Choice::Commands };
    let Some(command) = Command::named(first) else { return Choice::NOTHING };
    let behind = words;
    let (second, third) = (next(&mut words), next(&mut words));
    Choice::Words(match (command.verb, second, third) {
        (Verb::Help, None, _) => return Choice::Commands,
        #[cfg(feature = "commissioning")]
        (Verb::T7, second, third) => match (second, third) {
            (None, _) => T7Verb::NAMES,
            (Some("scan"), None) => &["all"],
            (Some("direction"), Some(_)) => Direction::NAMES,
            (Some("range"), Some(_)) => Range::NAMES,
            _ => &[],
        },
        #[cfg(all(feature = "commissioning", feature = "isu"))]
        (Verb::Isu, None, _) => IsuVerb::NAMES,
        (Verb::Bus, None, _) => Bus::NAMES,
        (Verb::Json, None, _) => ON_OFF,
        (Verb::Slot, Some(_), None) => Kind::NAMES,
        (Verb::Show | Verb::Set, None, _) => TARGETS,
        (Verb::Set, Some(target), _) => {
            let (_, behind) = split(behind);
            return of_settings(behind, of_target(target));
        }
        #[cfg(feature = "modbus")]
        (Verb::Modbus, ..) => return of_settings(behind, of_target("modbus")),
        _ => &[],
    })
}

/// What can follow settings and their values: a name, or the words that its value can be.
#[inline(never)]
fn of_settings(mut words: &str, table: Table) -> Choice {
    while let Some(name) = next(&mut words) {
        let Some((_, row)) = rows(table).find(|(_, row)| row.name == name) else { return Choice::NOTHING };
        let Some(value) = next(&mut words) else {
            return Choice::Words(match row.form {
                Form::Flag => ON_OFF,
                Form::Choice(words) => words,
                _ => &[],
            });
        };
        // Behind `mean` and `median` stands how many angles they go over.
        if name == FILTER && value != "off" && next(&mut words).is_none() {
            return Choice::NOTHING;
        }
    }
    Choice::Settings(table)
}

//! The picture of the levels and interrupts of the firmware, and what they share, from its sources.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use crate::page::{root, settle};

/// Bits of a priority that the part has (RM0090 section 12).
const PRIORITY_BITS: u32 = 4;

/// A task of the RTIC application, or its idle function.
#[derive(Debug, Default)]
struct Task {
    name: String,
    /// RTIC's: the higher, the more urgent; 0 for the main loop.
    priority: u32,
    /// The interrupt that it handles, or that it is dispatched by.
    interrupt: Option<String>,
    is_software: bool,
    shared: Vec<String>,
    /// The tasks that it wakes.
    wakes: Vec<String>,
}

fn source(name: &str) -> String {
    let path = root().join("src").join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    // Comments left out.
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
        .fold(String::new(), |all, line| all + line + "\n")
}

/// What stands between `open` and the `close` that belongs to it, right behind `begin`.
fn enclosed<'a>(text: &'a str, begin: &str, open: char, close: char) -> Option<&'a str> {
    let from = text.find(begin)? + begin.len();
    let mut depth = 1_u32;
    for (at, letter) in text[from..].char_indices() {
        depth = if letter == open {
            depth + 1
        } else if letter == close {
            depth - 1
        } else {
            depth
        };
        if depth == 0 {
            return Some(&text[from..from + at]);
        }
    }
    None
}

fn is_part(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

/// The word behind `key`.
fn word<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(key)?;
    rest.split(|letter| !is_part(letter)).next()
}

fn list(text: &str, key: &str) -> Vec<String> {
    let inner = enclosed(text, key, '[', ']').unwrap_or("");
    inner.split(',').map(|item| item.trim().to_owned()).filter(|item| !item.is_empty()).collect()
}

/// The file with the functions that wake a level, for all others: each is named after its level.
const WAKERS: &str = "shared";

/// The tasks that are woken in this code.
fn woken(code: &str) -> Vec<String> {
    let named = code.split("shared::wake_").skip(1).filter_map(|rest| rest.split_once("()"));
    named.map(|(level, _)| format!("{level}_level")).collect()
}

/// Files whose functions are called in this code by their names alone, because `main.rs` imports them.
fn imported(main: &str, code: &str) -> Vec<String> {
    let paths = main.lines().filter_map(|line| line.trim().strip_prefix("use ")?.strip_suffix(';'));
    let called = paths
        .filter_map(|path| path.rsplit_once("::"))
        .filter(|(_, name)| code.contains(&format!("{name}(")));
    let modules = called.map(|(module, _)| module.trim_start_matches("crate::").to_owned());
    modules.filter(|module| root().join("src").join(format!("{module}.rs")).exists()).collect()
}

/// The tasks, as `main.rs` lists them.
fn tasks() -> Vec<Task> {
    let main = source("main.rs");
    let mut dispatchers = list(&main, "dispatchers = [");
    let mut tasks: Vec<Task> = Vec::new();
    let begins = main.match_indices("#[task(").chain(main.match_indices("#[idle("));
    for (at, begin) in begins {
        let rest = &main[at..];
        let head = enclosed(rest, begin, '(', ')').expect("the end of an attribute");
        let body = enclosed(&rest[begin.len() + head.len()..], "{", '{', '}').expect("a body");
        let mut wakes = woken(body);
        // What is done in a file of its own.
        for module in body.split("::").filter_map(|before| before.rsplit(|letter| !is_part(letter)).next()) {
            if module != WAKERS && root().join("src").join(format!("{module}.rs")).exists() {
                wakes.extend(woken(&source(&format!("{module}.rs"))));
            }
        }
        wakes.extend(imported(&main, body).iter().flat_map(|module| woken(&source(&format!("{module}.rs")))));
        wakes.sort();
        wakes.dedup();
        let is_idle = begin == "#[idle(";
        let interrupt = word(head, "binds = ").map(str::to_owned);
        tasks.push(Task {
            name: word(&rest[begin.len() + head.len()..], "fn ").expect("a name").to_owned(),
            priority: word(head, "priority = ")
                .map_or(u32::from(!is_idle), |it| it.parse().expect("a priority")),
            is_software: interrupt.is_none() && !is_idle,
            interrupt,
            shared: list(head, "shared = ["),
            wakes,
        });
    }
    tasks.sort_by_key(|task| std::cmp::Reverse(task.priority));
    // The most urgent priority has the last dispatcher.
    let mut given = BTreeMap::new();
    for task in tasks.iter_mut().filter(|task| task.is_software) {
        let dispatcher =
            given.entry(task.priority).or_insert_with(|| dispatchers.pop().expect("a dispatcher"));
        task.interrupt = Some(dispatcher.clone());
    }
    tasks
}

/// The handlers outside of RTIC: name, and the file it is in.
fn exceptions() -> Vec<(&'static str, &'static str)> {
    let handlers = [("NonMaskableInt", "faults"), ("HardFault", "faults"), ("SysTick", "watchdog")];
    for (name, file) in handlers {
        let is_there = source(&format!("{file}.rs")).contains(&format!("unsafe extern \"C\" fn {name}()"));
        assert!(is_there, "src/{file}.rs handles {name}");
    }
    assert!(source("board.rs").contains("set_priority(SystemHandler::SysTick, 0)"), "SysTick is above all");
    handlers.to_vec()
}

#[test]
fn the_picture_of_the_levels_is_true() {
    let tasks = tasks();
    assert!(tasks.len() > 5 && tasks.iter().any(|task| task.is_software), "{tasks:?}");
    let mut picture = String::from("```mermaid\ngraph TD\n");
    picture += "  subgraph above [above all: not held off by any lock]\n";
    for (name, file) in exceptions() {
        writeln!(picture, "    {name}[\"{file}.rs<br/>{name}\"]").expect("a string");
    }
    picture += "  end\n";
    let mut last = None;
    for task in &tasks {
        if last != Some(task.priority) {
            if last.is_some() {
                picture += "  end\n";
            }
            let of_core = (1 << PRIORITY_BITS) - task.priority;
            let note = if task.priority == 0 {
                "the main loop".to_owned()
            } else {
                format!("priority {}, of the core {of_core}", task.priority)
            };
            writeln!(picture, "  subgraph level{} [{note}]", task.priority).expect("a string");
        }
        last = Some(task.priority);
        let kind = if task.is_software { "software task, " } else { "" };
        let interrupt =
            task.interrupt.as_deref().map(|name| format!("<br/>{kind}{name}")).unwrap_or_default();
        writeln!(picture, "    {}[\"{}{interrupt}\"]", task.name, task.name).expect("a string");
    }
    picture += "  end\n";
    for task in &tasks {
        for woken in &task.wakes {
            writeln!(picture, "  {} --> {woken}", task.name).expect("a string");
        }
    }
    picture += "```\n";
    settle("architecture.md", "levels", &picture);
}

#[test]
fn the_table_of_what_they_share_is_true() {
    let tasks = tasks();
    let mut resources: BTreeMap<&str, Vec<&Task>> = BTreeMap::new();
    for task in &tasks {
        for name in &task.shared {
            resources.entry(name).or_default().push(task);
        }
    }
    let mut rows: Vec<(u32, String)> = resources
        .iter()
        .map(|(name, tasks)| {
            let ceiling = tasks.iter().map(|task| task.priority).max().expect("a task");
            let names: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
            (ceiling, format!("| `{name}` | {ceiling} | {} |\n", names.join(", ")))
        })
        .collect();
    rows.sort_by_key(|(ceiling, _)| std::cmp::Reverse(*ceiling));
    let table: String = rows.into_iter().map(|(_, row)| row).collect();
    settle(
        "architecture.md",
        "shared",
        &format!("| resource | ceiling | shared by |\n|---|---|---|\n{table}"),
    );
}

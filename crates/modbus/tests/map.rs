//! The map is sound, and what is written about it is what it says.
//!
//! `UPDATE=1 cargo test -p clino-modbus --test map` writes `docs/modbus.csv`, and the tables of `docs/modbus.md` between
//! their markers, anew.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;

use clino_gateway::BusFault;
use clino_gateway::summary::Signals;
use clino_modbus::command::{Command, Outcome};
use clino_modbus::map::{BLOCKS, Block, Entry, Form, Item};
use clino_modbus::{Kind, SLOTS, Status, slot_bits};
use clino_recovery::{Cause, Clock, Duty, Mode};

const UPDATE: &str = "UPDATE=1 cargo test -p clino-modbus --test map";

fn docs(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name)
}

/// Compares with what is on disk, or writes it.
fn settle(name: &str, fresh: &str) {
    let path = docs(name);
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, fresh).expect("docs can be written");
        return;
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    let line = found.lines().zip(fresh.lines()).position(|(found, fresh)| found != fresh);
    assert!(
        found == fresh,
        "docs/{name} is not what the map says (line {line:?}); to write it anew: {UPDATE}"
    );
}

fn entries() -> impl Iterator<Item = (&'static Block, &'static Entry)> {
    BLOCKS.iter().flat_map(|block| block.entries.iter().map(move |entry| (block, entry)))
}

#[test]
fn blocks_are_in_order_and_apart() {
    for pair in BLOCKS.windows(2) {
        let end = u32::from(pair[0].base) + u32::from(pair[0].stride) * u32::from(pair[0].count);
        assert!(end <= u32::from(pair[1].base), "{} and {}", pair[0].name, pair[1].name);
    }
    let last = BLOCKS.last().expect("blocks");
    assert!(u32::from(last.base) + u32::from(last.stride) * u32::from(last.count) <= 0x1_0000);
}

#[test]
fn entries_are_in_order_and_apart() {
    for block in BLOCKS {
        for pair in block.entries.windows(2) {
            assert!(
                pair[0].offset + pair[0].registers() <= pair[1].offset,
                "{} {}",
                block.name,
                pair[1].name
            );
        }
        let last = block.entries.last().expect("entries");
        assert!(last.offset + last.registers() <= block.stride, "{}", block.name);
        for entry in block.entries {
            assert!(entry.count >= 1);
            // A number's index is that of its block or that of its array.
            assert!(block.count == 1 || (entry.count == 1 && entry.first == 0), "{}", entry.name);
        }
    }
}

/// A 32-bit number that begins at an odd address would be no fault, but surprise somebody.
#[test]
fn wide_numbers_are_even() {
    for (block, entry) in entries().filter(|(_, entry)| entry.form.registers() == 2) {
        assert!((block.base + entry.offset).is_multiple_of(2), "{} {}", block.name, entry.name);
    }
}

/// One request writes one thing: behind what can be written of one, there is a register that cannot be.
#[test]
fn no_write_reaches_the_next_instance() {
    for block in BLOCKS.iter().filter(|block| block.entries.iter().any(|entry| entry.limits.is_some())) {
        let last = block.entries.last().expect("entries");
        assert!(last.offset + last.registers() < block.stride, "{}", block.name);
    }
}

#[test]
fn limits_fit_their_numbers() {
    for (_, entry) in entries() {
        let Some((least, most)) = entry.limits else { continue };
        assert!(least < most, "{}", entry.name);
        match entry.form {
            Form::U16 => assert!(least >= 0 && most <= 0xFFFF, "{}", entry.name),
            Form::U32 => assert!(least >= 0, "{}", entry.name),
            Form::I32 => {}
            other => panic!("{}: {other:?} is not for writing", entry.name),
        }
    }
}

/// The addresses that clients are told to begin with.
#[test]
fn addresses_that_never_move() {
    let at = |address: u16| {
        entries()
            .find(|(block, entry)| block.base + entry.offset == address)
            .map(|(_, entry)| (entry.name, entry.form, entry.first, entry.count))
    };
    assert_eq!(at(0x0000), Some(("magic", Form::U32, 0, 1)));
    assert_eq!(at(0x000C), Some(("test_number", Form::U32, 0, 1)));
    assert_eq!(at(0x000E), Some(("test_angle", Form::F32, 0, 1)));
    assert_eq!(at(0x0010), Some(("online_0_31", Form::U32, 0, 1)));
    assert_eq!(at(0x0020), Some(("angle", Form::I32, 0, 32)));
    assert_eq!(at(0x0060), Some(("age", Form::U16, 0, 32)));
    assert_eq!(at(0x0080), Some(("angle", Form::I32, 32, 16)));
    assert_eq!(at(0x00A0), Some(("age", Form::U16, 32, 16)));
    assert_eq!(at(0x00B0), Some(("status", Form::U16, 0, 48)));
    assert_eq!(at(0x0100), Some(("status", Form::U16, 0, 1)));
    assert_eq!(at(0x1000), Some(("enabled", Form::U16, 0, 1)));
    assert_eq!(at(0x1F00), Some(("command", Form::U16, 0, 1)));
    let [fast, fast2] = [1, 2].map(|index| BLOCKS[index].stride);
    assert_eq!((fast, fast2, SLOTS), (96, 96, 48));
}

#[test]
fn codes_are_distinct() {
    let distinct = |codes: Vec<u16>| codes.len() == codes.iter().collect::<BTreeSet<_>>().len();
    assert!(distinct(Status::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(BusFault::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Kind::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Outcome::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Command::ALL.iter().map(|&command| command as u16).collect()));
    assert!(distinct(Signals::ALL.iter().map(|row| row.0.bits()).collect()));
    assert!(distinct(Cause::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Mode::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Clock::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Duty::ALL.iter().map(|&duty| duty as u16).collect()));
    assert!(distinct(slot_bits::ALL.iter().map(|row| row.0).collect()));
}

#[test]
fn the_list_is_what_the_map_says() {
    let list = list();
    let mut names = BTreeSet::new();
    for line in list.lines().skip(1) {
        let name = line.split(',').nth(2).expect("a name");
        assert!(names.insert(name), "{name} twice");
    }
    settle("modbus.csv", &list);
}

#[test]
fn the_description_is_what_the_map_says() {
    let sections = sections();
    let old = std::fs::read_to_string(docs("modbus.md")).expect("docs/modbus.md");
    let mut fresh = String::new();
    let mut rest = old.as_str();
    let mut used = BTreeSet::new();
    while let Some((before, after)) = rest.split_once("<!-- begin ") {
        let (name, after) = after.split_once(" -->").expect("the end of a marker");
        let (_, after) = after.split_once("<!-- end -->").expect("the end of a table");
        let table = sections.get(name).unwrap_or_else(|| panic!("no table {name}"));
        used.insert(name);
        write!(fresh, "{before}<!-- begin {name} -->\n\n{table}\n<!-- end -->").expect("a string");
        rest = after;
    }
    fresh.push_str(rest);
    assert_eq!(used, sections.keys().copied().collect(), "every table has its place");
    settle("modbus.md", &fresh);
}

/// One line for each number of the map.
fn list() -> String {
    let mut list = String::from(
        "address_hex,register,name,type,registers,byte_order,access,unit,least,most,invalid,description\n",
    );
    for block in BLOCKS {
        for instance in 0..block.count {
            for entry in block.entries {
                for element in 0..u16::from(entry.count) {
                    let offset = instance * block.stride + element * entry.form.registers();
                    let address = block.base + entry.offset + offset;
                    let mut name = String::new();
                    match block.prefix {
                        "slot" => write!(name, "slot{instance:02}_").expect("a string"),
                        "" => {}
                        prefix => write!(name, "{prefix}{instance}_").expect("a string"),
                    }
                    name.push_str(entry.name);
                    if entry.count > 1 {
                        write!(name, "_{:02}", u16::from(entry.first) + element).expect("a string");
                    }
                    let (access, least, most) = match entry.limits {
                        Some((least, most)) => ("rw", least.to_string(), most.to_string()),
                        None => ("r", String::new(), String::new()),
                    };
                    let text = entry.text.replace('"', "'").replace('*', "");
                    writeln!(
                        list,
                        "{address:04X},{},{name},{},{},{},{access},{},{least},{most},{},\"{text}\"",
                        address + 1,
                        type_name(entry.form),
                        entry.form.registers(),
                        byte_order(entry.form),
                        entry.unit,
                        if entry.is_optional() { invalid(entry.form) } else { String::new() },
                    )
                    .expect("a string");
                }
            }
        }
    }
    list
}

fn type_name(form: Form) -> &'static str {
    match form {
        Form::U16 => "uint16",
        Form::I16 => "int16",
        Form::U32 => "uint32",
        Form::I32 | Form::I32Swapped => "int32",
        Form::F32 | Form::F32Swapped => "float32",
    }
}

fn byte_order(form: Form) -> &'static str {
    match form {
        Form::U16 | Form::I16 => "AB",
        Form::U32 | Form::I32 | Form::F32 => "ABCD",
        Form::I32Swapped | Form::F32Swapped => "CDAB",
    }
}

fn invalid(form: Form) -> String {
    format!("0x{:0width$X}", form.sentinel(), width = usize::from(form.registers()) * 4)
}

/// The tables of the description.
fn sections() -> BTreeMap<&'static str, String> {
    let mut sections = BTreeMap::new();
    let mut overview = String::from("| addresses | registers | what |\n|---|---|---|\n");
    let mut blocks = String::new();
    for block in BLOCKS {
        let last = block.base + block.stride * block.count - 1;
        let place = match block.count {
            1 => String::new(),
            count => format!("{count} blocks, 0x{:02X} apart. ", block.stride),
        };
        writeln!(
            overview,
            "| 0x{:04X} to 0x{last:04X} | {} to {} | **{}**: {place}{} |",
            block.base,
            block.base + 1,
            last + 1,
            block.name,
            block.text
        )
        .expect("a string");
        writeln!(blocks, "### 0x{:04X}: {}\n\n{}\n", block.base, block.name, block.text).expect("a string");
        if block.count > 1 {
            writeln!(
                blocks,
                "Address of block n: 0x{:04X} + 0x{:02X} · n, n = 0 to {}. The addresses below are those of block 0.\n",
                block.base,
                block.stride,
                block.count - 1
            )
            .expect("a string");
        }
        let writable = block.entries.iter().any(|entry| entry.limits.is_some());
        blocks.push_str(if writable {
            "| address | register | name | type | unit | write | what |\n|---|---|---|---|---|---|---|\n"
        } else {
            "| address | register | name | type | unit | what |\n|---|---|---|---|---|---|\n"
        });
        for entry in block.entries {
            let address = block.base + entry.offset;
            let order = match entry.form.is_swapped() {
                true => " CDAB",
                false => "",
            };
            let (times, numbers) = match entry.count {
                1 => (String::new(), String::new()),
                // Not one for each slot.
                count if matches!(entry.item, Item::Start(_)) => (format!(" × {count}"), String::new()),
                count => (
                    format!(" × {count}"),
                    format!("; slots {} to {}", entry.first, u16::from(entry.first) + u16::from(count) - 1),
                ),
            };
            let limits = match (writable, entry.limits) {
                (false, _) => String::new(),
                (true, None) => " - |".into(),
                (true, Some((i32::MIN, i32::MAX))) => " any |".into(),
                (true, Some((least, most))) => format!(" {least} to {most} |"),
            };
            writeln!(
                blocks,
                "| 0x{address:04X} | {} | {} | {}{order}{times} | {} |{limits} {}{numbers} |",
                address + 1,
                entry.name,
                type_name(entry.form),
                entry.unit,
                entry.text
            )
            .expect("a string");
        }
        blocks.push('\n');
    }
    sections.insert("overview", overview);
    sections.insert("blocks", blocks.trim_end().to_owned() + "\n");
    let codes = |rows: &[(u16, &str, &str)]| {
        rows.iter()
            .fold(String::from("| code | name | meaning |\n|---|---|---|\n"), |table, (code, name, text)| {
                table + &format!("| {code} | {name} | {text} |\n")
            })
    };
    let bits = |rows: &[(u16, &str, &str)]| {
        rows.iter().fold(
            String::from("| bit | value | name | meaning |\n|---|---|---|---|\n"),
            |table, row| {
                let (value, name, text) = row;
                table + &format!("| {} | 0x{value:04X} | {name} | {text} |\n", value.trailing_zeros())
            },
        )
    };
    sections.insert("status", codes(&Status::ALL.map(|(code, name, text)| (code as u16, name, text))));
    let faults = BusFault::ALL.map(|(fault, text)| (fault as u16, fault.name(), text));
    let well = (0, "none", "somebody answers, or nobody is asked");
    sections.insert("bus faults", codes(&[&[well][..], &faults].concat()));
    sections.insert("kinds", codes(&Kind::ALL.map(|(code, name, text)| (code as u16, name, text))));
    sections.insert("outcomes", codes(&Outcome::ALL.map(|(code, name, text)| (code as u16, name, text))));
    sections.insert("causes", codes(&Cause::ALL.map(|(code, name, text)| (code as u16, name, text))));
    sections.insert("modes", codes(&Mode::ALL.map(|(code, text)| (code as u16, code.name(), text))));
    sections.insert("clocks", codes(&Clock::ALL.map(|(code, text)| (code as u16, code.name(), text))));
    sections.insert("duties", codes(&Duty::ALL.map(|duty| (duty as u16, duty.name(), duty.meaning()))));
    sections.insert(
        "gateway status",
        bits(&Signals::ALL.map(|(signal, name, text)| (signal.bits(), name, text))),
    );
    sections.insert("flags", bits(&slot_bits::ALL));
    let head = String::from("| code | name | target | value | arm key | what |\n|---|---|---|---|---|---|\n");
    let commands = Command::ALL.iter().fold(head, |table, command| {
        let row = command.description();
        let key = if command.takes_key() { "yes" } else { "-" };
        let code = *command as u16;
        table
            + &format!("| {code} | {} | {} | {} | {key} | {} |\n", row.name, row.target, row.value, row.text)
    });
    sections.insert("commands", commands);
    sections
}

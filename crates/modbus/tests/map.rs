//! The map is sound, and what is written about it is what it says.
//!
//! `UPDATE=1 cargo test -p clino-modbus --test map` writes `docs/modbus.csv`, and the tables of `docs/modbus.md` between
//! their markers, anew.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;

use clino_gateway::config::Kind;
use clino_gateway::summary::Signals;
use clino_gateway::task::Reason;
use clino_gateway::{Alarm, BusFault, Status};
use clino_modbus::command::{Command, Outcome, Target};
use clino_modbus::map::{
    BLOCKS, Block, BusItem, CommandItem, DetailItem, Entry, Form, GatewayItem, Item, ReadingItem, StartItem,
};
use clino_modbus::{SLOTS, slot_bits};
use clino_recovery::{Clock, Mode, MonitoredTask, StartCause};

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

/// A 32-bit number that begins at an odd address would be no fault, but a surprise.
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
        assert!(least <= most, "{}", entry.name);
        match entry.form {
            Form::U16 => assert!(least >= 0 && most <= 0xFFFF, "{}", entry.name),
            Form::I16 => assert!(least >= -0x8000 && most <= 0x7FFF, "{}", entry.name),
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
    assert!(distinct(Status::ALL.iter().map(|status| status.code().into()).collect()));
    assert!(distinct(BusFault::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Kind::ALL.iter().map(|&kind| kind as u16).collect()));
    assert!(distinct(Outcome::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Reason::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Command::ALL.iter().map(|&command| command as u16).collect()));
    assert!(distinct(Signals::ALL.iter().map(|row| row.0.bits()).collect()));
    assert!(distinct(StartCause::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Mode::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(Clock::ALL.iter().map(|row| row.0 as u16).collect()));
    assert!(distinct(MonitoredTask::ALL.iter().map(|&duty| duty as u16).collect()));
    assert!(distinct(slot_bits::ALL.iter().map(|row| row.0).collect()));
}

/// Active alarms in the low bits, unacknowledged ones above them.
fn alarm_bits() -> [(u16, &'static str, String); 8] {
    let names = ["high", "low", "rate", "no_value"];
    let waiting =
        ["high_unacknowledged", "low_unacknowledged", "rate_unacknowledged", "no_value_unacknowledged"];
    std::array::from_fn(|bit| {
        let (alarm, name, text) = Alarm::ALL[bit % 4];
        assert_eq!((alarm as usize, name), (bit % 4, names[bit % 4]));
        match bit {
            0..4 => (1 << bit, name, text.into()),
            _ => (1 << bit, waiting[bit % 4], format!("*{name}* is not acknowledged")),
        }
    })
}

#[test]
fn the_list_is_what_the_map_says() {
    let list = list();
    let mut names = BTreeSet::new();
    for line in list.lines().skip(1) {
        let name = line.split(',').nth(3).expect("a name");
        assert!(names.insert(name), "{name} twice");
    }
    settle("modbus.csv", &list);
}

/// A configuration of Telegraf's Modbus input: angles, ages and status of the first eight slots, the gateway as a whole.
#[test]
fn the_recipe_is_what_the_map_says() {
    let list = list();
    let wanted = |name: &str| {
        let slot = name.rsplit('_').next().and_then(|number| number.parse::<u8>().ok());
        let of_slot = ["angle_f32_", "age_", "status_"].iter().any(|begin| name.starts_with(begin));
        let of_gateway = ["gateway_status", "slots_enabled", "slots_ok", "uptime"].contains(&name);
        of_gateway || of_slot && slot.is_some_and(|slot| slot < 8) && !name.contains("cdab")
    };
    let mut recipe = String::from(TELEGRAF);
    for line in list.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let (address, name, kind, registers) = (fields[0], fields[3], fields[4], fields[5]);
        if !wanted(name) {
            continue;
        }
        let address: u16 = address.parse().expect("a number");
        let addresses = match registers {
            "1" => format!("[{address}]"),
            _ => format!("[{address}, {}]", address + 1),
        };
        let kind = kind.replace("uint", "UINT").replace("int", "INT").replace("float32", "FLOAT32-IEEE");
        writeln!(
            recipe,
            "    {{ name = \"{name}\", byte_order = \"{}\", data_type = \"{kind}\", scale = 1.0, address = {addresses} }},",
            fields[6]
        )
        .expect("a string");
    }
    recipe.push_str("  ]\n");
    settle("telegraf.conf", &recipe);
}

/// The beginning of the recipe.
const TELEGRAF: &str = "\
# Telegraf reads a clino gateway over Modbus RTU: `telegraf --config docs/telegraf.conf --test`.
# Made of the register map by `UPDATE=1 cargo test -p clino-modbus --test map`; all registers: docs/modbus.csv.
# Angles are degrees, NaN while there is none; ages are milliseconds, 65535 for none; the codes of status_*: docs/modbus.md.
[[inputs.modbus]]
  name = \"clino\"
  slave_id = 1
  timeout = \"1s\"
  controller = \"file:///dev/ttyUSB0\"
  baud_rate = 19200
  data_bits = 8
  parity = \"E\"
  stop_bits = 1
  transmission_mode = \"RTU\"
  holding_registers = [
";

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
        "address,address_hex,register,name,type,registers,byte_order,access,scale,unit,least,most,invalid,values,\
         description\n",
    );
    for block in BLOCKS {
        for instance in 0..block.count {
            for entry in block.entries {
                for element in 0..u16::from(entry.count) {
                    let offset = instance * block.stride + element * entry.form.registers();
                    let address = block.base + entry.offset + offset;
                    let name = name(block, instance, entry, element);
                    let (access, least, most) = match entry.limits {
                        // It reads 0: what is commanded is not kept.
                        Some((least, most)) if matches!(entry.item, Item::Command(_)) => {
                            ("w", least.to_string(), most.to_string())
                        }
                        Some((least, most)) => ("rw", least.to_string(), most.to_string()),
                        None => ("r", String::new(), String::new()),
                    };
                    let (scale, unit) = scale(entry.unit);
                    let text = text(entry).replace('"', "'").replace('*', "");
                    writeln!(
                        list,
                        "{address},0x{address:04X},{},{name},{},{},{},{access},{scale},{unit},{least},{most},{},{},\"{text}\"",
                        address + 1,
                        type_name(entry.form),
                        entry.form.registers(),
                        byte_order(entry.form),
                        if entry.is_optional() { invalid(entry.form) } else { String::new() },
                        values(entry),
                    )
                    .expect("a string");
                }
            }
        }
    }
    list
}

/// The name of a number in the list.
fn name(block: &Block, instance: u16, entry: &Entry, element: u16) -> String {
    let of = match block.prefix {
        "slot" => format!("slot{instance:02}_"),
        "" => String::new(),
        prefix if block.count == 1 => format!("{prefix}_"),
        prefix => format!("{prefix}{instance}_"),
    };
    let number = match entry.count {
        1 => String::new(),
        _ => format!("_{:02}", u16::from(entry.first) + element),
    };
    format!("{of}{}{}{number}", entry.prefix, entry.name)
}

/// How much one of a number is, and in which unit.
fn scale(unit: &str) -> (&str, &str) {
    match unit {
        "mdeg" => ("0.001", "deg"),
        "mdeg/s" => ("0.001", "deg/s"),
        "code" | "bits" | "" => ("1", ""),
        unit => match unit.split_once(' ') {
            Some((scale, unit)) => (scale, unit),
            None if unit.parse::<f64>().is_ok() => (unit, ""),
            None => ("1", unit),
        },
    }
}

/// The names of a number's codes, or of its bits by their values.
fn values(entry: &Entry) -> String {
    let codes = |rows: Vec<(u32, &str)>| {
        rows.iter().map(|(code, name)| format!("{code}={name}")).collect::<Vec<_>>().join("|")
    };
    let bits = |rows: Vec<(u16, &str)>| {
        rows.iter().map(|(value, name)| format!("0x{value:04X}={name}")).collect::<Vec<_>>().join("|")
    };
    match entry.item {
        Item::Reading(ReadingItem::Status) | Item::Detail(DetailItem::LastError) => {
            let mut rows = Status::ALL.map(|status| (status.code().into(), status.name()));
            rows.sort_unstable();
            codes(rows.into())
        }
        Item::Detail(DetailItem::Kind) => codes(Kind::ALL.map(|kind| (kind as u32, kind.name())).into()),
        Item::Detail(DetailItem::Alarms) => {
            bits(alarm_bits().into_iter().map(|(bit, name, _)| (bit, name)).collect())
        }
        Item::Detail(DetailItem::Flags) => bits(slot_bits::ALL.map(|(bit, name, _)| (bit, name)).into()),
        Item::Gateway(GatewayItem::Status) => {
            bits(Signals::ALL.map(|(bit, name, _)| (bit.bits(), name)).into())
        }
        Item::Bus(BusItem::Fault) => {
            let faults = BusFault::ALL.map(|(fault, _)| (fault as u32, fault.name()));
            codes([&[(0, "none")][..], &faults].concat())
        }
        Item::Start(StartItem::Cause | StartItem::CrashCause) => {
            codes(StartCause::ALL.map(|(cause, name, _)| (cause as u32, name)).into())
        }
        Item::Start(StartItem::Mode) => codes(Mode::ALL.map(|(mode, _)| (mode as u32, mode.name())).into()),
        Item::Start(StartItem::Clock) => {
            codes(Clock::ALL.map(|(clock, _)| (clock as u32, clock.name())).into())
        }
        Item::Command(CommandItem::Command | CommandItem::Last) => {
            codes(Command::ALL.map(|command| (command as u32, command.description().name)).into())
        }
        Item::Command(CommandItem::Outcome) => {
            codes(Outcome::ALL.map(|(outcome, name, _)| (outcome as u32, name)).into())
        }
        Item::Command(CommandItem::Reason) => {
            codes(Reason::ALL.iter().map(|&(reason, name, _)| (reason as u32, name)).collect())
        }
        _ => codes((0..).zip(entry.words.iter().copied()).collect()),
    }
}

/// What a number is, in words, with the codes it has.
fn text(entry: &Entry) -> String {
    let codes = entry.words.iter().enumerate().map(|(code, word)| format!("{code}: {word}"));
    match codes.collect::<Vec<_>>().join(", ") {
        codes if codes.is_empty() => entry.text.into(),
        codes => format!("{}. {codes}", entry.text),
    }
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
                count if matches!(entry.item, Item::Start(_) | Item::Result(_)) => {
                    (format!(" × {count}"), String::new())
                }
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
                format_args!("{}{}", entry.prefix, entry.name),
                type_name(entry.form),
                entry.unit,
                text(entry)
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
    let mut statuses = Status::ALL.map(|status| (status.code().into(), status.name(), status.meaning()));
    statuses.sort_unstable();
    sections.insert("status", codes(&statuses));
    let faults = BusFault::ALL.map(|(fault, text)| (fault as u16, fault.name(), text));
    let well = (0, "none", "a node answers, or none is asked");
    sections.insert("bus faults", codes(&[&[well][..], &faults].concat()));
    sections.insert("kinds", codes(&Kind::ALL.map(|kind| (kind as u16, kind.name(), kind.meaning()))));
    sections.insert("outcomes", codes(&Outcome::ALL.map(|(code, name, text)| (code as u16, name, text))));
    let reasons: Vec<_> =
        Reason::ALL.iter().map(|&(code, name, text)| (code as u16, name, text.trim())).collect();
    sections.insert("reasons", codes(&reasons));
    sections.insert("causes", codes(&StartCause::ALL.map(|(code, name, text)| (code as u16, name, text))));
    sections.insert("modes", codes(&Mode::ALL.map(|(code, text)| (code as u16, code.name(), text))));
    sections.insert("clocks", codes(&Clock::ALL.map(|(code, text)| (code as u16, code.name(), text))));
    sections
        .insert("duties", codes(&MonitoredTask::ALL.map(|duty| (duty as u16, duty.name(), duty.meaning()))));
    sections.insert(
        "gateway status",
        bits(&Signals::ALL.map(|(signal, name, text)| (signal.bits(), name, text))),
    );
    sections.insert("flags", bits(&slot_bits::ALL));
    sections.insert(
        "alarms",
        bits(&alarm_bits().each_ref().map(|(bit, name, text)| (*bit, *name, text.as_str()))),
    );
    let head = String::from(
        "| code | name | target | value | arm key | what | at the console |\n|---|---|---|---|---|---|---|\n",
    );
    let commands = Command::ALL.iter().fold(head, |table, command| {
        let row = command.description();
        let key = if command.is_confirmed() { "yes" } else { "-" };
        let (code, name) = (*command as u16, row.name);
        let target = match row.target {
            Target::Gateway => "-",
            Target::Bus => "bus",
            Target::Slot | Target::Sensor => "slot",
        };
        let value = if row.value.is_empty() { "-" } else { row.value };
        let typed = row.typed.iter().map(|form| format!("`{}`", form.replace('|', "\\|")));
        let typed = typed.collect::<Vec<_>>().join(", ");
        let text =
            if row.modbus.is_empty() { row.text.into() } else { format!("{}. {}", row.text, row.modbus) };
        table + &format!("| {code} | {name} | {target} | {value} | {key} | {text} | {typed} |\n")
    });
    sections.insert("commands", commands);
    sections
}

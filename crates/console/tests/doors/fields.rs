//! What one door tells, the other tells: each member of the console's JSON is a register of `docs/modbus.csv`, with the same
//! value at the same instant; each register is such a member, or has its name and its reason here.

use std::collections::{BTreeMap, BTreeSet};

use clino_recovery::{Start, StartCause};
use serde_json::Value;

use crate::house::House;

/// Members of an object, and where Modbus has them. `{}` stands for the number that the object is about. What begins with
/// `*` is not compared, and says why.
type Object = (&'static str, &'static [(&'static str, &'static str)]);

/// What commands tell.
const RESULTS: &[Object] = &[
    (
        "found",
        &[
            ("address", "found{}_address"),
            ("baud", "found{}_baud"),
            ("product", "text found{}_product"),
            ("serial", "found{}_serial"),
            ("firmware", "text found{}_firmware"),
        ],
    ),
    ("suspect", &[("address", "found{}_address"), ("baud", "found{}_baud")]),
    (
        "swept",
        &[
            ("devices", "result_devices"),
            ("suspects", "result_suspects"),
            ("asked", "result_asked"),
            ("complete", "result_complete"),
        ],
    ),
    (
        "identity",
        &[
            ("product", "text result_product"),
            ("serial", "result_serial"),
            ("firmware", "text result_firmware"),
            ("damping_ms", "result_damping"),
            ("range", "result_range"),
            ("direction_0", "result_direction_00"),
            ("direction_1", "result_direction_01"),
            ("direction_2", "result_direction_02"),
            ("offset_0_mdeg", "result_offset_00"),
            ("offset_1_mdeg", "result_offset_01"),
            ("offset_2_mdeg", "result_offset_02"),
            ("address", "result_address"),
            ("angle_deg", "result_angle"),
            ("null_position_deg", "result_null_position"),
            ("auto_shutoff_word", "result_auto_shutoff_word"),
            ("checksum_right", "result_checksum_right"),
        ],
    ),
    (
        "zeroed",
        &[("before_mdeg", "result_before"), ("after_mdeg", "result_after"), ("writes", "result_writes")],
    ),
    (
        "nulled",
        &[("before_deg", "result_before"), ("after_deg", "result_after"), ("writes", "result_writes")],
    ),
    ("changed", CHANGED),
    ("unchanged", CHANGED),
    ("alive", &[("address", "result_address")]),
    (
        "repaired",
        &[
            ("address", "result_address"),
            ("stored_address", "result_stored_address"),
            ("writes", "result_writes"),
        ],
    ),
    (
        "failed",
        &[
            ("why", "command_reason"),
            ("writes", "result_writes"),
            ("repair", "result_repair"),
            ("rate_deg_s", "result_rate"),
        ],
    ),
    ("saved", &[("stored", "* the outcome is done")]),
    ("done", &[("done", "* the outcome is done")]),
    ("hint", &[("hint", "* what a command does to others is asked before it; after it: command_silenced")]),
];

const CHANGED: &[(&str, &str)] = &[
    ("address", "result_to"),
    ("baud", "result_to"),
    ("damping_ms", "result_to"),
    ("direction", "word result_to"),
    ("offset_mdeg", "raw result_to"),
    ("range", "word result_to"),
    ("null_position_deg", "turn16 result_to"),
    ("from", "from"),
    ("writes", "result_writes"),
];

/// What is read.
const READS: &[Object] = &[
    (
        "slot",
        &[
            ("slot", "* the number of the block"),
            ("kind", "slot{}_kind"),
            ("bus", "* each kind has one"),
            ("address", "slot{}_address"),
            ("status", "slot{}_status"),
            ("angle_deg", "slot{}_angle_mdeg"),
            ("age_ms", "slot{}_age"),
            ("health", "health slot{}_flags"),
            ("seq", "slot{}_sequence"),
            ("sequence", "slot{}_sequence"),
            ("raw_deg", "slot{}_raw_mdeg"),
            ("rate_deg_s", "slot{}_rate_now"),
            ("turns", "slot{}_turns"),
            ("temperature_c", "slot{}_temperature"),
            ("fresh", "no repeated slot{}_flags"),
            ("last_error", "slot{}_last_error"),
            ("unconfirmed", "bit unconfirmed slot{}_flags"),
            ("quarantine", "bit quarantine slot{}_flags"),
        ],
    ),
    (
        "stats",
        &[
            ("requests", "bus{}_requests"),
            ("good", "bus{}_good"),
            ("no_answer", "bus{}_no_answer"),
            ("bad_answer", "bus{}_bad_answer"),
            ("late", "bus{}_late"),
        ],
    ),
    (
        "line",
        &[
            ("forced", "bus{}_forced"),
            ("busy", "bus{}_line_busy"),
            ("junk", "bus{}_junk"),
            ("framing", "bus{}_framing"),
            ("noise", "bus{}_noise"),
            ("overrun", "bus{}_overrun"),
        ],
    ),
    (
        "times",
        &[
            ("response_us", "bus{}_response_last"),
            ("response_max_us", "bus{}_response_max"),
            ("de_release_max_ns", "bus{}_de_release_max"),
            ("de_high_max_us", "bus{}_de_high_max"),
        ],
    ),
    (
        "alarm",
        &[
            ("alarm", "* the number of the block"),
            ("name", "* which one it is"),
            ("state", "alarm slot{}_alarms"),
            ("age_ms", "seconds of slot{}_{alarm}_age"),
            ("extreme", "slot{}_{alarm}_extreme"),
            ("unit", "* of the register"),
            ("angle_deg", "slot{}_angle_mdeg"),
        ],
    ),
    (
        "extremes",
        &[
            ("extremes", "* the number of the block"),
            ("lowest_deg", "slot{}_lowest"),
            ("lowest_age_s", "slot{}_lowest_age"),
            ("highest_deg", "slot{}_highest"),
            ("highest_age_s", "slot{}_highest_age"),
        ],
    ),
    ("bus_fault", &[("fault", "bus{}_fault"), ("faults", "bus{}_faults"), ("in_vain", "bus{}_in_vain")]),
    (
        "counters of a bus",
        &[
            ("retries", "bus{}_retries"),
            ("writes", "bus{}_nv_writes"),
            ("first_try", "bus{}_first_try"),
            ("checksum", "bus{}_checksum"),
            ("length", "bus{}_length"),
            ("foreign", "bus{}_foreign"),
            ("contention", "bus{}_contention"),
            ("unasked", "bus{}_unasked"),
            ("breaks", "bus{}_breaks"),
            ("echo", "bus{}_echo"),
            ("parity", "bus{}_parity"),
            ("response_min_us", "bus{}_response_min"),
            ("de_high_max_us", "bus{}_de_high_max"),
        ],
    ),
    (
        "counters of a slot",
        &[
            ("requests", "slot{}_requests"),
            ("first_try", "slot{}_first_try"),
            ("retries", "slot{}_retries"),
            ("no_answer", "slot{}_timeouts"),
            ("skipped", "slot{}_skipped"),
            ("checksum", "slot{}_checksum"),
            ("length", "without foreign slot{}_length"),
            ("foreign", "slot{}_foreign"),
            ("garbled", "slot{}_garbled"),
            ("refused", "slot{}_refused"),
            ("not_sent", "slot{}_not_sent"),
            ("late", "slot{}_late"),
            ("writes", "slot{}_nv_writes"),
            ("response_us", "slot{}_response_last"),
            ("response_min_us", "slot{}_response_min"),
            ("response_max_us", "slot{}_response_max"),
        ],
    ),
    (
        "counters of the port",
        &[
            ("messages", "function 11"),
            ("errors", "function 12"),
            ("exceptions", "function 13"),
            ("requests", "function 14"),
            ("unanswered", "function 15"),
            ("overruns", "function 18"),
        ],
    ),
    (
        "counters of the console",
        &[
            ("lost", "* of the console's own line"),
            ("damaged", "* of the console's own line"),
            ("echoed", "* of the console's own line"),
        ],
    ),
    (
        "summary",
        &[
            ("summary", "bits gateway_status"),
            ("enabled", "slots_enabled"),
            ("online", "count online_0_31"),
            ("ok", "slots_ok"),
        ],
    ),
    (
        "clino",
        &[
            ("version", "version firmware"),
            ("uptime_ms", "seconds uptime"),
            ("mode", "start_mode"),
            ("clock", "clock_source"),
            ("power_ups", "power_ups"),
            ("boots", "boots"),
            ("uid", "uid uid_00"),
        ],
    ),
    (
        "start",
        &[
            ("cause", "start_cause"),
            ("boots", "boots"),
            ("crashes", "crashes"),
            ("mode", "start_mode"),
            ("clock", "clock_source"),
        ],
    ),
    (
        "crash",
        &[
            ("cause", "crash_cause"),
            ("boot", "crash_boot"),
            ("uptime_ms", "crash_uptime"),
            ("duty", "duty crash_detail"),
            ("file", "file crash_file_00"),
            ("line", "* crash_detail, of a panic"),
            ("pc", "hex crash_pc"),
            ("lr", "hex crash_lr"),
            ("sp", "hex crash_sp"),
            ("exception", "crash_exception"),
            ("cfsr", "hex crash_cfsr"),
            ("hfsr", "hex crash_hfsr"),
            ("address", "hex crash_address"),
        ],
    ),
    (
        "load",
        &[
            ("load", "* the number of the bus"),
            ("wanted_percent", "* computed from settings, which are registers"),
            ("polls_per_s", "* the difference of bus_requests over a second"),
        ],
    ),
    ("unwise", &[("why", "* sentences about settings, which are registers")]),
    ("done", &[("done", "* what was typed was carried out")]),
];

/// Registers that the console has no member for, and why not.
const MODBUS_ONLY: &[(&str, &str)] = &[
    ("magic", "how the map is found"),
    ("map_version", "of the map"),
    ("slot_count", "of the map"),
    ("slot_base", "of the map"),
    ("slot_stride", "of the map"),
    ("test_number", "order of bytes"),
    ("test_angle", "order of bytes"),
    ("sequence", "state of the map"),
    ("online_32_47", "the second half of online_0_31"),
    ("valid_0_31", "status of the slots"),
    ("valid_32_47", "status of the slots"),
    ("oldest_age", "age of the slots"),
    ("alarm_0_31", "alarms of the slots"),
    ("alarm_32_47", "alarms of the slots"),
    ("firmware_patch", "with firmware"),
    ("angle", "copy"),
    ("age", "copy"),
    ("status", "copy"),
    ("angle_f32", "copy"),
    ("angle_i16", "copy"),
    ("angle_i32_cdab", "copy"),
    ("angle_f32_cdab", "copy"),
    ("slot_angle_deg", "copy"),
    ("slot_angle_cdeg", "copy"),
    ("slot_unwrapped_mdeg", "angle and turns"),
    ("result_sequence", "which command it is; the console tells it behind the command"),
    ("result_scan", "which scan it is; the console tells it behind the command"),
    ("result_found", "the console tells them one by one"),
    ("found_scan", "which scan it is; the console tells it behind the command"),
    ("found_what", "the console has an object for each"),
    ("command", "a command is typed"),
    ("command_target", "a command is typed"),
    ("command_value", "a command is typed"),
    ("arm_key", "the console asks, or wants --yes"),
    ("last_command", "the console answers the command itself"),
    ("command_outcome", "the console answers the command itself"),
    ("command_sequence", "the console answers the command itself"),
    ("command_done", "the console's progress"),
    ("command_of", "the console's progress"),
    ("command_silenced", "the console's hint"),
];

/// What commands have to tell somewhere in the cases.
pub const REGISTERS_OF_RESULTS: &[&str] = &[
    "result_writes",
    "result_devices",
    "result_suspects",
    "result_asked",
    "result_complete",
    "result_address",
    "result_stored_address",
    "result_serial",
    "result_product",
    "result_product_2",
    "result_firmware",
    "result_firmware_2",
    "result_damping",
    "result_range",
    "result_direction",
    "result_offset",
    "result_before",
    "result_after",
    "result_from",
    "result_to",
    "result_angle",
    "result_null_position",
    "result_auto_shutoff_word",
    "result_checksum_right",
    "result_repair",
    "result_rate",
    "found_address",
    "found_baud",
    "found_serial",
    "found_product",
    "found_product_2",
    "found_firmware",
    "found_firmware_2",
    "command_reason",
];

/// A line of `docs/modbus.csv`.
struct Register {
    address: u16,
    registers: u16,
    is_signed: bool,
    scale: f64,
    unit: String,
    invalid: Option<u32>,
    values: Vec<(u32, String)>,
}

/// What is compared, and what was.
pub struct Fields {
    registers: BTreeMap<String, Register>,
    /// Names without numbers of blocks and elements.
    pub used: BTreeSet<String>,
    /// Things that a scan has told of at the console.
    found: u16,
}

impl Fields {
    pub fn new() -> Fields {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/modbus.csv");
        let list = std::fs::read_to_string(path).expect("docs/modbus.csv");
        let registers = list.lines().skip(1).map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let values = fields[13].split('|').filter_map(|pair| pair.split_once('='));
            let register = Register {
                address: fields[0].parse().expect("an address"),
                registers: fields[5].parse().expect("a number"),
                is_signed: fields[4].starts_with("int"),
                scale: fields[8].parse().expect("a scale"),
                unit: fields[9].to_owned(),
                invalid: fields[12].strip_prefix("0x").map(|hex| u32::from_str_radix(hex, 16).expect("hex")),
                values: values.map(|(code, name)| (number(code), name.to_owned())).collect(),
            };
            (fields[3].to_owned(), register)
        });
        Fields { registers: registers.collect(), used: BTreeSet::new(), found: 0 }
    }

    fn bits(&mut self, house: &mut House, name: &str) -> u32 {
        self.used.insert(without_numbers(name));
        let register = self.registers.get(name).unwrap_or_else(|| panic!("no register {name}"));
        let words = house.read(register.address, register.registers);
        words.iter().fold(0, |all, word| all << 16 | u32::from(*word))
    }

    /// The value of a register in its unit; `None` if there is none.
    pub fn value(&mut self, house: &mut House, name: &str) -> Option<f64> {
        let bits = self.bits(house, name);
        let register = &self.registers[name];
        if register.invalid == Some(bits) {
            return None;
        }
        let value = match (register.is_signed, register.registers) {
            (true, 1) => f64::from(bits as u16 as i16),
            (true, _) => f64::from(bits as i32),
            _ => f64::from(bits),
        };
        Some(value * register.scale)
    }

    /// Six characters in a number of four and one of two.
    fn text(&mut self, house: &mut House, name: &str) -> Option<String> {
        let (four, two) = (self.bits(house, name), self.bits(house, &format!("{name}_2")));
        let bytes = [&four.to_be_bytes()[..], &(two as u16).to_be_bytes()].concat();
        (four != u32::MAX).then(|| String::from_utf8(bytes).expect("ASCII").trim_end().to_owned())
    }

    /// A line that a command has printed.
    pub fn compare(&mut self, house: &mut House, line: &str) {
        let object: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"));
        let first = line.split('"').nth(1).expect("a key");
        let (name, about) = match (first, &object[first]) {
            ("what", Value::String(what)) => (what.as_str(), String::new()),
            (_, Value::Number(slot)) if first == "counters" => {
                ("counters of a slot", format!("{:02}", slot.as_u64().expect("a slot")))
            }
            ("counters", Value::String(whose)) => match whose.as_str() {
                "modbus" => ("counters of the port", String::new()),
                "console" => ("counters of the console", String::new()),
                bus => ("counters of a bus", number_of(bus)),
            },
            (_, Value::String(bus)) => (first, number_of(bus)),
            (_, Value::Number(slot)) => (first, format!("{:02}", slot.as_u64().expect("a slot"))),
            _ => (first, String::new()),
        };
        if matches!(name, "config" | "bus" | "modbus" | "console") {
            return self.compare_settings(house, name, &about, &object, line);
        }
        let objects = RESULTS.iter().chain(READS).find(|(known, _)| *known == name);
        let (_, members) = objects.unwrap_or_else(|| panic!("only the console tells {line}"));
        let about = match name {
            "found" | "suspect" => {
                self.found += 1;
                (self.found - 1).to_string()
            }
            _ => about,
        };
        let kind = object["name"].as_str().filter(|_| name == "alarm").unwrap_or("");
        for (key, value) in object.as_object().expect("an object") {
            if key == "what"
                || key == "counters"
                || matches!(first, "stats" | "line" | "times" | "bus_fault") && key == first
            {
                continue;
            }
            let place = members.iter().find(|(known, _)| known == key);
            let (_, place) = place.unwrap_or_else(|| panic!("only the console tells {key} of {line}"));
            self.compare_one(
                house,
                &place.replace("{}", &about).replace("{alarm}", kind),
                key,
                value,
                line,
                &object,
            );
        }
    }

    fn compare_one(
        &mut self,
        house: &mut House,
        place: &str,
        key: &str,
        value: &Value,
        line: &str,
        object: &Value,
    ) {
        let (how, name) = place.rsplit_once(' ').unwrap_or(("", place));
        // The alarm no_value has no extreme.
        if place.starts_with('*') || name.ends_with("_no_value_extreme") && value.is_null() {
            return;
        }
        let told = format!("{key} of {line}, {place}");
        match how {
            "text" => assert_eq!(self.text(house, name).as_deref(), value.as_str(), "{told}"),
            // The place of a word among those of the setting that has the same name.
            "word" => {
                let word = value.as_str().unwrap_or_else(|| panic!("{told}"));
                let place = ["normal", "bidirectional"].contains(&word);
                let number = self.value(house, name).unwrap_or_else(|| panic!("{told}"));
                assert_eq!(number, if place { 0.0 } else { 1.0 }, "{told}");
            }
            "raw" => assert_eq!(self.value(house, name), value.as_f64(), "{told}"),
            "turn16" => assert_eq!(self.value(house, name).map(turn16), value.as_f64(), "{told}"),
            "function" => {
                let sub = name.parse().expect("a number");
                let answer = house.ask(&[8, 0, sub, 0, 0]);
                let count = u64::from(u16::from_be_bytes([answer[3], answer[4]]));
                // The requests of this test count, too.
                let told_count = value.as_u64().expect("a count");
                assert!((told_count..told_count + 600).contains(&count), "{told}: {count}");
            }
            "health" => {
                let bits = self.bits(house, name);
                let expected = [("disagrees", 0x04), ("gravity", 0x10), ("noisy", 0x20)];
                let names = value.as_array().expect("names");
                for (word, bit) in expected {
                    assert_eq!(names.iter().any(|name| name == word), bits & bit != 0, "{told}");
                }
            }
            "no repeated" => {
                let bits = self.bits(house, name);
                assert!(value.is_null() || value.as_bool() == Some(bits & 0x01 == 0), "{told}");
            }
            "bit unconfirmed" => {
                assert_eq!(value.as_bool(), Some(self.bits(house, name) & 0x02 != 0), "{told}")
            }
            "bit quarantine" => {
                assert_eq!(value.as_bool(), Some(self.bits(house, name) & 0x08 != 0), "{told}")
            }
            "without foreign" => {
                let foreign = self.value(house, &name.replace("length", "foreign"));
                let length = self.value(house, name).zip(foreign).map(|(both, foreign)| both - foreign);
                assert_eq!(length, value.as_f64(), "{told}");
            }
            "bits" => {
                let bits = self.bits(house, name);
                let values = &self.registers[name].values;
                let set: BTreeSet<&str> =
                    values.iter().filter(|(bit, _)| bits & bit != 0).map(|(_, name)| name.as_str()).collect();
                let names = value.as_array().expect("names").iter().filter_map(Value::as_str).collect();
                assert_eq!(set, names, "{told}");
            }
            "count" => {
                assert_eq!(self.bits(house, name).count_ones(), value.as_u64().unwrap() as u32, "{told}")
            }
            "alarm" => {
                let bit = ["high", "low", "rate", "no_value"].iter().position(|it| object["name"] == **it);
                let bits = self.bits(house, name) >> bit.expect("an alarm") & 0x11;
                let states = [(0x11, "active"), (0x01, "acknowledged"), (0x10, "unacknowledged")];
                assert!(states.iter().any(|state| *state == (bits, value.as_str().unwrap_or(""))), "{told}");
            }
            "seconds of" => {
                let age = self.value(house, name).expect("an age");
                let seconds = value.as_u64().expect("a time") / 1_000;
                assert!((seconds as f64 - age).abs() <= 1.0, "{told}: {age}");
            }
            "version" => {
                let ([major, minor], patch) =
                    ((self.bits(house, name) as u16).to_be_bytes(), self.bits(house, "firmware_patch"));
                assert_eq!(value.as_str(), Some(&*format!("{major}.{minor}.{patch}")), "{told}");
            }
            "seconds" => {
                let seconds = value.as_u64().expect("a time") / 1_000;
                assert_eq!(u64::from(self.bits(house, name)), seconds, "{told}");
            }
            "uid" => {
                let words = ["uid_00", "uid_01", "uid_02"].map(|name| self.bits(house, name));
                let words: String = words.iter().map(|word| format!("{word:08x}")).collect();
                assert_eq!(value.as_str().expect("hex").len(), words.len(), "{told}");
                let sorted = |text: &str| {
                    let mut bytes: Vec<u8> = text.bytes().collect();
                    bytes.sort_unstable();
                    bytes
                };
                assert_eq!(sorted(value.as_str().expect("hex")), sorted(&words), "{told}");
            }
            "hex" => match value.as_str() {
                Some(hex) => {
                    let hex = u32::from_str_radix(hex.trim_start_matches("0x"), 16).expect("hex");
                    assert_eq!(self.bits(house, name), hex, "{told}");
                }
                None => assert_eq!(self.value(house, name), None, "{told}"),
            },
            "duty" => {
                let detail = self.value(house, name);
                // Of a panic it is the line.
                assert_eq!(detail.is_none(), value.is_null() && object["line"].is_null(), "{told}");
            }
            "file" => {
                let characters = self.bits(house, name) as u16;
                let first: String = characters.to_be_bytes().iter().map(|&byte| char::from(byte)).collect();
                assert!(value.as_str().unwrap_or("\0\0").starts_with(&first), "{told}");
            }
            "" if name == "from" => {
                let to = match key {
                    "from" => "result_from",
                    _ => "result_to",
                };
                let is_word = object.get("direction").or(object.get("range")).is_some();
                let how = match () {
                    () if is_word => "word ",
                    () if object.get("null_position_deg").is_some() => "turn16 ",
                    () => "raw ",
                };
                self.compare_one(house, &format!("{how}{to}"), key, value, line, object);
            }
            "" => self.compare_plain(house, name, key, value, &told),
            other => panic!("{other} of {told}"),
        }
    }

    /// A number, a flag, or the name of a code.
    fn compare_plain(&mut self, house: &mut House, name: &str, key: &str, value: &Value, told: &str) {
        let found = self.value(house, name);
        let register = &self.registers[name];
        match value {
            Value::Null => {
                // An unused time is 0; no fault has the code 0, and no partner is −1.
                let none = found.is_none() || found == Some(0.0) || found == Some(-1.0);
                assert!(none, "{told}: {found:?}");
            }
            Value::Bool(flag) => assert_eq!(found, Some(f64::from(u8::from(*flag))), "{told}"),
            Value::String(word) => {
                let code =
                    register.values.iter().find(|(_, name)| name == word).map(|(code, _)| f64::from(*code));
                assert!(code.is_some() && found == code, "{told}: {found:?}");
            }
            Value::Number(number) => {
                let number = number.as_f64().expect("a number");
                let factor = match (register.unit.as_str(), key) {
                    ("deg", key) if key.ends_with("_mdeg") => 1_000.0,
                    _ => 1.0,
                };
                let found = found.unwrap_or_else(|| panic!("{told}: none")) * factor;
                // Whole milliseconds of the period of a PWM output.
                let is_finer = key.ends_with("_ms") && number.fract() > 0.0;
                let step = if is_finer { 1.0 } else { 0.000_6 * factor };
                assert!((found - number).abs() <= step, "{told}: {found}");
            }
            _ => panic!("{told}"),
        }
    }

    /// How something is set: each setting has a register of its name.
    fn compare_settings(&mut self, house: &mut House, of: &str, about: &str, object: &Value, line: &str) {
        let prefix = match of {
            "config" => format!("slot{about}_"),
            "bus" => format!("bus{about}_"),
            "modbus" => "port_".to_owned(),
            _ => "console_".to_owned(),
        };
        for (key, value) in object.as_object().expect("an object") {
            // Null is a setting that the kind of the slot does not have.
            if [of, "what", "fault"].contains(&key.as_str()) || value.is_null() {
                continue;
            }
            if key == "name" {
                let parts = ["name", "name_2", "name_3", "name_4"]
                    .map(|part| self.bits(house, &format!("{prefix}{part}")));
                let text: String = parts
                    .iter()
                    .flat_map(|part| part.to_be_bytes())
                    .filter(|&byte| byte != 0)
                    .map(char::from)
                    .collect();
                assert_eq!(value.as_str(), Some(text.as_str()), "{line}");
                continue;
            }
            let short = ["_deg_s", "_ms", "_us", "_deg", "_s"].iter().find_map(|unit| key.strip_suffix(unit));
            let names = [key.as_str(), short.unwrap_or(key)];
            let candidates =
                names.iter().flat_map(|name| [format!("{prefix}set_{name}"), format!("{prefix}{name}")]);
            let mut candidates = candidates.filter(|name| self.registers.contains_key(name));
            let name = candidates.next().unwrap_or_else(|| panic!("only the console tells {key} of {line}"));
            self.compare_plain(house, &name, key, value, &format!("{key} of {line}, {name}"));
        }
    }

    /// What the scan has found is as much as the console has told of.
    pub fn all_found_is_told(&mut self, house: &mut House) {
        assert_eq!(self.bits(house, "result_found"), u32::from(self.found));
        self.found = 0;
    }
}

/// How the console's object names a bus, or nothing.
fn number_of(bus: &str) -> String {
    match bus {
        "t7" => "0",
        "isu" => "1",
        _ => "",
    }
    .to_owned()
}

/// Degrees of a 65536th of a turn, in thousandths.
fn turn16(code: f64) -> f64 {
    (code * 360.0 / 65_536.0 * 1_000.0).round() / 1_000.0
}

fn number(text: &str) -> u32 {
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).expect("hex"),
        None => text.parse().expect("a number"),
    }
}

/// `slot07_age` is `slot_age`, `angle_12` is `angle`.
fn without_numbers(name: &str) -> String {
    let mut name = name.to_owned();
    for prefix in ["slot", "bus", "found"] {
        if let Some((number, rest)) = name.strip_prefix(prefix).and_then(|rest| rest.split_once('_'))
            && !number.is_empty()
            && number.bytes().all(|byte| byte.is_ascii_digit())
        {
            name = format!("{prefix}_{rest}");
        }
    }
    match name.rsplit_once('_') {
        Some((rest, number))
            if number.len() == 2
                && number.parse::<u8>().is_ok()
                && !rest.contains("line_")
                && !rest.contains("alarm")
                && !rest.contains("valid") =>
        {
            rest.to_owned()
        }
        _ => name,
    }
}

/// Whatever is read at the console is a register with the same value, and whatever is a register is read at the console.
#[test]
fn what_one_door_tells_the_other_tells() {
    let mut house = House::new();
    let mut fields = Fields::new();
    let lines = [
        "list",
        "read 0",
        "read 1",
        "read 2",
        "counters",
        "counters 0",
        "counters 1",
        "alarms",
        "extremes",
        "load",
        "version",
        "reset-cause",
        "show 0",
        "show 1",
        "show 2",
        "show t7",
        "show isu",
        "bus t7",
        "bus isu",
        "show modbus",
        "show console",
        "modbus",
    ];
    _ = house.typed("set 2 partner 1");
    // No sensor has this address.
    _ = house.typed("slot 30 t7 77");
    _ = house.typed("set 30 no_value 0.1");
    house.run(500_000);
    for line in lines {
        let said = house.typed(line);
        assert!(!said.is_empty(), "{line}");
        for said in
            said.iter().filter(|said| !(said.contains(r#""kind":"pwm""#) && said.starts_with("{\"slot\"")))
        {
            assert!(!said.starts_with("{\"error\""), "{line}: {said}");
            fields.compare(&mut house, said);
        }
    }
    let crash = clino_recovery::Crash {
        cause: StartCause::HardFault,
        boot: 3,
        uptime_ms: 77,
        registers: Some(Default::default()),
        ..Default::default()
    };
    house.set_start(Start {
        cause: StartCause::HardFault,
        boots: 4,
        crashes: 1,
        crash: Some(crash),
        ..Start::default()
    });
    for said in house.typed("reset-cause") {
        fields.compare(&mut house, &said);
    }
    // Results are compared where they come.
    let elsewhere = REGISTERS_OF_RESULTS.iter().map(|name| (*name).to_owned());
    fields.used.extend(elsewhere);
    let named: BTreeSet<&str> = MODBUS_ONLY.iter().map(|(name, _)| *name).collect();
    let all: BTreeSet<String> = fields.registers.keys().map(|name| without_numbers(name)).collect();
    let only: Vec<&String> =
        all.iter().filter(|name| !fields.used.contains(*name) && !named.contains(name.as_str())).collect();
    assert_eq!(only, [""; 0], "told over Modbus alone");
    for name in named {
        assert!(all.contains(name), "{name} is no register");
    }
}

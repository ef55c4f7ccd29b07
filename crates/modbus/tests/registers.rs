//! Every line of `docs/modbus.csv`, read from a server: what people are told is what they get.
//!
//! The list is the only thing taken from the map here; what each name has to say is known from the model.

mod common;

use common::Bench;
use common::model::{self, STEP, age, angle, has_detail};

use clino_modbus::Status;
use clino_recovery::{Crash, Duty, Registers};

const LIST: &str = include_str!("../../../docs/modbus.csv");

struct Line<'a> {
    address: u16,
    name: &'a str,
    kind: &'a str,
    registers: u16,
    order: &'a str,
    writable: bool,
    limits: Option<(i64, i64)>,
    invalid: Option<u32>,
}

fn lines() -> impl Iterator<Item = Line<'static>> {
    LIST.lines().skip(1).map(|line| {
        let fields: Vec<_> = line.splitn(12, ',').collect();
        let address = u16::from_str_radix(fields[0], 16).expect("an address");
        assert_eq!(fields[1].parse::<u32>().expect("a number"), u32::from(address) + 1);
        Line {
            address,
            name: fields[2],
            kind: fields[3],
            registers: fields[4].parse().expect("a number"),
            order: fields[5],
            writable: fields[6] == "rw",
            limits: fields[8].parse().ok().zip(fields[9].parse().ok()),
            invalid: fields[10].strip_prefix("0x").map(|hex| u32::from_str_radix(hex, 16).expect("a number")),
        }
    })
}

/// A number as the list says it is to be put together, as its bits.
fn number(line: &Line, words: &[u16]) -> u32 {
    let words: Vec<u32> = words.iter().map(|&word| u32::from(word)).collect();
    match (line.order, &words[..]) {
        ("AB", [word]) => *word,
        ("ABCD", [high, low]) | ("CDAB", [low, high]) => high << 16 | low,
        other => panic!("{}: {other:?}", line.name),
    }
}

/// What the type's "none" is, restated.
fn none(kind: &str) -> u32 {
    match kind {
        "uint16" => 0xFFFF,
        "int16" => 0x8000,
        "uint32" => 0xFFFF_FFFF,
        "int32" => 0x8000_0000,
        "float32" => 0x7FC0_0000,
        other => panic!("{other}"),
    }
}

#[test]
fn every_number_is_what_its_name_says() {
    let mut bench = Bench::new();
    let mut nones = 0;
    for line in lines() {
        let words = bench.read(line.address, line.registers).expect(line.name);
        let found = number(&line, &words);
        let expected = expected(line.name, bench.host.held.expect("a snapshot"));
        if expected.is_none() {
            assert_eq!(line.invalid, Some(none(line.kind)), "{} can be none", line.name);
            nones += 1;
        }
        let mask = if line.registers == 1 { 0xFFFF } else { u32::MAX };
        assert_eq!(found, expected.unwrap_or(none(line.kind)) & mask, "{}", line.name);
    }
    // Four details of every other slot; eight copies of the angles of six slots; two of the ages of three; the oldest age;
    // the detail of the crash.
    assert_eq!(nones, 24 * 4 + 6 * 8 + 3 * 2 + 1 + 1);
}

/// The registers of the block *start*.
fn start(crash: Option<Crash>) -> Vec<u16> {
    let mut bench = Bench::new();
    bench.host.start.crash = crash;
    bench.read(0x0980, 36).expect("the block")
}

#[test]
fn without_a_crash_there_is_nothing_of_one() {
    let words = start(None);
    let (first, rest) = words.split_at(8);
    assert_eq!(first, [1, 2, 2, 0xFFFF, 1, 4_465, 1, 4_466], "70001 and 70002 starts and crashes");
    // One number before the pc has one register, and one beside it has no name.
    assert_eq!(rest[6..8], [0xFFFF, 0]);
    assert!(rest[..6].iter().chain(&rest[8..20]).all(|&word| word == 0xFFFF), "{words:04X?}");
    assert_eq!(rest[20..], [0; 8], "no file");
}

#[test]
fn a_panic_has_a_file_and_a_line_and_no_registers() {
    let words = start(Some(Crash::panic("src/modbus/desk.rs", 0x1_2345)));
    assert_eq!((words[3], &words[12..15]), (9, &[0x0001, 0x2345, 0xFFFF][..]));
    assert_eq!(words[16..28], [0xFFFF; 12], "neither registers nor a fault");
    let text: Vec<u8> = words[28..].iter().flat_map(|word| word.to_be_bytes()).collect();
    assert_eq!(text, b"c/modbus/desk.rs", "the last sixteen characters");
    let short = start(Some(Crash::panic("a.rs", 7)));
    assert_eq!(short[28..], [0x612E, 0x7273, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn a_stalled_duty_is_named_and_what_its_fault_status_would_be_is_not() {
    let at = Registers { pc: 0x0800_1234, lr: 0x0800_5678, sp: 0x2000_0100, exception: 0 };
    let words = start(Some(Crash::stalled(Duty::Storage, at)));
    assert_eq!((words[3], &words[12..15]), (8, &[0, 6, 0][..]));
    assert_eq!(words[16..22], [0x0800, 0x1234, 0x0800, 0x5678, 0x2000, 0x0100]);
    assert_eq!(words[22..28], [0xFFFF; 6]);
}

/// What a number of this name has to be, as its bits, in the state that was held.
fn expected(name: &str, held: i32) -> Option<u32> {
    let trailing =
        || name.rsplit('_').next().and_then(|number| number.parse::<usize>().ok()).expect("a number");
    if let Some((slot, name)) = name.strip_prefix("slot").and_then(|rest| rest.split_once('_'))
        && let Ok(slot) = slot.parse()
    {
        return slot_number(slot, name, held);
    }
    if let Some((bus, name)) = name.strip_prefix("bus").and_then(|rest| rest.split_once('_')) {
        return Some(bus_number(bus.parse().expect("a number"), name));
    }
    Some(match name {
        "magic" => u32::from_be_bytes(*b"INCL"),
        "map_version" => 1,
        "slot_count" => 48,
        "slot_base" => 0x100,
        "slot_stride" => 32,
        "firmware" => 0x0102,
        "firmware_patch" => 3,
        "uptime" => 4_000_000,
        "gateway_status" => 0xA55A,
        "sequence" => 0xBEEF,
        "test_number" => 305_419_896,
        "test_angle" => 123.456_f32.to_bits(),
        // Without slots 3, 5, 7 (never read, stale, no answer) and 11 (off); 9 answers, but with an error.
        "online_0_31" => !(1 << 3 | 1 << 5 | 1 << 7 | 1 << 11),
        "valid_0_31" => !(1 << 3 | 1 << 5 | 1 << 7 | 1 << 9 | 1 << 11),
        // Slot 40 is off.
        "online_32_47" | "valid_32_47" => 0xFFFF & !(1 << 8),
        "slots_enabled" => 46,
        "slots_ok" => 42,
        "oldest_age" => return None,
        "port_address" => 17,
        "port_parity" => 1,
        "port_baud" => 19_200,
        "port_stop_bits" => 1,
        "command" | "command_target" | "command_value" | "arm_key" => 0,
        "start_cause" => 1,
        "start_mode" | "clock_source" => 2,
        "boots" => 70_001,
        "crashes" => 70_002,
        // An access to nothing: no duty, no line, no file.
        "crash_cause" => 12,
        "crash_boot" => 70_003,
        "crash_uptime" => 70_004,
        "crash_detail" => return None,
        "crash_exception" => 22,
        "crash_pc" => 0x0801_0203,
        "crash_lr" => 0x0801_0405,
        "crash_sp" => 0x2001_FF08,
        "crash_cfsr" => 0x8200,
        "crash_hfsr" => 0x4000_0000,
        "crash_address" => 0x2222_2222,
        _ if name.starts_with("crash_file_") => 0,
        "last_command" => 16,
        "command_outcome" => 1,
        "command_sequence" => 0xFFFE,
        "command_done" => 3,
        "command_of" => 8,
        "command_silenced" => 5,
        _ if name.starts_with("angle_f32") => return degrees(trailing(), held),
        _ if name.starts_with("angle_i16") => return hundredths(trailing(), held),
        _ if name.starts_with("angle_i32_cdab") => return thousandths(trailing(), held),
        _ if name.starts_with("angle_") => return thousandths(trailing(), held),
        _ if name.starts_with("age_") => return milliseconds(trailing()),
        _ if name.starts_with("status_") => model::status(trailing()) as u32,
        other => panic!("{other}"),
    })
}

fn slot_number(slot: usize, name: &str, held: i32) -> Option<u32> {
    let n = slot as u32;
    let full = has_detail(slot);
    let count = |number: u32| if full { number } else { 0 };
    let known = |number: u32| full.then_some(number);
    Some(match name {
        "status" => model::status(slot) as u32,
        "flags" => 0x8000 + n,
        "angle_mdeg" => return thousandths(slot, held),
        "angle_deg" => return degrees(slot, held),
        "angle_cdeg" => return hundredths(slot, held),
        "temperature" => return known((-500 - slot as i32) as u32),
        "age" => return milliseconds(slot),
        "sequence" => 0x700 + n,
        "raw_mdeg" => return known((-5 - slot as i32) as u32),
        "unwrapped_mdeg" => return known(3_600_000 + n),
        "last_error" => return known(4),
        "requests" => count(0x10_0000 + n),
        "first_try" => count(0x20_0000 + n),
        "retries" => count(0x100 + n),
        "timeouts" => count(0x200 + n),
        "checksum" => count(0x300 + n),
        "length" => count(0x400 + n),
        "late" => count(0x500 + n),
        "nv_writes" => count(0x600 + n),
        "response_last" => count(2_083),
        "response_max" => count(65_535),
        "kind" => count(2),
        "address" => count(n + 1),
        "enabled" => u32::from(slot < 6),
        "set_kind" => 1,
        "set_address" => n + 1,
        "axis" => 2,
        "period" => 100_000 + n,
        "stale" => 200_000 + n,
        "timeout" => 300 + n,
        "set_retries" => 1,
        "zero" => (-70_000 - slot as i32) as u32,
        "reversed" => u32::from(slot == 1),
        "unidirectional" => u32::from(slot == 2),
        "filter" => 2,
        "filter_length" => 3,
        "confirm" => 1,
        "jump" => 400_000 + n,
        other => panic!("{other}"),
    })
}

fn bus_number(bus: u32, name: &str) -> u32 {
    let n = (bus + 1) * 1_000_000;
    match name {
        "baud" => [115_200, 9_600][bus as usize],
        "guard" => 87,
        "pre_delay" => 1,
        "post_delay" => 2,
        "echo_mode" => [2, 0][bus as usize],
        "response_last" => n + 21,
        "response_min" => n + 22,
        // More microseconds than 32 bits have.
        "response_max" => u32::MAX,
        "de_release_max" => 1_279 + bus,
        "de_high_max" => 261 + bus,
        "unasked" => n + 24,
        "breaks" => n + 25,
        "fault" => u32::from(bus == 0),
        "faults" => 90 + bus,
        "in_vain" => 70 + bus,
        _ => {
            let order = [
                "requests",
                "retries",
                "nv_writes",
                "good",
                "first_try",
                "no_answer",
                "bad_answer",
                "checksum",
                "length",
                "foreign",
                "late",
                "forced",
                "line_busy",
                "contention",
                "echo",
                "junk",
                "framing",
                "noise",
                "overrun",
                "parity",
            ];
            n + 1 + order.iter().position(|&known| known == name).unwrap_or_else(|| panic!("{name}")) as u32
        }
    }
}

fn live(slot: usize, held: i32) -> Option<i32> {
    (model::status(slot) == Status::Ok).then(|| angle(slot) + held * STEP)
}

fn thousandths(slot: usize, held: i32) -> Option<u32> {
    live(slot, held).map(|mdeg| mdeg as u32)
}

fn degrees(slot: usize, held: i32) -> Option<u32> {
    live(slot, held).map(|mdeg| ((f64::from(mdeg) / 1e3) as f32).to_bits())
}

fn hundredths(slot: usize, held: i32) -> Option<u32> {
    live(slot, held).map(|mdeg| {
        let degrees = f64::from(mdeg) / 1e3;
        let turned = degrees - 360.0 * (degrees / 360.0).round();
        // A half turn is told as the positive one.
        let turned = if turned == -180.0 { 180.0 } else { turned };
        ((f64::from((turned * 1e3).round() as i32) / 10.0).round() as i32) as u32
    })
}

fn milliseconds(slot: usize) -> Option<u32> {
    let ms = age(slot)? / 1_000;
    (ms < 65_535).then_some(ms as u32)
}

/// Function 4 reads what function 3 reads.
#[test]
fn holding_and_input_registers_are_the_same() {
    for line in lines() {
        let [three, four] = [3, 4].map(|function| {
            let mut bench = Bench::new();
            bench.read_with(function, line.address, line.registers).expect(line.name)
        });
        assert_eq!(three, four, "{}", line.name);
    }
}

/// As many registers as a request can have, wherever it begins: the same as one by one.
#[test]
fn long_reads_are_short_reads() {
    // Every bench begins with the same state, and its first request is answered from that.
    let read = |first: u16, quantity| Bench::new().read(first, quantity);
    for range in [0x0000..0x00E0_u16, 0x0100..0x0790, 0x0800..0x08C0, 0x0900..0x0980, 0x1000..0x1600] {
        let single: Vec<u16> =
            range.clone().map(|address| read(address, 1).expect("a register")[0]).collect();
        for first in range.clone().step_by(7) {
            let quantity = (range.end - first).min(125);
            let offset = usize::from(first - range.start);
            let expected = &single[offset..offset + usize::from(quantity)];
            assert_eq!(read(first, quantity).as_deref(), Ok(expected), "{first:04X}");
        }
    }
}

/// 96 registers in one request, and the header, from one state: the model moves with every look.
#[test]
fn one_request_is_one_state() {
    let mut bench = Bench::new();
    for _ in 0..10 {
        let words = bench.read(0x0020, 96).expect("the fast block");
        let held = bench.host.held.expect("a snapshot");
        for slot in 0..32 {
            let found = u32::from(words[2 * slot]) << 16 | u32::from(words[2 * slot + 1]);
            assert_eq!(found, thousandths(slot, held).unwrap_or(0x8000_0000), "slot {slot}");
            assert_eq!(u32::from(words[64 + slot]), milliseconds(slot).unwrap_or(0xFFFF), "slot {slot}");
        }
        let words = bench.read(0x0080, 96).expect("the second fast block");
        let held = bench.host.held.expect("a snapshot");
        for slot in 32..48 {
            let found = u32::from(words[2 * (slot - 32)]) << 16 | u32::from(words[2 * (slot - 32) + 1]);
            assert_eq!(found, thousandths(slot, held).unwrap_or(0x8000_0000), "slot {slot}");
        }
        let status: Vec<_> = (0..48).map(|slot| model::status(slot) as u16).collect();
        assert_eq!(words[48..], status);
    }
    assert_eq!(bench.host.snapshots, 20, "one for each request");
}

/// Registers that the list does not name read 0 within the blocks that the description names, and are exception 2 outside.
#[test]
fn every_other_address() {
    let blocks = [
        0x0000..0x00E0_u32,
        0x0100..0x0790,
        0x0800..0x08C0,
        0x0900..0x09C0,
        0x1000..0x1600,
        0x1800..0x1820,
        0x1840..0x1850,
        0x1F00..0x1F10,
    ];
    let mut named = vec![false; 0x1_0000];
    for line in lines() {
        for register in line.address..line.address + line.registers {
            assert!(!std::mem::replace(&mut named[usize::from(register)], true), "{register:04X} twice");
        }
    }
    let mut bench = Bench::new();
    for address in 0..0x1_0000_u32 {
        if named[address as usize] {
            continue;
        }
        let expected = if blocks.iter().any(|block| block.contains(&address)) { Ok(vec![0]) } else { Err(2) };
        assert_eq!(bench.read(address as u16, 1), expected, "{address:04X}");
    }
}

/// What the list calls writable takes its least and its most, and nothing beyond.
#[test]
fn limits() {
    for line in lines() {
        let write = |value: i64| {
            let mut bench = Bench::new();
            let bits = value as u32;
            let words = match line.registers {
                1 => vec![bits as u16],
                _ => vec![(bits >> 16) as u16, bits as u16],
            };
            (bench.write(line.address, &words), bench)
        };
        let Some((least, most)) = line.limits else {
            assert!(!line.writable);
            assert_eq!(write(0).0, Err(2), "{}", line.name);
            continue;
        };
        assert!(line.writable);
        match line.name {
            // Tested with the commands: they are not kept.
            "command" | "command_target" | "command_value" | "arm_key" => continue,
            // In force after the answer.
            name if name.starts_with("port_") => {
                assert_eq!(write(least).0, Ok(()));
                assert_eq!(write(most).0, Ok(()));
            }
            _ => {
                for value in [least, most] {
                    let (result, mut bench) = write(value);
                    assert_eq!(result, Ok(()), "{}", line.name);
                    let words = bench.read(line.address, line.registers).expect("a number");
                    let mask = if line.registers == 1 { 0xFFFF } else { u32::MAX };
                    assert_eq!(number(&line, &words), value as u32 & mask, "{}", line.name);
                }
            }
        }
        let (lowest, highest) = match line.kind {
            "uint16" => (0, 0xFFFF),
            "uint32" => (0, 0xFFFF_FFFF),
            _ => (i64::from(i32::MIN), i64::from(i32::MAX)),
        };
        for value in [least - 1, most + 1, lowest, highest] {
            if !(least..=most).contains(&value) && (lowest..=highest).contains(&value) {
                let (result, bench) = write(value);
                assert_eq!(result, Err(3), "{} = {value}", line.name);
                assert!(bench.host.writes.is_empty());
            }
        }
    }
}

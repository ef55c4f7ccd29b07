//! Every command through both doors, each time to a gateway of its own.

use std::collections::BTreeSet;

use clino_gateway::command::Command;

use crate::fields::{Fields, REGISTERS_OF_RESULTS};
use crate::house::House;

const KEY: u16 = 0x4E56;
/// Addresses of `docs/modbus.md`.
const OUTCOME: u16 = 0x1F09;
const REASON: u16 = 0x1F0D;

/// The same for both doors.
pub struct Case {
    pub house: fn() -> House,
    pub command: Command,
    pub typed: &'static str,
    pub target: u16,
    pub value: i32,
    /// It changes something that lasts.
    pub changes: bool,
}

const fn case(command: Command, typed: &'static str, target: u16, value: i32, changes: bool) -> Case {
    Case { house: House::new, command, typed, target, value, changes }
}

/// A word of the ISU's EEPROM is not what its checksum says.
fn broken() -> House {
    let house = House::new();
    let mut isu = house.isu.lock().expect("an ISU");
    let word = isu.eeprom.word(0x10);
    isu.eeprom.set_word(0x10, word ^ 1);
    drop(isu);
    house
}

/// The alarm of slot 0 is raised.
fn alarmed() -> House {
    let mut house = House::new();
    house.run(500_000);
    house
}

pub const CASES: &[Case] = &[
    case(Command::Save, "save", 0, 0, true),
    case(Command::FactoryReset, "factory-reset --yes", 0, 0, true),
    case(Command::ClearCounters, "counters clear", 0, 0, true),
    case(Command::SoftZero, "zero 0", 0, 0, true),
    case(Command::Reboot, "reboot --yes", 0, 0, true),
    case(Command::Scan, "t7 scan", 0, 0, false),
    Case { house: House::with_a_stranger, ..case(Command::Scan, "t7 scan all", 0, 1, false) },
    case(Command::SensorInfo, "t7 info 5", 0, 0, false),
    case(Command::SensorInfo, "isu info 3", 1, 0, false),
    case(Command::SensorReset, "isu reset 3", 1, 0, false),
    Case { house: alarmed, ..case(Command::Acknowledge, "acknowledge 0", 0, 0, true) },
    Case { house: alarmed, ..case(Command::Acknowledge, "acknowledge 40", 40, 0, false) },
    Case { house: alarmed, ..case(Command::Acknowledge, "acknowledge", 40, 1, true) },
    // What it does is in a test of its own: the next value is an extreme again.
    case(Command::ClearExtremes, "extremes clear 3", 3, 0, false),
    case(Command::ClearExtremes, "extremes clear", 0, 1, false),
    case(Command::SensorZero, "t7 zero 5 --yes", 0, 0, true),
    case(Command::SensorZero, "t7 zero 9 --yes", 3, 0, false),
    case(Command::SensorZero, "isu zero 3 --yes", 1, 0, true),
    case(Command::SensorDamping, "t7 damping 5 500 --yes", 0, 500, true),
    case(Command::SensorDamping, "t7 damping 5 20 --yes", 0, 20, false),
    case(Command::SensorDirection, "t7 direction 5 reversed --yes", 0, 1, true),
    case(Command::SensorOffset, "t7 offset 5 250 --yes", 0, 250, true),
    case(Command::SensorRange, "t7 range 5 unidirectional --yes", 0, 1, true),
    case(Command::SensorAddress, "t7 address 5 12 --yes", 0, 12, true),
    case(Command::SensorAddress, "isu address 3 9 --yes", 1, 9, true),
    case(Command::SensorBaud, "t7 baud 5 57600 --yes", 0, 57_600, true),
    case(Command::SensorNull, "isu null 3 100 --yes", 1, 100, true),
    Case { house: broken, ..case(Command::SensorNull, "isu null 3 100 --yes", 1, 100, false) },
    Case { house: broken, ..case(Command::SensorRepair, "isu repair 3 --yes", 1, 0, true) },
];

/// Through one door and through the other, the same becomes of the same sensors, and the same is told of it.
#[test]
fn each_command_ends_in_the_same_through_both_doors() {
    let mut fields = Fields::new();
    for case in CASES {
        let Case { command, typed, target, value, .. } = *case;
        let mut first = (case.house)();
        let untouched = first.truth();
        let lines = first.typed(typed);
        println!("{typed}: {lines:?}");
        assert!(!lines.iter().any(|line| line.starts_with("{\"error\"")), "{typed}: {lines:?}");
        assert_eq!(first.truth() != untouched, case.changes, "{typed}: {lines:?}");

        let mut second = (case.house)();
        let key = if command.is_confirmed() { KEY } else { 0 };
        assert_eq!(second.command(command as u16, target, value, key), Ok(()), "{typed}");
        second.finish();
        assert_eq!(second.truth(), first.truth(), "{typed}");
        let failed = lines.iter().any(|line| line.starts_with(r#"{"what":"failed""#));
        assert_eq!(second.read(OUTCOME, 1), [if failed { 3 } else { 2 }], "{typed}: {lines:?}");
        assert_eq!(second.read(REASON, 1)[0] != 0, failed, "{typed}");
        for line in &lines {
            fields.compare(&mut second, line);
        }
        fields.all_found_is_told(&mut second);
    }
    for register in REGISTERS_OF_RESULTS {
        assert!(fields.used.contains(*register), "{register} is told over Modbus alone");
    }
}

/// The T7 of slot 3 turns from 0° on: its lowest angle is that of the first value after the command.
#[test]
fn extremes_are_forgotten_through_both_doors() {
    let mut fields = Fields::new();
    let mut lowest = |house: &mut House, slot: usize| fields.value(house, &format!("slot{slot:02}_lowest"));
    for (typed, value) in [("extremes clear 3", 0), ("extremes clear", 1)] {
        let mut first = House::new();
        first.run(1_000_000);
        let before = lowest(&mut first, 3).expect("an angle");
        first.typed(typed);
        first.run(500_000);
        let mut second = House::new();
        second.run(1_000_000);
        assert_eq!(second.command(Command::ClearExtremes as u16, 3, value, 0), Ok(()));
        second.run(500_000);
        for house in [&mut first, &mut second] {
            assert!(lowest(house, 3).expect("an angle") > before + 5.0, "{typed}");
            assert!(lowest(house, 0).is_some_and(|angle| (angle - 30.0).abs() < 0.1), "{typed}");
        }
    }
}

/// Begun and stopped through each door; what was found until then stays.
#[test]
fn what_is_begun_is_stopped_through_both_doors() {
    let mut first = House::new();
    first.begin_typed("t7 scan", 300_000);
    let lines = first.typed("cancel");
    let swept = lines
        .iter()
        .find(|line| line.starts_with(r#"{"what":"swept""#))
        .unwrap_or_else(|| panic!("{lines:?}"));
    assert!(swept.ends_with(r#""complete":false}"#), "{lines:?}");

    let mut second = House::new();
    assert_eq!(second.command(Command::Scan as u16, 0, 0, 0), Ok(()));
    second.run(300_000);
    assert_eq!(second.command(Command::Cancel as u16, 0, 0, 0), Ok(()));
    second.finish();
    // A scan that is stopped is done: it has found what it has found.
    assert_eq!(second.read(OUTCOME, 1), [2]);
    let mut fields = Fields::new();
    fields.compare(&mut second, swept);
    assert_eq!(second.read(0x0A00, 3), [1, 1, 5], "scan 1 has found T7 5");
    assert_eq!(first.truth(), second.truth());
}

/// Everything in the list is tried, in each of its forms at the console.
#[test]
fn the_list_is_tried_whole() {
    let tried: BTreeSet<&str> =
        CASES.iter().map(|case| case.command.description().name).chain(["cancel"]).collect();
    let listed: BTreeSet<&str> = Command::ALL.iter().map(|command| command.description().name).collect();
    assert_eq!(tried, listed);
    for command in Command::ALL.into_iter().filter(|command| *command != Command::Cancel) {
        for form in command.description().typed {
            let fits = |case: &&Case| case.command == command && is_of(case.typed, form);
            assert!(CASES.iter().any(|case| fits(&case)), "{form} is not tried");
        }
    }
}

/// Whether what was typed is of a form: words as they are, except those in capitals and those with a choice.
fn is_of(typed: &str, form: &str) -> bool {
    let typed = typed.strip_suffix(" --yes").unwrap_or(typed);
    let (words, parts): (Vec<_>, Vec<_>) = (typed.split(' ').collect(), form.split(' ').collect());
    let is_free = |part: &str| part.contains('|') || part.chars().all(char::is_uppercase);
    words.len() == parts.len() && words.iter().zip(parts).all(|(word, part)| *word == part || is_free(part))
}

/// What cannot be is refused through Modbus as the other commands are, and nothing is begun.
#[test]
fn what_cannot_be_is_an_exception() {
    let mut house = House::new();
    for (command, target, value, exception) in [
        // No scan of the ISU bus, no such bus, no such rates.
        (Command::Scan, 1, 0, 3),
        (Command::Scan, 2, 0, 3),
        (Command::Scan, 0, 2, 3),
        (Command::Scan, 0, 9_600, 3),
        // A PWM input, an unused slot, no slot, a T7.
        (Command::SensorInfo, 2, 0, 3),
        (Command::SensorInfo, 30, 0, 3),
        (Command::SensorInfo, 48, 0, 3),
        (Command::SensorReset, 0, 0, 3),
    ] {
        assert_eq!(house.command(command as u16, target, value, 0), Err(exception), "{command:?} {target}");
    }
    // A wrong key is one for every command.
    assert_eq!(house.command(Command::Scan as u16, 0, 0, 0x1234), Err(3));
    assert_eq!(house.read(0x1F08, 3), [0, 0, 0], "none was accepted");
    assert_eq!(house.read(0x09C0, 4), [0, 0xFFFF, 0, 0]);

    // While the console has the bus, and while a scan of this door has it.
    house.begin_typed("t7 scan", 100_000);
    assert_eq!(house.command(Command::Scan as u16, 0, 0, 0), Err(6));
    assert_eq!(house.command(Command::SensorInfo as u16, 0, 0, 0), Err(6));
    house.finish();
    assert_eq!(house.command(Command::Scan as u16, 0, 0, 0), Ok(()));
    assert_eq!(house.command(Command::SensorInfo as u16, 1, 0, 0), Err(6));
    house.finish();
    assert_eq!(house.read(OUTCOME, 2), [2, 1]);
    house.in_safe_mode();
    assert_eq!(house.command(Command::Scan as u16, 0, 0, 0), Err(4));
    assert_eq!(house.command(Command::SensorInfo as u16, 0, 0, 0), Err(4));
    assert_eq!(house.command(Command::SensorReset as u16, 1, 0, 0), Err(4));
    // What was found before stays.
    assert_eq!(house.read(0x0A00, 3), [1, 1, 5]);
}

/// Blocks of one scan carry its number; a scan that is accepted clears those of the one before, other commands do not.
#[test]
fn two_scans_never_mix() {
    let mut house = House::new();
    assert_eq!(house.command(Command::Scan as u16, 0, 1, 0), Ok(()));
    house.finish();
    let found = house.read(0x09C3, 1)[0];
    // T7s 5 and 9, and two at one address.
    assert_eq!(found, 3);
    for place in 0..4 {
        let block = house.read(0x0A00 + 0x10 * place, 3);
        assert_eq!(block[0], u16::from(place < found), "{block:?}");
    }
    assert_eq!(house.command(Command::SensorInfo as u16, 0, 0, 0), Ok(()));
    house.finish();
    assert_eq!(house.read(0x09C0, 4), [2, 0xFFFF, 1, 3], "of the second command; the scan is the first");
    assert_eq!(house.command(Command::Scan as u16, 0, 0, 0), Ok(()));
    assert_eq!(house.read(0x09C0, 4), [3, 0xFFFF, 3, 0]);
    let rest: Vec<u16> = (0..48).map(|place| house.read(0x0A00 + 0x10 * place, 1)[0]).collect();
    assert_eq!(rest, [0; 48]);
    house.finish();
    let scans: Vec<u16> = (0..4).map(|place| house.read(0x0A00 + 0x10 * place, 1)[0]).collect();
    assert_eq!(scans, [3, 3, 3, 0]);
}

//! The table. Addresses as on the wire.

use clino_gateway::settings::{self, Setting, slot};
use clino_gateway::{Alarm, Bus, BusSettings, MAX_SLOTS, features};
use clino_recovery::PLACE;

use super::{
    Block, BusItem as B, CommandItem as C, DetailItem as D, Entry, Form, FoundItem as F, GatewayItem as G,
    Item, ReadingItem as R, ResultItem as N, StartItem as T,
};

/// The first four bytes: "INCL".
pub const MAGIC: u32 = 0x494E_434C;
/// Version of the map. Whatever changes the meaning of a register changes it.
pub const VERSION: u16 = 2;
/// A constant that shows in which order a client takes bytes and words.
pub const TEST_NUMBER: u32 = 0x1234_5678;
/// The same for floating point, in millidegrees: 123.456.
pub const TEST_ANGLE: i32 = 123_456;
/// Address of the block of slot 0.
pub const SLOT_BASE: u16 = 0x0100;
/// From the block of a slot to that of the next.
pub const SLOT_STRIDE: u16 = 0x20;

/// Slots of the map.
pub const SLOTS: usize = MAX_SLOTS;
/// Findings of a scan that are kept; further ones are only counted.
pub const FOUND: usize = if features::COMMISSIONING { 48 } else { 0 };
const COUNT: u16 = SLOTS as u16;
const ALL: u8 = SLOTS as u8;
/// Slots of the first block of angles and ages; the others are in the second.
const FIRST: u8 = 32;
const OTHERS: u8 = ALL - FIRST;

/// The register map. A block of something that this build does not have has no instance: its registers do not exist.
pub const BLOCKS: &[Block] = &[
    Block {
        name: "gateway",
        prefix: "",
        base: 0x0000,
        stride: 0x20,
        count: 1,
        entries: GATEWAY,
        text: "Identity of the gateway, layout of the map, state of the gateway as a whole.",
    },
    Block {
        name: "fast",
        prefix: "",
        base: 0x0020,
        stride: 0x60,
        count: 1,
        entries: FAST,
        text: "Angles and ages of the first 32 slots: 96 registers, one read, one state.",
    },
    Block {
        name: "fast2",
        prefix: "",
        base: 0x0080,
        stride: 0x60,
        count: 1,
        entries: FAST2,
        text: "Angles and ages of the other slots and the status of all: 96 registers, one read, one state.",
    },
    Block {
        name: "slot",
        prefix: "slot",
        base: SLOT_BASE,
        stride: SLOT_STRIDE,
        count: COUNT,
        entries: SLOT,
        text: "Value, state and counters of one slot.",
    },
    Block {
        name: "mirrors",
        prefix: "",
        base: 0x0700,
        stride: 0x90,
        count: 1,
        entries: MIRRORS,
        text: "All angles again, as floating point and as 16-bit numbers.",
    },
    Block {
        name: "swapped",
        prefix: "",
        base: 0x0800,
        stride: 0xC0,
        count: 1,
        entries: SWAPPED,
        text: "All angles again for clients that can only take 32-bit numbers low word first (CDAB).",
    },
    Block {
        name: "bus",
        prefix: "bus",
        base: 0x0900,
        stride: 0x40,
        count: Bus::COUNT as u16,
        entries: BUS,
        text: "Counters and times of a bus since reset. Bus 0 is the T7 bus, bus 1 the ISU bus. Counters wrap.",
    },
    Block {
        name: "start",
        prefix: "",
        base: 0x0980,
        stride: 0x40,
        count: 1,
        entries: START,
        text: "Cause, number and mode of the starts, and the last crash since power-up.",
    },
    Block {
        name: "result",
        prefix: "result",
        base: 0x09C0,
        stride: 0x40,
        count: features::COMMISSIONING as u16,
        entries: RESULT,
        text: "Results of the last command. Numbers that the command does not have are unavailable. Cleared when a command \
               is accepted.",
    },
    Block {
        name: "scan results",
        prefix: "found",
        base: 0x0A00,
        stride: 0x10,
        count: FOUND as u16,
        entries: SCAN,
        text: "Devices and suspects that the last *scan* has found, in the order of discovery; *result_scan* and \
               *result_found* give the scan and the number found. Cleared only when a scan is accepted. *scan* is the \
               same in all blocks in use: two scans never mix.",
    },
    Block {
        name: "slot counters",
        prefix: "slot",
        base: 0x0D00,
        stride: 0x10,
        count: COUNT,
        entries: SLOT_COUNTERS,
        text: "Further values and counters of a slot.",
    },
    Block {
        name: "slot settings",
        prefix: "slot",
        base: 0x1000,
        stride: 0x20,
        count: COUNT,
        entries: SLOT_SETTINGS,
        text: "Settings of a slot. They take effect at once and survive a reset only after the command *save*.",
    },
    Block {
        name: "T7 bus settings",
        prefix: "bus0",
        base: 0x1800,
        stride: 0x10,
        count: 1,
        entries: T7_SETTINGS,
        text: "Settings of the T7 bus. They take effect as soon as no exchange is under way.",
    },
    Block {
        name: "ISU bus settings",
        prefix: "bus1",
        base: 0x1810,
        stride: 0x10,
        count: features::ISU as u16,
        entries: ISU_SETTINGS,
        text: "Settings of the ISU bus.",
    },
    Block {
        name: "port settings",
        prefix: "port",
        base: 0x1840,
        stride: 0x10,
        count: 1,
        entries: PORT_SETTINGS,
        text: "Settings of this Modbus port. They take effect after the answer to the write.",
    },
    Block {
        name: "console settings",
        prefix: "console",
        base: 0x1850,
        stride: 0x10,
        count: 1,
        entries: CONSOLE_SETTINGS,
        text: "Settings of the console.",
    },
    Block {
        name: "slot names",
        prefix: "slot",
        base: 0x1900,
        stride: 0x10,
        count: COUNT,
        entries: SLOT_NAMES,
        text: "Name of a slot. Write it whole, or from its beginning on.",
    },
    Block {
        name: "slot alarm settings",
        prefix: "slot",
        base: 0x1C00,
        stride: 0x10,
        count: COUNT,
        entries: SLOT_ALARMS,
        text: "Settings of the alarms of a slot.",
    },
    Block {
        name: "command",
        prefix: "",
        base: 0x1F00,
        stride: 0x10,
        count: 1,
        entries: COMMAND,
        text: "Commands. A write begins with the command register; registers that it leaves out count as zero.",
    },
    Block {
        name: "slot alarms",
        prefix: "slot",
        base: 0x2000,
        stride: 0x20,
        count: COUNT,
        entries: SLOT_ALARM_STATES,
        text: "State of the alarms of a slot; its lowest and its highest angle.",
    },
];

const fn gateway(
    offset: u16,
    form: Form,
    item: G,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Gateway(item), name, unit, text)
}

const GATEWAY: &[Entry] = &[
    gateway(0, Form::U32, G::Magic, "magic", "", "\"INCL\" in ASCII: 0x494E434C"),
    gateway(2, Form::U16, G::MapVersion, "map_version", "", "version of this map: 2"),
    gateway(3, Form::U16, G::SlotCount, "slot_count", "", "slots of the map: 48"),
    gateway(4, Form::U16, G::SlotBase, "slot_base", "", "address of the block of slot 0: 0x0100"),
    gateway(
        5,
        Form::U16,
        G::SlotStride,
        "slot_stride",
        "",
        "distance from one slot's block to the next: 0x20",
    ),
    gateway(
        6,
        Form::U16,
        G::Version,
        "firmware",
        "",
        "firmware version: major in the high byte, minor in the low byte",
    ),
    gateway(7, Form::U16, G::Patch, "firmware_patch", "", "firmware patch number"),
    gateway(8, Form::U32, G::Uptime, "uptime", "s", "time since reset"),
    gateway(
        10,
        Form::U16,
        G::Status,
        "gateway_status",
        "bits",
        "status bits, see *gateway status*; also FC 08, sub-function 2",
    ),
    gateway(11, Form::U16, G::Sequence, "sequence", "", "counter of published states; wraps"),
    gateway(12, Form::U32, G::TestNumber, "test_number", "", "always 0x12345678 = 305419896"),
    gateway(14, Form::F32, G::TestAngle, "test_angle", "deg", "always 123.456 = 0x42F6E979"),
    gateway(
        16,
        Form::U32,
        G::Online,
        "online_0_31",
        "bits",
        "bit n: the last attempt to read slot n brought a sign of life",
    ),
    gateway(18, Form::U32, G::Valid, "valid_0_31", "bits", "bit n: the angle of slot n is right and fresh"),
    gateway(20, Form::U32, G::Online, "online_32_47", "bits", "bit n: the same for slot 32 + n").times(32, 1),
    gateway(22, Form::U32, G::Valid, "valid_32_47", "bits", "bit n: the same for slot 32 + n").times(32, 1),
    gateway(24, Form::U16, G::Enabled, "slots_enabled", "", "number of slots in use and switched on"),
    gateway(25, Form::U16, G::Good, "slots_ok", "", "number of these slots whose angle is right and fresh"),
    gateway(
        26,
        Form::U16,
        G::OldestAge,
        "oldest_age",
        "ms",
        "greatest age of the slots in use and switched on; see *age*",
    ),
    gateway(
        28,
        Form::U32,
        G::Alarms,
        "alarm_0_31",
        "bits",
        "bit n: an alarm of slot n is active or unacknowledged",
    ),
    gateway(30, Form::U32, G::Alarms, "alarm_32_47", "bits", "bit n: the same for slot 32 + n").times(32, 1),
];

const fn reading(
    offset: u16,
    form: Form,
    item: R,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Reading(item), name, unit, text)
}

const ANGLE: &str = "angle";
const AGE: &str =
    "time since the last good value; unavailable from 65.535 s on, or without a good value since reset";

const FAST: &[Entry] = &[
    reading(0x00, Form::I32, R::Angle, "angle", "mdeg", ANGLE).times(0, FIRST),
    reading(0x40, Form::U16, R::Age, "age", "ms", AGE).times(0, FIRST),
];

const FAST2: &[Entry] = &[
    reading(0x00, Form::I32, R::Angle, "angle", "mdeg", ANGLE).times(FIRST, OTHERS),
    reading(0x20, Form::U16, R::Age, "age", "ms", AGE).times(FIRST, OTHERS),
    reading(0x30, Form::U16, R::Status, "status", "code", "status, see *status of a slot*").times(0, ALL),
];

const MIRRORS: &[Entry] = &[
    reading(0x00, Form::F32, R::Degrees, "angle_f32", "deg", ANGLE).times(0, ALL),
    reading(0x60, Form::I16, R::Centidegrees, "angle_i16", "0.01 deg", "angle from −180.00° up to 179.99°")
        .times(0, ALL),
];

const SWAPPED: &[Entry] = &[
    reading(0x00, Form::I32Swapped, R::Angle, "angle_i32_cdab", "mdeg", ANGLE).times(0, ALL),
    reading(0x60, Form::F32Swapped, R::Degrees, "angle_f32_cdab", "deg", ANGLE).times(0, ALL),
];

const fn detail(
    offset: u16,
    form: Form,
    item: D,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Detail(item), name, unit, text)
}

const SLOT: &[Entry] = &[
    reading(0, Form::U16, R::Status, "status", "code", "status, see *status of a slot*"),
    detail(1, Form::U16, D::Flags, "flags", "bits", "flags, see *flags of a slot*"),
    reading(2, Form::I32, R::Angle, "angle_mdeg", "mdeg", ANGLE),
    reading(4, Form::F32, R::Degrees, "angle_deg", "deg", ANGLE),
    reading(6, Form::I16, R::Centidegrees, "angle_cdeg", "0.01 deg", "angle from −180.00° up to 179.99°"),
    detail(
        7,
        Form::I16,
        D::Temperature,
        "temperature",
        "0.01 °C",
        "temperature of a T7 whose *ask* is *everything*",
    ),
    reading(8, Form::U16, R::Age, "age", "ms", AGE),
    detail(9, Form::U16, D::Sequence, "sequence", "", "counter of readings, good or bad; wraps"),
    detail(
        10,
        Form::I32,
        D::Raw,
        "raw_mdeg",
        "mdeg",
        "angle as the sensor reports it; ISU and PWM: 0.000° up to 359.999°",
    ),
    detail(
        12,
        Form::I32,
        D::Unwrapped,
        "unwrapped_mdeg",
        "mdeg",
        "angle with the turns since the first value; unavailable beyond 5 965 turns",
    ),
    detail(14, Form::U16, D::LastError, "last_error", "code", "status of the last reading that failed"),
    detail(
        16,
        Form::U32,
        D::Requests,
        "requests",
        "",
        "requests, retries included; wraps, like all counters that follow",
    ),
    detail(18, Form::U32, D::FirstTry, "first_try", "", "good answers to the first try"),
    detail(20, Form::U16, D::Retries, "retries", "", "repeated requests"),
    detail(21, Form::U16, D::Timeouts, "timeouts", "", "requests without an answer in time"),
    detail(22, Form::U16, D::Checksum, "checksum", "", "answers with a wrong checksum"),
    detail(23, Form::U16, D::Length, "length", "", "answers of a wrong length, address or command"),
    detail(24, Form::U16, D::Late, "late", "", "good answers that came too late"),
    detail(25, Form::U16, D::Writes, "nv_writes", "", "writes to the sensor's non-volatile memory"),
    detail(
        26,
        Form::U16,
        D::ResponseLast,
        "response_last",
        "10 us",
        "response time of the last good answer; 0: none yet",
    ),
    detail(27, Form::U16, D::ResponseMax, "response_max", "10 us", "longest response time"),
    detail(30, Form::U16, D::Kind, "kind", "code", "kind of source, see *kinds*"),
    detail(31, Form::U16, D::Address, "address", "", "address on the bus, or number of the PWM input"),
];

const fn bus(offset: u16, item: B, name: &'static str, unit: &'static str, text: &'static str) -> Entry {
    Entry::new(offset, Form::U32, Item::Bus(item), name, unit, text)
}

const BUS: &[Entry] = &[
    bus(0, B::Requests, "requests", "", "requests, retries included"),
    bus(2, B::Retries, "retries", "", "repeated requests, included in *requests*"),
    bus(4, B::Writes, "nv_writes", "", "writes to non-volatile memory, included in *requests*"),
    bus(6, B::Good, "good", "", "answers that passed every check"),
    bus(8, B::FirstTry, "first_try", "", "good answers to the first try"),
    bus(10, B::NoAnswer, "no_answer", "", "requests without an answer in time"),
    bus(12, B::BadAnswer, "bad_answer", "", "requests to which something other than the answer came back"),
    bus(14, B::Checksum, "checksum", "", "frames with a wrong checksum"),
    bus(16, B::Length, "length", "", "frames of a wrong length"),
    bus(18, B::Foreign, "foreign", "", "intact answers from another address or to another command"),
    bus(20, B::Late, "late", "", "good answers that came too late"),
    bus(22, B::Forced, "forced", "", "times the line driver had to be switched off by force"),
    bus(24, B::LineBusy, "line_busy", "", "requests dropped because the line did not fall silent"),
    bus(26, B::Contention, "contention", "", "requests during which another sender transmitted"),
    bus(28, B::Echo, "echo", "", "own characters that came back"),
    bus(30, B::Junk, "junk", "", "characters that belong to no frame"),
    bus(32, B::Framing, "framing", "", "characters with a low stop bit"),
    bus(34, B::Noise, "noise", "", "characters whose samples disagreed"),
    bus(36, B::Overrun, "overrun", "", "characters after which at least one was lost"),
    bus(38, B::Parity, "parity", "", "characters with wrong parity"),
    bus(40, B::ResponseLast, "response_last", "us", "response time of the last good answer"),
    bus(42, B::ResponseMin, "response_min", "us", "shortest response time of a good answer; 0: none yet"),
    bus(44, B::ResponseMax, "response_max", "us", "longest response time of a good answer"),
    bus(46, B::ReleaseMax, "de_release_max", "ns", "longest time from our last stop bit to DE low"),
    bus(48, B::HighMax, "de_high_max", "us", "longest time DE was high"),
    bus(50, B::Unasked, "unasked", "", "characters that came before a request was out"),
    bus(52, B::Breaks, "breaks", "", "characters of zeros with a low stop bit"),
    bus(54, B::Fault, "fault", "code", "reason why no node of the bus answers, see *bus faults*"),
    bus(56, B::Faults, "faults", "", "number of times the bus was declared faulty"),
    bus(58, B::InVain, "in_vain", "", "requests in vain since the last good answer of any node"),
];

const fn start(
    offset: u16,
    form: Form,
    item: T,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Start(item), name, unit, text)
}

const START: &[Entry] = &[
    start(0, Form::U16, T::Cause, "start_cause", "code", "cause of this start, see *causes*"),
    start(1, Form::U16, T::Mode, "start_mode", "code", "mode of this start, see *modes*"),
    start(2, Form::U16, T::Clock, "clock_source", "code", "source of time and bit rates, see *clocks*"),
    start(3, Form::U16, T::CrashCause, "crash_cause", "code", "cause of the last crash, see *causes*"),
    start(4, Form::U32, T::Boots, "boots", "", "starts since power-up, this one included; wraps"),
    start(6, Form::U32, T::Crashes, "crashes", "", "number of previous runs that ended in a crash; wraps"),
    start(8, Form::U32, T::CrashBoot, "crash_boot", "", "number of the start that crashed, counted like *boots*"),
    start(10, Form::U32, T::CrashUptime, "crash_uptime", "ms", "time from that start to the crash; unavailable from 49.7 days on"),
    start(
        12,
        Form::U32,
        T::CrashDetail,
        "crash_detail",
        "",
        "cause *stalled*: the monitored task, see *duties*; cause *panic*: the line of the file",
    ),
    start(14, Form::U16, T::Exception, "crash_exception", "", "number of the active exception; 0: the main loop"),
    start(16, Form::U32, T::Pc, "crash_pc", "", "address of the instruction"),
    start(18, Form::U32, T::Lr, "crash_lr", "", "link register: return address"),
    start(20, Form::U32, T::Sp, "crash_sp", "", "stack pointer"),
    start(22, Form::U32, T::Cfsr, "crash_cfsr", "bits", "configurable fault status register (ARMv7-M)"),
    start(24, Form::U32, T::Hfsr, "crash_hfsr", "bits", "HardFault status register (ARMv7-M)"),
    start(26, Form::U32, T::Address, "crash_address", "", "address of the faulty access"),
    start(
        28,
        Form::U16,
        T::File,
        "crash_file",
        "",
        "end of the file name of a panic, two ASCII characters in each register, the first in the high byte; then 0",
    )
    .times(0, FILE),
    start(40, Form::U32, T::Uid, "uid", "", "unique number of the chip: three words, the lowest first")
        .times(0, 3),
    start(46, Form::U32, T::PowerUps, "power_ups", "", "number of power-ups; with *boots* it identifies this start among all starts of the board; 0: not known"),
];

/// Registers for the name of a file.
const FILE: u8 = (PLACE / 2) as u8;

const SLOT_COUNTERS: &[Entry] = &[
    detail(0, Form::I32, D::Rate, "rate_now", "mdeg/s", "rate of change of the angle"),
    detail(2, Form::I32, D::Turns, "turns", "", "whole turns since the first value"),
    detail(
        4,
        Form::U16,
        D::Foreign,
        "foreign",
        "",
        "answers from another address or to another command; also counted in *length*",
    ),
    detail(
        5,
        Form::U16,
        D::Skipped,
        "skipped",
        "",
        "readings that were not begun because the bus was too busy in their period",
    ),
    detail(
        6,
        Form::U16,
        D::Garbled,
        "garbled",
        "",
        "answers with misread characters, or disturbed by another sender",
    ),
    detail(7, Form::U16, D::Refused, "refused", "", "answers that refuse, or with a value out of its range"),
    detail(8, Form::U16, D::NotSent, "not_sent", "", "requests that were not sent"),
    detail(9, Form::U16, D::ResponseMin, "response_min", "10 us", "shortest response time; 0: none yet"),
];

const fn result(
    offset: u16,
    form: Form,
    item: N,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Result(item), name, unit, text)
}

const RANGES: &[&str] = &["bidirectional", "unidirectional"];

const RESULT: &[Entry] = &[
    result(
        0,
        Form::U16,
        N::Sequence,
        "sequence",
        "",
        "*command_sequence* of the command that gave these numbers",
    ),
    result(1, Form::U16, N::Writes, "writes", "", "writes to the sensor's non-volatile memory"),
    result(
        2,
        Form::U16,
        N::Scan,
        "scan",
        "",
        "*command_sequence* of the scan in *scan results*; 0: none since reset",
    ),
    result(
        3,
        Form::U16,
        N::Found,
        "found",
        "",
        "devices and suspects that this scan has found so far; the first 48 are in *scan results*",
    ),
    result(4, Form::U16, N::Devices, "devices", "", "*scan*, at its end: T7s found"),
    result(
        5,
        Form::U16,
        N::Suspects,
        "suspects",
        "",
        "suspects: addresses at which something unintelligible answers",
    ),
    result(6, Form::U16, N::Asked, "asked", "", "addresses asked, counted at each bit rate"),
    result(7, Form::U16, N::Complete, "complete", "", "1: the scan left nothing out; 0: it was stopped"),
    result(
        8,
        Form::U16,
        N::Address,
        "address",
        "",
        "ISU: stored address, or the address at which it answers after a start",
    ),
    result(9, Form::U16, N::Stored, "stored_address", "", "*sensor_repair*: stored address of the ISU"),
    result(10, Form::U32, N::Serial, "serial", "", "T7: serial number"),
    result(
        12,
        Form::U32,
        N::Product,
        "product",
        "",
        "T7: product, four ASCII characters, padded with blanks",
    ),
    result(14, Form::U16, N::Product2, "product_2", "", "last two characters of the product"),
    result(
        16,
        Form::U32,
        N::Firmware,
        "firmware",
        "",
        "T7: firmware version, four ASCII characters, padded with blanks",
    ),
    result(18, Form::U16, N::Firmware2, "firmware_2", "", "last two characters of the firmware version"),
    result(19, Form::U16, N::Damping, "damping", "ms", "T7: time of the damping filter"),
    result(20, Form::U16, N::Range, "range", "", "T7: range of its angles").words(RANGES),
    result(21, Form::U16, N::Direction, "direction", "", "T7: sense of rotation of axes 0 to 2")
        .times(0, 3)
        .words(&["normal", "reversed"]),
    result(24, Form::I32, N::Offset, "offset", "mdeg", "T7: offset; axes 0 to 2").times(0, 3),
    result(30, Form::I32, N::Before, "before", "mdeg", "*sensor_zero*: angle before the command"),
    result(32, Form::I32, N::After, "after", "mdeg", "*sensor_zero*: angle after the command"),
    result(
        34,
        Form::I32,
        N::From,
        "from",
        "",
        "setting of a sensor: value before, in the form of *command_value*; unavailable: unchanged",
    ),
    result(36, Form::I32, N::To, "to", "", "setting of a sensor: value now, in the form of *command_value*"),
    result(38, Form::I32, N::Angle, "angle", "mdeg", "ISU: angle"),
    result(40, Form::I32, N::Null, "null_position", "mdeg", "ISU: position at which its angle is zero"),
    result(
        42,
        Form::U16,
        N::Shutoff,
        "auto_shutoff_word",
        "",
        "ISU: the word of its EEPROM with the auto-shutoff bit",
    ),
    result(43, Form::U16, N::Sound, "checksum_right", "", "ISU: 1: the checksum of its EEPROM is right"),
    result(44, Form::U16, N::Repair, "repair", "", "ISU, after a failure: 1: *sensor_repair* is needed"),
    result(46, Form::I32, N::Rate, "rate", "mdeg/s", "rate of the sensor, after the reason *moving*"),
];

const fn found(
    offset: u16,
    form: Form,
    item: F,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Found(item), name, unit, text)
}

const SCAN: &[Entry] = &[
    found(0, Form::U16, F::Scan, "scan", "", "*command_sequence* of the scan; 0: the block is empty"),
    found(
        1,
        Form::U16,
        F::What,
        "what",
        "",
        "0: nothing, 1: a T7, 2: a suspect: something answers, but never validly",
    ),
    found(2, Form::U16, F::Address, "address", "", "address"),
    found(4, Form::U32, F::Baud, "baud", "bit/s", "bit rate"),
    found(6, Form::U32, F::Serial, "serial", "", "serial number"),
    found(8, Form::U32, F::Product, "product", "", "product, four ASCII characters, padded with blanks"),
    found(10, Form::U16, F::Product2, "product_2", "", "last two characters of the product"),
    found(
        12,
        Form::U32,
        F::Firmware,
        "firmware",
        "",
        "firmware version, four ASCII characters, padded with blanks",
    ),
    found(14, Form::U16, F::Firmware2, "firmware_2", "", "last two characters of the firmware version"),
];

const fn setting(offset: u16, form: Form, id: u8, scale: u16) -> Entry {
    Entry::of_table(offset, form, Item::SlotSetting(id), id, &slot::TABLE, scale)
}

const SLOT_SETTINGS: &[Entry] = &[
    setting(0, Form::U16, slot::id::ENABLED, 1),
    setting(1, Form::U16, slot::id::KIND, 1).set(),
    setting(2, Form::U16, slot::id::ADDRESS, 1).set(),
    setting(3, Form::U16, slot::id::AXIS, 1),
    setting(4, Form::U32, slot::id::PERIOD, MILLI),
    setting(6, Form::U32, slot::id::STALE, MILLI),
    setting(8, Form::U16, slot::id::TIMEOUT, MILLI),
    setting(9, Form::U16, slot::id::RETRIES, 1).set(),
    setting(10, Form::I32, slot::id::ZERO, MILLI).unit("mdeg"),
    setting(12, Form::U16, slot::id::DIRECTION, 1),
    setting(13, Form::U16, slot::id::RANGE, 1),
    setting(14, Form::U16, slot::id::FILTER, 1),
    setting(15, Form::U16, slot::id::SAMPLES, 1),
    setting(16, Form::U16, slot::id::CONFIRM, 1),
    setting(17, Form::U16, slot::id::ASK, 1),
    setting(18, Form::U32, slot::id::RATE, 1).unit("mdeg/s"),
    setting(20, Form::U32, slot::id::REPORT, MILLI),
    setting(22, Form::I16, slot::id::PARTNER, 1),
    setting(23, Form::U16, slot::id::TOLERANCE, 1).unit("0.001"),
    setting(24, Form::U16, slot::id::STALE_AUTO, 1),
];

const fn name(offset: u16, id: u8) -> Entry {
    setting(offset, Form::U32, id, 1)
}

const SLOT_NAMES: &[Entry] = &[
    name(0, slot::id::NAME[0]),
    name(2, slot::id::NAME[1]),
    name(4, slot::id::NAME[2]),
    name(6, slot::id::NAME[3]),
];

const SLOT_ALARMS: &[Entry] = &[
    setting(0, Form::U16, slot::id::ALARM, 1),
    setting(1, Form::U16, slot::id::LATCH, 1),
    setting(2, Form::I32, slot::id::HIGH, 1).unit("mdeg"),
    setting(4, Form::I32, slot::id::LOW, 1).unit("mdeg"),
    setting(6, Form::U32, slot::id::HYSTERESIS, 1).unit("mdeg"),
    setting(8, Form::U16, slot::id::DELAY, 1).unit("0.1 s"),
    setting(9, Form::U16, slot::id::NO_VALUE, 1).unit("0.1 s"),
    setting(10, Form::U32, slot::id::ALARM_RATE, 1).unit("mdeg/s"),
];

const SLOT_ALARM_STATES: &[Entry] = &[
    detail(0, Form::U16, D::Alarms, "alarms", "bits", "states, see *alarms of a slot*"),
    detail(2, Form::U32, D::AlarmAge(Alarm::High), "high_age", "s", "time since *high* was first raised"),
    detail(4, Form::U32, D::AlarmAge(Alarm::Low), "low_age", "s", "time since *low* was first raised"),
    detail(6, Form::U32, D::AlarmAge(Alarm::Rate), "rate_age", "s", "time since *rate* was first raised"),
    detail(
        8,
        Form::U32,
        D::AlarmAge(Alarm::NoValue),
        "no_value_age",
        "s",
        "time since *no_value* was first raised",
    ),
    detail(
        10,
        Form::I32,
        D::AlarmExtreme(Alarm::High),
        "high_extreme",
        "mdeg",
        "highest angle of this alarm",
    ),
    detail(12, Form::I32, D::AlarmExtreme(Alarm::Low), "low_extreme", "mdeg", "lowest angle of this alarm"),
    detail(
        14,
        Form::I32,
        D::AlarmExtreme(Alarm::Rate),
        "rate_extreme",
        "mdeg/s",
        "fastest rate of this alarm",
    ),
    detail(16, Form::I32, D::Lowest, "lowest", "mdeg", "lowest angle since *clear_extremes*"),
    detail(18, Form::I32, D::Highest, "highest", "mdeg", "highest angle since *clear_extremes*"),
    detail(20, Form::U32, D::LowestAge, "lowest_age", "s", "time since the lowest angle"),
    detail(22, Form::U32, D::HighestAge, "highest_age", "s", "time since the highest angle"),
];

/// Registers in thousandths of the setting's own unit: milliseconds of microseconds, millidegrees of micro-degrees.
pub(super) const MILLI: u16 = 1_000;

const T7_BUS: &[Setting<BusSettings>; 5] = &settings::bus::table(Bus::T7);
const ISU_BUS: &[Setting<BusSettings>; 5] = &settings::bus::table(Bus::Isu);

const fn bus_setting(
    bus: Bus,
    offset: u16,
    form: Form,
    id: u8,
    table: &'static [Setting<BusSettings>; 5],
) -> Entry {
    Entry::of_table(offset, form, Item::BusSetting(id), id, table, 1).times(bus as u8, 1)
}

const fn bus_settings(bus: Bus, table: &'static [Setting<BusSettings>; 5]) -> [Entry; 5] {
    [
        bus_setting(bus, 0, Form::U32, settings::bus::id::BAUD, table),
        bus_setting(bus, 2, Form::U16, settings::bus::id::GUARD, table),
        bus_setting(bus, 3, Form::U16, settings::bus::id::PRE, table),
        bus_setting(bus, 4, Form::U16, settings::bus::id::POST, table),
        bus_setting(bus, 5, Form::U16, settings::bus::id::ECHO, table).set(),
    ]
}

const T7_SETTINGS: &[Entry] = &bus_settings(Bus::T7, T7_BUS);
const ISU_SETTINGS: &[Entry] = &bus_settings(Bus::Isu, ISU_BUS);

const fn port(offset: u16, form: Form, id: u8) -> Entry {
    Entry::of_table(offset, form, Item::Port(id), id, &settings::port::TABLE, 1)
}

const PORT_SETTINGS: &[Entry] = &[
    port(0, Form::U16, settings::port::id::ADDRESS),
    port(1, Form::U16, settings::port::id::PARITY),
    port(2, Form::U32, settings::port::id::BAUD),
    port(4, Form::U16, settings::port::id::STOP_BITS),
    port(5, Form::U16, settings::port::id::ECHO),
    port(6, Form::U16, settings::port::id::PAUSES),
    port(7, Form::U16, settings::port::id::LOCKED),
];

const fn console(offset: u16, form: Form, id: u8) -> Entry {
    Entry::of_table(offset, form, Item::Console(id), id, &settings::console::TABLE, 1)
}

const CONSOLE_SETTINGS: &[Entry] = &[console(0, Form::U32, settings::console::id::IDLE)];

const fn command(
    offset: u16,
    form: Form,
    item: C,
    name: &'static str,
    unit: &'static str,
    text: &'static str,
) -> Entry {
    Entry::new(offset, form, Item::Command(item), name, unit, text)
}

const COMMAND: &[Entry] = &[
    command(0, Form::U16, C::Command, "command", "code", "command to carry out, see *commands*; reads 0")
        .writable(1, 24),
    command(
        1,
        Form::U16,
        C::Target,
        "command_target",
        "",
        "number of the slot or bus of the command; reads 0",
    )
    .writable(0, 47),
    command(2, Form::I32, C::Value, "command_value", "", "value of the command; reads 0")
        .writable(i32::MIN, i32::MAX),
    command(
        4,
        Form::U16,
        C::Key,
        "arm_key",
        "",
        "0x4E56 for commands that need the arm key, in the same request; reads 0",
    )
    .writable(0, 0xFFFF),
    command(
        8,
        Form::U16,
        C::Last,
        "last_command",
        "code",
        "the last command that was accepted; 0: none since reset",
    ),
    command(
        9,
        Form::U16,
        C::Outcome,
        "command_outcome",
        "code",
        "outcome of the last command, see *outcome of a command*",
    ),
    command(10, Form::U16, C::Sequence, "command_sequence", "", "counter of accepted commands; wraps"),
    command(11, Form::U16, C::Done, "command_done", "", "steps done"),
    command(12, Form::U16, C::Of, "command_of", "", "number of steps in all; 0: not known"),
    command(
        13,
        Form::U16,
        C::Reason,
        "command_reason",
        "code",
        "reason of the failure, see *reasons of a failed command*; 0: no failure",
    ),
    command(
        14,
        Form::U16,
        C::Silenced,
        "command_silenced",
        "",
        "number of other nodes, read by slots, that *sensor_baud* leaves at another bit rate than their bus",
    ),
];

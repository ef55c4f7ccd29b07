//! Every line of `docs/modbus.csv`, read from a server: what people are told is what they get.
//!
//! The list is the only thing taken from the map here; what each name has to say is known from the gateway itself.

mod common;

use std::cell::{Cell, RefCell};

use clino_bus::{DriverEnable, Duration, Instant};
use clino_codec::angle::Angle;
use clino_codec::pwm::{Limits, Ticks};
use clino_codec::t7::Axis;
use clino_gateway::config::{AlarmConfig, AlarmLimits, Ask, Direction, Filter, Kind, Name};
use clino_gateway::{Bus, Capture, Gateway, Published, PwmInput, Settings, SlotConfig, Source, Status};
use clino_modbus::Refusal;
use clino_modbus::binding::{Binding, DeferredRequest, Site};
use clino_recovery::{Clock, Crash, FaultStatus, Mode, MonitoredTask, Registers, Start, StartCause, Uid};
use common::board::Board;
use common::real::Real;
use common::{Bench, SETTINGS};

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
        let fields: Vec<_> = line.splitn(15, ',').collect();
        let hex = fields[1].strip_prefix("0x").expect("hexadecimal");
        let address = u16::from_str_radix(hex, 16).expect("an address");
        assert_eq!(fields[0].parse(), Ok(address));
        assert_eq!(fields[2].parse::<u32>().expect("a number"), u32::from(address) + 1);
        Line {
            address,
            name: fields[3],
            kind: fields[4],
            registers: fields[5].parse().expect("a number"),
            order: fields[6],
            writable: fields[7].contains('w'),
            limits: fields[10].parse().ok().zip(fields[11].parse().ok()),
            invalid: fields[12].strip_prefix("0x").map(|hex| u32::from_str_radix(hex, 16).expect("a number")),
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
    let mut bench = plant();
    let mut nones = 0;
    for line in lines() {
        let words = bench.read(line.address, line.registers).expect(line.name);
        let found = number(&line, &words);
        let expected = expected(line.name, &bench.host);
        if expected.is_none() {
            assert_eq!(line.invalid, Some(none(line.kind)), "{} can be none", line.name);
            nones += 1;
        }
        let mask = if line.registers == 1 { 0xFFFF } else { u32::MAX };
        assert_eq!(found, expected.unwrap_or(none(line.kind)) & mask, "{}", line.name);
    }
    // Among them slots without an angle, without a temperature, without a crash's detail.
    assert!(nones > 100, "{nones}");
}

/// Angles of all kinds of slots: both PWM inputs, each slot with a soft zero of its own; and some that have none.
fn plant() -> Bench {
    let mut table: Vec<SlotConfig> = (0..48_i32)
        .map(|slot| SlotConfig {
            soft_zero: Angle::from_mdeg(slot * 7_345 - 170_000).unwrap(),
            period: Duration::from_millis(40 + slot as u32),
            stale: Duration::from_millis(2_000 + slot as u32),
            report_every: Duration::from_millis(300 + slot as u32),
            tolerance: 500 + slot as u16,
            max_rate: 400_000 + slot as u32,
            direction: if slot == 2 { Direction::Reversed } else { Direction::Normal },
            partner: (slot == 8).then_some(47),
            ..SlotConfig::usual(Source::of(Kind::Pwm, slot as u8 % 2 + 1, Axis::Two))
        })
        .collect();
    let timed =
        |config| SlotConfig { timeout: Duration::from_millis(7), retries: 3, ask: Ask::Everything, ..config };
    table[1].name = Name::new("Boom 1").unwrap();
    table[3] = timed(SlotConfig::usual(Source::of(Kind::T7, 33, Axis::One)));
    table[4] = SlotConfig { filter: Filter::Median, samples: 5, ..table[4] };
    table[5].alarm = AlarmConfig {
        high: 12_345,
        low: -54_321,
        hysteresis: 70_000,
        rate: 100_001,
        delay: 36_000,
        no_value: 299,
        limits: AlarmLimits::Both,
        latching: true,
    };
    // Stale 40 ms after its last value.
    (table[5].period, table[5].stale) = (Duration::from_millis(10), Duration::from_millis(34));
    table[7] = SlotConfig::usual(Source::of(Kind::Isu, 3, Axis::Two));
    table[9] = SlotConfig::usual(Source::of(Kind::T7, 0, Axis::Two));
    table[11].enabled = false;
    table[40] = SlotConfig::OFF;
    let board = Board::with(&table);
    board.start.set(started());
    // The sensors of both buses do not answer.
    board.run();
    let mut bench = Bench::at(Real::on(board), SETTINGS, 573, 2_006);
    for input in [PwmInput::Pwm1, PwmInput::Pwm2] {
        let cycle = Capture::Cycle(Ticks { period: 2_800_000, high: 1_234_567 });
        bench.host.board.gateway.borrow_mut().pwm(input, cycle, bench.host.board.now.get());
    }
    bench.host.board.gateway.borrow_mut().publish();
    bench.host.board.now.set(bench.host.board.now.get() + Duration::from_micros(40_000));
    bench.read(0, 1).expect("a register");
    bench
}

/// A start after a fault of which everything is known.
fn started() -> Start {
    // The address is valid: BFARVALID, PRECISERR.
    let fault = FaultStatus::new(0x8200, 0x4000_0000, 0x1111_1111, 0x2222_2222);
    let registers = Registers { pc: 0x0801_0203, lr: 0x0801_0405, sp: 0x2001_FF08, exception: 22 };
    let crash = Crash::fault(fault, Some(registers), false);
    Start {
        cause: StartCause::PowerOn,
        power_ups: 70_005,
        boots: 70_001,
        crashes: 70_002,
        mode: Mode::Bare,
        clock: Clock::Fallback,
        crash: Some(Crash { boot: 70_003, uptime_ms: 70_004, ..crash }),
        uid: Uid([0x1122_3344, 0x5566_7788, 0x99AA_BBCC]),
    }
}

/// The status of each slot of the plant, restated.
fn status(slot: usize) -> Status {
    match slot {
        // The requests were not sent.
        3 | 7 => Status::NotSent,
        5 => Status::Stale,
        9 => Status::ConfigFault,
        11 | 40 => Status::Disabled,
        _ => Status::Ok,
    }
}

fn code(status: Status) -> u32 {
    match status {
        Status::Ok => 1,
        Status::Stale => 2,
        Status::NotSent => 7,
        Status::Disabled => 13,
        Status::ConfigFault => 14,
        other => panic!("{other:?}"),
    }
}

/// The registers of the block *start*.
fn start(crash: Option<Crash>) -> Vec<u16> {
    let mut bench = Bench::new();
    bench.host.board.start.set(Start { crash, ..started() });
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
    let words = start(Some(Crash::stalled(MonitoredTask::Storage, at)));
    assert_eq!((words[3], &words[12..15]), (8, &[0, 6, 0][..]));
    assert_eq!(words[16..22], [0x0800, 0x1234, 0x0800, 0x5678, 0x2000, 0x0100]);
    assert_eq!(words[22..28], [0xFFFF; 6]);
}

/// What a number of this name has to be, as its bits.
fn expected(name: &str, host: &Real) -> Option<u32> {
    let trailing =
        || name.rsplit('_').next().and_then(|number| number.parse::<usize>().ok()).expect("a number");
    if let Some((slot, name)) = name.strip_prefix("slot").and_then(|rest| rest.split_once('_'))
        && let Ok(slot) = slot.parse()
    {
        return slot_number(slot, name, host);
    }
    if let Some((bus, name)) = name.strip_prefix("bus").and_then(|rest| rest.split_once('_')) {
        return Some(bus_number(bus.parse().expect("a number"), name, host));
    }
    let now = host.board.now.get();
    Some(match name {
        "magic" => u32::from_be_bytes(*b"INCL"),
        "map_version" => 2,
        "slot_count" => 48,
        "slot_base" => 0x100,
        "slot_stride" => 32,
        "firmware" => 0x0102,
        "firmware_patch" => 3,
        "uptime" => (now.as_micros() / 1_000_000) as u32,
        // Both buses dead, a fault of the T7 bus, unsaved, safe mode, internal clock, slots without a value.
        "gateway_status" => 0x0001 | 0x0002 | 0x0008 | 0x0020 | 0x0040 | 0x0100 | 0x0400,
        "sequence" => 2,
        "test_number" => 305_419_896,
        "test_angle" => 123.456_f32.to_bits(),
        "online_0_31" => !(1 << 3 | 1 << 5 | 1 << 7 | 1 << 9 | 1 << 11),
        "valid_0_31" => !(1 << 3 | 1 << 5 | 1 << 7 | 1 << 9 | 1 << 11),
        // Slot 40 is off.
        "online_32_47" | "valid_32_47" => 0xFFFF & !(1 << 8),
        "alarm_0_31" | "alarm_32_47" => 0,
        "slots_enabled" => 46,
        "slots_ok" => 42,
        "oldest_age" => return None,
        "port_address" => 17,
        "port_parity" => 1,
        "port_baud" => 19_200,
        "port_stop_bits" => 1,
        "port_echo" | "port_pauses" | "port_locked" => 0,
        "console_idle" => 60,
        "command" | "command_target" | "command_value" | "arm_key" => 0,
        "start_cause" => 1,
        "start_mode" | "clock_source" => 2,
        "power_ups" => 70_005,
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
        "uid_00" => 0x1122_3344,
        "uid_01" => 0x5566_7788,
        "uid_02" => 0x99AA_BBCC,
        // There was no command and no scan.
        "result_sequence" | "result_scan" | "result_found" => 0,
        _ if name.starts_with("result_") => return None,
        _ if name.starts_with("found") => {
            return (name.ends_with("_scan") || name.ends_with("_what")).then_some(0);
        }
        "last_command" | "command_outcome" | "command_sequence" | "command_done" | "command_of"
        | "command_reason" | "command_silenced" => 0,
        _ if name.starts_with("angle_f32") => return degrees(trailing(), host),
        _ if name.starts_with("angle_i16") => return hundredths(trailing(), host),
        _ if name.starts_with("angle_i32_cdab") => return thousandths(trailing(), host),
        _ if name.starts_with("angle_") => return thousandths(trailing(), host),
        _ if name.starts_with("age_") => return milliseconds(trailing(), host),
        _ if name.starts_with("status_") => code(status(trailing())),
        other => panic!("{other}"),
    })
}

fn slot_number(slot: usize, name: &str, host: &Real) -> Option<u32> {
    let now = host.board.now.get();
    let config = host.config(slot);
    let reading = host.reading(slot);
    let counters = *host.board.gateway.borrow().slot_counters(slot).expect("a slot");
    let detail = host.board.gateway.borrow().detail(slot).expect("a slot");
    let ms = |span: Duration| span.as_micros() / 1_000;
    Some(match name {
        "status" => code(status(slot)),
        // Nothing new was read; the nodes are given up after a second.
        "flags" => u32::from(detail.is_dead) << 3,
        "angle_mdeg" => return thousandths(slot, host),
        "angle_deg" => return degrees(slot, host),
        "angle_cdeg" => return hundredths(slot, host),
        "temperature" => return None,
        "age" => return milliseconds(slot, host),
        "sequence" => reading.sequence & 0xFFFF,
        "raw_mdeg" => return reading.raw(now).map(|raw| Published::of_sensor(raw).mdeg() as u32),
        "unwrapped_mdeg" => return reading.unwrapped(now).map(|mdeg| mdeg as u32),
        "last_error" => return detail.last_error.map(code),
        "requests" => counters.requests,
        "first_try" => counters.first_try,
        "retries" => counters.retries,
        "timeouts" => counters.no_answer,
        "checksum" | "length" | "late" | "nv_writes" | "response_last" | "response_max" => 0,
        "alarms" => 0,
        "high_age" | "low_age" | "rate_age" | "no_value_age" => return None,
        "lowest" | "highest" => return extreme(slot, host),
        "lowest_age" | "highest_age" => return extreme(slot, host).map(|_| 0),
        "high_extreme" | "low_extreme" | "rate_extreme" => return None,
        "foreign" | "garbled" | "refused" | "response_min" => 0,
        "skipped" => counters.skipped.into(),
        "not_sent" => counters.not_sent.into(),
        "rate_now" => return reading.rate(now).map(i32::cast_unsigned),
        "turns" => return live(slot, host).map(|_| 0),
        "kind" | "set_kind" => match slot {
            3 | 9 => 1,
            7 => 2,
            40 => 0,
            _ => 3,
        },
        "address" | "set_address" => match slot {
            3 => 33,
            7 => 3,
            9 | 40 => 0,
            _ => slot as u32 % 2 + 1,
        },
        "enabled" => u32::from(slot != 11 && slot != 40),
        "axis" => {
            if slot == 3 {
                1
            } else {
                2
            }
        }
        "period" => ms(config.period),
        "stale" => ms(config.stale_after()),
        "stale_auto" => u32::from([3, 7, 9, 40].contains(&slot)),
        "timeout" => {
            if slot == 3 {
                7
            } else {
                0
            }
        }
        "set_retries" => config.retries.into(),
        "zero" => (config.soft_zero.udeg() / 1_000) as u32,
        "direction" => u32::from(slot == 2),
        "range" => u32::from(![3, 9, 40].contains(&slot)),
        "filter" => {
            if slot == 4 {
                2
            } else {
                0
            }
        }
        "samples" => {
            if slot == 4 {
                5
            } else {
                1
            }
        }
        "confirm" => u32::from([3, 7, 9].contains(&slot)),
        "ask" => u32::from(slot == 3),
        "rate" => config.max_rate,
        "report" => ms(config.report_every),
        "partner" => {
            if slot == 8 {
                47
            } else {
                0xFFFF
            }
        }
        "tolerance" => config.tolerance.into(),
        "alarm" => config.alarm.limits as u32,
        "latch" => config.alarm.latching.into(),
        "high" => config.alarm.high.cast_unsigned(),
        "low" => config.alarm.low.cast_unsigned(),
        "hysteresis" => config.alarm.hysteresis,
        "delay" => config.alarm.delay.into(),
        "no_value" => config.alarm.no_value.into(),
        "alarm_rate" => config.alarm.rate,
        // "Boom 1", in slot 1.
        "name" => {
            if slot == 1 {
                0x426F_6F6D
            } else {
                0
            }
        }
        "name_2" => {
            if slot == 1 {
                0x2031_0000
            } else {
                0
            }
        }
        "name_3" | "name_4" => 0,
        other => panic!("{other}"),
    })
}

fn bus_number(number: u32, name: &str, host: &Real) -> u32 {
    let bus = [Bus::T7, Bus::Isu][number as usize];
    let gateway = host.board.gateway.borrow();
    let (counters, health) = (gateway.counters(bus), gateway.health(bus));
    match name {
        "baud" => [115_200, 9_600][number as usize],
        "guard" => [87, 1_042][number as usize],
        "pre" | "post" | "set_echo" => 0,
        "de_release_max" => 1_700,
        "de_high_max" => 300,
        "requests" => counters.requests,
        "retries" => counters.retries,
        "no_answer" => counters.no_answer,
        "forced" => counters.forced,
        "fault" => health.fault.map_or(0, |fault| fault as u32),
        "faults" => health.faults,
        "in_vain" => health.in_vain,
        // Nothing was ever heard.
        _ => 0,
    }
}

fn live(slot: usize, host: &Real) -> Option<i32> {
    let now = host.board.now.get();
    let angle = host.reading(slot).angle(now);
    assert_eq!(angle.is_some(), status(slot) == Status::Ok, "slot {slot}");
    angle.map(|angle| angle.mdeg())
}

fn thousandths(slot: usize, host: &Real) -> Option<u32> {
    live(slot, host).map(|mdeg| mdeg as u32)
}

fn degrees(slot: usize, host: &Real) -> Option<u32> {
    live(slot, host).map(|mdeg| ((f64::from(mdeg) / 1e3) as f32).to_bits())
}

fn hundredths(slot: usize, host: &Real) -> Option<u32> {
    live(slot, host).map(|mdeg| {
        let degrees = f64::from(mdeg) / 1e3;
        let turned = degrees - 360.0 * (degrees / 360.0).round();
        let hundredths = (f64::from((turned * 1e3).round() as i32) / 10.0).round() as i32;
        // A half turn is the negative one.
        (if hundredths == 18_000 { -18_000 } else { hundredths }) as u32
    })
}

/// The only angle there was, of the slots whose PWM input had a cycle; slot 5 had it, too, before it grew stale.
fn extreme(slot: usize, host: &Real) -> Option<u32> {
    let reading = host.reading(slot);
    let fresh = host.board.now.get() - Duration::from_micros(40_000);
    reading.angle(fresh).map(|angle| angle.mdeg() as u32).filter(|_| ![3, 7, 9, 11, 40].contains(&slot))
}

/// 40 ms, of the slots whose PWM input had a cycle; no other ever had a value.
fn milliseconds(slot: usize, host: &Real) -> Option<u32> {
    _ = host;
    (![3, 7, 9, 11, 40].contains(&slot)).then_some(40)
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
    for range in [0x0000..0x00E0_u16, 0x0100..0x0790, 0x0800..0x08C0, 0x0900..0x0980, 0x09C0..0x1600] {
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

/// 48 slots that read the same input, whose value changes before some of the looks at it, as by an interrupt.
struct Restless {
    gateway: RefCell<Gateway>,
    /// The pulse of the next cycle, in ticks.
    high: Cell<u32>,
    /// Looks since the request began.
    looks: Cell<u32>,
    /// The look before which the value changes, and every how many looks it does so again.
    changes: Cell<(u32, u32)>,
}

impl Restless {
    fn new() -> Restless {
        let table = [SlotConfig::usual(Source::of(Kind::Pwm, 1, Axis::Two)); 48];
        let timings = [clino_bus::Timing::t7(clino_bus::Serial::T7_DEFAULT), clino_bus::Timing::isu()];
        let settings = Settings::new(&table, timings[0], timings[1]);
        let restless = Restless {
            gateway: RefCell::new(Gateway::new(&settings, Limits::new(84_000_000))),
            high: Cell::new(700_000),
            looks: Cell::new(0),
            changes: Cell::new((u32::MAX, 1)),
        };
        // The first value waits for the second.
        restless.cycle();
        restless.cycle();
        restless
    }

    fn cycle(&self) {
        self.high.set(self.high.get() + 977);
        let cycle = Capture::Cycle(Ticks { period: 2_800_000, high: self.high.get() });
        let mut gateway = self.gateway.borrow_mut();
        gateway.pwm(PwmInput::Pwm1, cycle, Instant::from_micros(1_000));
        gateway.publish();
    }

    /// From the next request on, the value changes before this look of it, and after each `again` looks once more.
    fn change_at(&self, look: u32, again: u32) {
        self.looks.set(0);
        self.changes.set((look, again));
    }
}

impl Site for &Restless {
    fn now(&self) -> Instant {
        Instant::from_micros(1_000)
    }

    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
        let (first, again) = self.changes.get();
        let looks = self.looks.replace(self.looks.get() + 1);
        if looks.checked_sub(first).is_some_and(|since| since.is_multiple_of(again)) {
            self.cycle();
        }
        Some(look(&mut self.gateway.borrow_mut()))
    }

    fn wake(&self) {}

    fn driver_enable(&self, _: Bus) -> DriverEnable {
        DriverEnable::default()
    }

    fn version(&self) -> (u8, u8, u16) {
        (0, 0, 0)
    }

    fn start(&self) -> Start {
        Start::default()
    }

    fn ask(&self, _: DeferredRequest) -> Result<(), Refusal> {
        Err(Refusal::Failed)
    }

    fn is_unsaved(&self) -> bool {
        false
    }
}

/// 96 registers in one request are of one state, wherever in its course the value changes: all slots read the same input,
/// so all angles of an answer are the same.
#[test]
fn one_request_is_one_state() {
    let board = Restless::new();
    let mut bench = Bench::at(Binding::new(&board), SETTINGS, 573, 2_006);
    let calm = bench.read(0x0020, 96).unwrap();
    let looks = board.looks.get();
    assert!(looks >= 48, "{looks} looks");
    let mut seen = std::collections::BTreeSet::from([(calm[0], calm[1])]);
    for look in 0..looks {
        board.change_at(look, u32::MAX);
        let words = bench.read(0x0020, 96).unwrap();
        assert!(words[..64].chunks(2).all(|angle| angle == &words[..2]), "look {look}: {words:04X?}");
        seen.insert((words[0], words[1]));
    }
    assert_eq!(seen.len() as u32, looks + 1, "each change is in the next answer at the latest");
    // Half of the looks of a try are undisturbed, over and over: one of the tries is.
    board.change_at(0, looks + looks / 2);
    let words = bench.read(0x0020, 96).unwrap();
    assert!(words[..64].chunks(2).all(|angle| angle == &words[..2]), "{words:04X?}");
}

/// A state that never holds still is no answer, and the server does not look for ever: exception 6, after eight tries.
#[test]
fn a_state_that_never_holds_still_is_no_answer() {
    let board = Restless::new();
    let mut bench = Bench::at(Binding::new(&board), SETTINGS, 573, 2_006);
    bench.read(0x0020, 96).unwrap();
    let once = board.looks.get();
    board.change_at(0, once / 2);
    assert_eq!(bench.read(0x0020, 96), Err(6));
    assert!(board.looks.get() <= 8 * once, "{} looks of {once} at most", board.looks.get());
    // It is one as soon as it holds still.
    board.change_at(u32::MAX, 1);
    bench.read(0x0020, 96).unwrap();
}

/// Registers that the list does not name read 0 within the blocks that the description names, and are exception 2 outside.
#[test]
fn every_other_address() {
    let blocks = [
        0x0000..0x00E0_u32,
        0x0100..0x0790,
        0x0800..0x08C0,
        0x0900..0x1600,
        0x1800..0x1820,
        0x1840..0x1860,
        0x1900..0x1C00,
        0x1C00..0x1F00,
        0x1F00..0x1F10,
        0x2000..0x2600,
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
            // What has to fit the others first: no period for every limit, no kind for every address.
            let before: &[(u16, &[u16])] = match line.name.split_once('_') {
                Some((slot, "stale")) if slot.starts_with("slot") => &[(1, &[0]), (4, &[0, 0])],
                Some((slot, "set_address")) if slot.starts_with("slot") => &[(1, &[0])],
                Some((slot, part @ ("name_2" | "name_3" | "name_4"))) if slot.starts_with("slot") => {
                    let before = match part {
                        "name_2" => 2,
                        "name_3" => 4,
                        _ => 6,
                    };
                    bench.write(line.address - before, &[0x4141; 6][..usize::from(before)]).expect("a name");
                    &[]
                }
                _ => &[],
            };
            for (offset, words) in before {
                bench.write((line.address & !0x1F) + offset, words).expect("a setting");
            }
            let writes = bench.host.writes.len();
            let bits = value as u32;
            let words = match line.registers {
                1 => vec![bits as u16],
                _ => vec![(bits >> 16) as u16, bits as u16],
            };
            (bench.write(line.address, &words), writes, bench)
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
                    let (result, _, mut bench) = write(value);
                    assert_eq!(result, Ok(()), "{}", line.name);
                    let words = bench.read(line.address, line.registers).expect("a number");
                    let mask = if line.registers == 1 { 0xFFFF } else { u32::MAX };
                    assert_eq!(number(&line, &words), value as u32 & mask, "{}", line.name);
                }
            }
        }
        let (lowest, highest) = match line.kind {
            "uint16" => (0, 0xFFFF),
            "int16" => (-0x8000, 0x7FFF),
            "uint32" => (0, 0xFFFF_FFFF),
            _ => (i64::from(i32::MIN), i64::from(i32::MAX)),
        };
        for value in [least - 1, most + 1, lowest, highest] {
            if !(least..=most).contains(&value) && (lowest..=highest).contains(&value) {
                let (result, writes, bench) = write(value);
                assert_eq!(result, Err(3), "{} = {value}", line.name);
                assert_eq!(bench.host.writes.len(), writes);
            }
        }
    }
}

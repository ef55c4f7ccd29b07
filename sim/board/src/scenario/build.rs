//! Builds the sensors on their lines from a checked scenario, and the truth about them.

use clino_sim::latency;
use clino_sim::node::Ns;
use clino_sim::{isu, pwm, t7};
use toml::Spanned;

use super::schema::{self, File, Lasting, Latency, bounds};
use super::{Bench, Kind, SensorIdentity, Truth};
use crate::HostPorts;
use crate::impairment::ImpairedLine;
use crate::pwm::{Cable, PwmWaveform, Unconnected};
use clino_segment::chance::{Chance, Topic};
use clino_segment::wire::Wire;
use clino_segment::{LineFaults, Noise, Probability, Segment, SegmentSettings, Station, StuckLine};

/// Parts of the run that have their own chance.
const T7_BUS: u64 = 1;
const ISU_BUS: u64 = 2;
const CONSOLE: u64 = 3;
const MODBUS: u64 = 4;

/// A T7 reports 0.001°; the gateway may round once more.
const T7_TOLERANCE: i64 = 2_000;
/// One step of an ISU, 360/65536°, rounded up.
const ISU_TOLERANCE: i64 = 5_494;
/// Half a PWM step of 4.34 µs is 0.044°; the gateway may add 0.01°.
const PWM_TOLERANCE: i64 = 54_000;

/// Longest answers, in bits: T7 Get All Data has 34 bytes, ISU Read RAM of one angle 6.
const T7_ANSWER_BITS: u64 = 340;
const ISU_ANSWER_BITS: u64 = 60;
/// What a gateway may take to time-stamp an answer that is complete.
const STAMP: Ns = 1_000_000;
/// A PWM angle is measured over one period and reported within another.
const PWM_PERIODS: u64 = 2;
const NS_PER_S: u64 = 1_000_000_000;
const MILLIHERTZ: u64 = 1_000;

/// Makes everything in a scenario.
pub fn bench(file: &File) -> Bench {
    let chance = Chance::new(file.seed);
    let mut truths: Vec<Truth> = file.t7.iter().map(t7_truth).collect();
    truths.extend(file.isu.iter().map(isu_truth));
    truths.extend(file.pwm.iter().map(pwm_truth));
    disturb(&mut truths, Kind::T7, &file.segments.t7, file.t7.iter().flat_map(|t7| &t7.babble));
    disturb(&mut truths, Kind::Isu, &file.segments.isu, file.isu.iter().flat_map(|isu| &isu.babble));
    let t7s = file.t7.iter().map(|t7| t7_station(t7, chance.part(T7_BUS))).collect();
    let isus = file.isu.iter().map(|isu| isu_station(isu, chance.part(ISU_BUS))).collect();
    Bench {
        t7: Segment::new(settings(&file.segments.t7, chance.part(T7_BUS)), t7s)
            .with_faults(line_faults(&file.segments.t7)),
        isu: Segment::new(settings(&file.segments.isu, chance.part(ISU_BUS)), isus)
            .with_faults(line_faults(&file.segments.isu)),
        pwm: [1, 2].map(|channel| waveform(file, channel)),
        truths,
    }
}

/// Hands the lines on with what is done to them.
pub fn impaired(file: &File, wires: HostPorts<Box<dyn Wire>>) -> HostPorts<ImpairedLine> {
    let chance = Chance::new(file.seed);
    let HostPorts { console, modbus } = wires;
    let (console, modbus) =
        (ImpairedLine::new(console, chance.part(CONSOLE)), ImpairedLine::new(modbus, chance.part(MODBUS)));
    for (line, echo, impairments) in [
        (&console, &file.console.echo, &file.console.impairment),
        (&modbus, &file.modbus.echo, &file.modbus.impairment),
    ] {
        let shared = line.impairments();
        shared.lock().set_echo(echo.as_ref().map(schema::Echo::in_line));
        impairments.iter().for_each(|impairment| shared.lock().add(impairment.in_line()));
    }
    HostPorts { console, modbus }
}

fn settings(segment: &schema::Segment, chance: Chance) -> SegmentSettings {
    let noise = Noise {
        bit_errors: segment.noise.bit_error_rate.0,
        drops: segment.noise.drop_rate.0,
        within: segment.noise.within.as_ref().map(|within| within.get_ref().bounds()),
    };
    SegmentSettings { chance, echo: segment.echo, noise }
}

fn line_faults(segment: &schema::Segment) -> LineFaults {
    let stuck = segment.stuck.iter().map(Spanned::get_ref);
    LineFaults {
        stuck: stuck
            .map(|s| StuckLine {
                from: s.from.0,
                until: s.until.0,
                high: s.level == schema::StuckLevel::High,
            })
            .collect(),
        de_shorted: bounds(&segment.de_shorted),
    }
}

fn t7_station(node: &schema::T7, chance: Chance) -> Station {
    let address = *node.address.get_ref();
    let mut options = t7::Options {
        motion: std::array::from_fn(|_| node.motion.motion()),
        length_quirk: node.length_quirk,
        seed: chance.roll(Topic::Seed, 1, u64::from(address)),
        ..t7::Options::default()
    };
    if let Some(latency) = &node.latency {
        options.get_latency = drawn(latency);
    }
    if let Some(hold) = node.hold {
        options.hold = hold.0;
    }
    let baud_index = t7::BAUD_RATES.iter().position(|rate| *rate == t7_baud(node)).unwrap_or(0) as u8;
    let settings = t7::StoredSettings { address, baud_index, ..t7::StoredSettings::default() };
    let identity = t7::Identity { serial: u32::from(address), ..t7::Identity::default() };
    let made = t7::T7::new(identity, settings, options);
    let mut t7 = made.unwrap_or_else(|why| unreachable!("the scenario was checked, and yet: {why}"));
    t7.faults.every = node.fault.as_ref().map(schema::Fault::every);
    Station { name: format!("t7/{address}"), node: Box::new(t7), faults: node.faults() }
}

fn isu_station(node: &schema::Isu, chance: Chance) -> Station {
    let address = *node.address.get_ref();
    let seed = chance.roll(Topic::Seed, 1, u64::from(address));
    let mut options = isu::Options { motion: node.motion.motion(), seed, ..isu::Options::default() };
    if let Some(latency) = &node.latency {
        options.latency = drawn(latency);
    }
    if let Some(phase) = &node.phase {
        options.phase = phase.get_ref().0;
    }
    let content = isu::Content { address, null: 0, auto_shutoff: false };
    let eeprom = isu::Eeprom::factory(content, isu::ChecksumScope::default(), seed);
    let mut isu = isu::Isu::new(eeprom, options);
    isu.faults.every = node.fault.as_ref().map(schema::Fault::every);
    Station { name: format!("isu/{address}"), node: Box::new(isu), faults: node.faults() }
}

/// The waveform on one PWM input.
fn waveform(file: &File, channel: u8) -> Box<dyn PwmWaveform> {
    let Some(source) = file.pwm.iter().find(|source| *source.channel.get_ref() == channel) else {
        return Box::new(Unconnected);
    };
    let mut output = pwm::Pwm::new(source.motion.motion());
    output.frequency_millihertz = millihertz(source);
    output.quantisation = source.resolution.into();
    output.stuck = source
        .stuck
        .iter()
        .map(Spanned::get_ref)
        .map(|s| pwm::Stuck { from: s.from.0, until: s.until.0, high: s.level == schema::StuckLevel::High })
        .collect();
    let waveform = Box::new(move |now: Ns| output.next_cycle(now));
    Box::new(Cable { waveform, open: bounds(&source.open) })
}

fn t7_truth(node: &schema::T7) -> Truth {
    let bit = NS_PER_S / u64::from(t7_baud(node));
    Truth {
        who: SensorIdentity { kind: Kind::T7, bus: "t7", address: *node.address.get_ref() },
        motion: node.motion.motion(),
        hold: T7_ANSWER_BITS * bit + STAMP,
        tolerance: T7_TOLERANCE,
        away: bounds(&node.unplugged),
        disturbed: Vec::new(),
        unreliable: node.is_unreliable(),
    }
}

fn isu_truth(node: &schema::Isu) -> Truth {
    let latency = node.latency.as_ref().map_or(isu::Options::default().latency, drawn);
    let answer = latency.max + isu::TXEN_LEAD + ISU_ANSWER_BITS * NS_PER_S / u64::from(isu::BAUD);
    Truth {
        who: SensorIdentity { kind: Kind::Isu, bus: "isu", address: *node.address.get_ref() },
        motion: node.motion.motion(),
        hold: isu::REFRESH + answer + STAMP,
        tolerance: ISU_TOLERANCE,
        away: bounds(&node.unplugged),
        disturbed: Vec::new(),
        unreliable: node.is_unreliable(),
    }
}

fn pwm_truth(source: &schema::Pwm) -> Truth {
    let bus = if *source.channel.get_ref() == 1 { "pwm1" } else { "pwm2" };
    let period = NS_PER_S * MILLIHERTZ / u64::from(millihertz(source));
    // A pulse under way is finished, and a line that then stands high ends its cycle with a rising edge.
    let still = bounds(&source.stuck).into_iter().chain(bounds(&source.open));
    let away = still.map(|(from, until)| (from + period, until)).collect();
    Truth {
        who: SensorIdentity { kind: Kind::Pwm, bus, address: 0 },
        motion: source.motion.motion(),
        hold: PWM_PERIODS * period + STAMP,
        tolerance: PWM_TOLERANCE,
        away,
        disturbed: Vec::new(),
        unreliable: false,
    }
}

/// Notes for all sensors of a segment what its faults, its noise and its babblers do to them.
fn disturb<'a>(
    truths: &mut [Truth],
    kind: Kind,
    segment: &schema::Segment,
    babble: impl Iterator<Item = &'a Spanned<schema::Babble>>,
) {
    let babble: Vec<(Ns, Ns)> = babble.map(|babble| babble.get_ref().bounds()).collect();
    let noise = &segment.noise;
    let noisy = noise.bit_error_rate.0 != Probability::NEVER || noise.drop_rate.0 != Probability::NEVER;
    for truth in truths.iter_mut().filter(|truth| truth.who.kind == kind) {
        truth.disturbed.extend(&babble);
        truth.disturbed.extend(bounds(&segment.stuck));
        truth.disturbed.extend(bounds(&segment.de_shorted));
        truth.unreliable |= noisy;
    }
}

fn drawn(latency: &Spanned<Latency>) -> latency::Latency {
    latency::Latency::between(latency.get_ref().min.0, latency.get_ref().max.0)
}

fn t7_baud(node: &schema::T7) -> u32 {
    let [default, ..] = t7::BAUD_RATES;
    node.baud.as_ref().map_or(default, |baud| *baud.get_ref())
}

fn millihertz(source: &schema::Pwm) -> u32 {
    source.frequency.as_ref().map_or(pwm::Pwm::NOMINAL_MILLIHERTZ, |frequency| frequency.0)
}

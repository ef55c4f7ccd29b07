//! The rules of a scenario beyond the type of each value: addresses, limits of the documents, order of
//! intervals. Every complaint carries the place in the file.

use std::ops::{Range, RangeInclusive};

use clino_sim::{isu, t7};
use toml::Spanned;

use super::schema::{Crystal, File, Impairment, Lasting, Latency, Modbus, Moves, Pwm};
use super::units::Time;
use crate::impairment::Effect;
use crate::injection::What;
use crate::modbus::Parity;
use crate::oscillators::LSI_RANGE;

/// Most T7s on a bus ("T7 Communication User Guide", section 1).
const MOST_T7: usize = 32;
/// Addresses of ISUs that share a line ("Interfacing to an ISU Module", section 4): 0 is every module, 15 reserved.
const ISU_ADDRESSES: RangeInclusive<u8> = 1..=14;
/// Longest time an ISU may take in a scenario; its document gives no limit.
const ISU_LATENCY_LIMIT: Time = Time(1_000_000_000);
/// PWM inputs of the board.
const PWM_CHANNELS: RangeInclusive<u8> = 1..=2;

/// Bit rates of the Modbus port.
const MODBUS_BAUD: RangeInclusive<u32> = 1_200..=1_000_000;
const STOP_BITS: RangeInclusive<u8> = 1..=2;
/// Bits of a character without and with a parity bit.
const DATA_WORD: u16 = 0x0ff;
const PARITY_WORD: u16 = 0x1ff;

/// A complaint and the bytes of the file it is about.
#[derive(Debug)]
pub struct Complaint {
    /// Where.
    pub span: Range<usize>,
    /// What was wrong and what was expected.
    pub what: String,
}

type Checked = Result<(), Complaint>;

/// Checks a whole file.
pub fn file(file: &File) -> Checked {
    if file.duration.get_ref().0 == 0 {
        return complain(&file.duration, "duration 0s, expected more than 0s");
    }
    for segment in [&file.segments.t7, &file.segments.isu] {
        intervals(segment.noise.within.as_slice())?;
        intervals(&segment.stuck)?;
        intervals(&segment.de_shorted)?;
    }
    for t7 in &file.t7 {
        let address = *t7.address.get_ref();
        if !t7::SETTABLE_ADDRESSES.contains(&address) && address != t7::DEFAULT_ADDRESS {
            return complain(&t7.address, format!("T7 address {address}, expected 1 to 100 or 127"));
        }
        if let Some(baud) = t7.baud.as_ref().filter(|baud| !t7::BAUD_RATES.contains(baud.get_ref())) {
            let what = format!("baud rate {}, expected one of {:?}", baud.get_ref(), t7::BAUD_RATES);
            return complain(baud, what);
        }
        latency(t7.latency.as_ref(), Time(t7::GET_LIMIT), "T7")?;
        motion(&t7.motion)?;
        intervals(&t7.unplugged)?;
        intervals(&t7.babble)?;
    }
    unique(file.t7.iter().map(|t7| &t7.address), "T7 address")?;
    if let Some(extra) = file.t7.get(MOST_T7) {
        return complain(&extra.address, format!("{} T7s, expected at most {MOST_T7}", file.t7.len()));
    }
    for isu in &file.isu {
        let address = *isu.address.get_ref();
        if !ISU_ADDRESSES.contains(&address) {
            return complain(&isu.address, format!("ISU address {address}, expected 1 to 14"));
        }
        latency(isu.latency.as_ref(), ISU_LATENCY_LIMIT, "ISU")?;
        if let Some(phase) = isu.phase.as_ref().filter(|phase| phase.get_ref().0 >= isu::REFRESH) {
            return complain(
                phase,
                format!("phase {}, expected less than {}", phase.get_ref(), Time(isu::REFRESH)),
            );
        }
        motion(&isu.motion)?;
        intervals(&isu.unplugged)?;
        intervals(&isu.babble)?;
    }
    unique(file.isu.iter().map(|isu| &isu.address), "ISU address")?;
    modbus(&file.modbus)?;
    let parity = file.modbus.framing().parity != Parity::None;
    for (impairments, parity) in [(&file.console.impairment, false), (&file.modbus.impairment, parity)] {
        impairments.iter().try_for_each(|one| impairment(one, parity))?;
    }
    if let Some(hz) = file.lsi_hz.as_ref().filter(|hz| !LSI_RANGE.contains(hz.get_ref())) {
        let (lowest, highest) = (LSI_RANGE.start(), LSI_RANGE.end());
        return complain(hz, format!("lsi_hz {}, expected {lowest} to {highest}", hz.get_ref()));
    }
    crystal(&file.crystal)?;
    for plant in &file.plant {
        if let What::Flip { bit: bit @ 8.., .. } = plant.what.get_ref() {
            return complain(&plant.what, format!("bit {bit} of a byte, expected 0 to 7"));
        }
    }
    file.pwm.iter().try_for_each(pwm)?;
    unique(file.pwm.iter().map(|pwm| &pwm.channel), "PWM channel")
}

fn complain<T>(at: &Spanned<T>, what: impl Into<String>) -> Checked {
    Err(Complaint { span: at.span(), what: what.into() })
}

fn modbus(modbus: &Modbus) -> Checked {
    if let Some(baud) = modbus.baud.as_ref().filter(|baud| !MODBUS_BAUD.contains(baud.get_ref())) {
        let (lowest, highest) = (MODBUS_BAUD.start(), MODBUS_BAUD.end());
        return complain(baud, format!("baud rate {}, expected {lowest} to {highest}", baud.get_ref()));
    }
    if let Some(bits) = modbus.stop_bits.as_ref().filter(|bits| !STOP_BITS.contains(bits.get_ref())) {
        return complain(bits, format!("{} stop bits, expected 1 or 2", bits.get_ref()));
    }
    match modbus.request.iter().find(|request| request.bytes.get_ref().0.is_empty()) {
        Some(empty) => complain(&empty.bytes, "a request without bytes, expected at least one"),
        None => Ok(()),
    }
}

fn impairment(impairment: &Impairment, parity_bit: bool) -> Checked {
    let Impairment { effect, character, count, rate, within } = impairment;
    match (character, rate) {
        (Some(_), None) => {
            if let Some(within) = within {
                return complain(within, "within of chosen characters, expected it with rate only");
            }
        }
        (None, Some(_)) => {
            if let Some(count) = count {
                return complain(count, "count of random characters, expected it with character only");
            }
            intervals(within.as_slice())?;
        }
        _ => return complain(effect, "an effect with no or with two choices, expected character or rate"),
    }
    if let Some(count) = count.as_ref().filter(|count| *count.get_ref() == 0) {
        return complain(count, "count 0, expected at least 1");
    }
    let bits = if parity_bit { PARITY_WORD } else { DATA_WORD };
    match *effect.get_ref() {
        Effect::ParityError if !parity_bit => {
            complain(effect, "parity_error on a line without parity, expected another effect")
        }
        Effect::Flipped(mask) if mask == 0 || mask & !bits != 0 => {
            complain(effect, format!("flipped {mask:#x}, expected some bits of {bits:#x}"))
        }
        _ => Ok(()),
    }
}

fn crystal(crystal: &Crystal) -> Checked {
    let Crystal { dead, stops_at, returns_at, .. } = crystal;
    if let Some(stops_at) = stops_at.as_ref().filter(|_| *dead) {
        return complain(stops_at, "stops_at of a dead crystal, expected one of the two");
    }
    let Some(returns) = returns_at else { return Ok(()) };
    let stops = match stops_at {
        Some(stops_at) => *stops_at.get_ref(),
        None if *dead => Time(0),
        None => {
            return complain(
                returns,
                "returns_at of a crystal that does not stop, expected dead or stops_at",
            );
        }
    };
    if *returns.get_ref() <= stops {
        let what = format!("returns_at {}, expected after it stops at {stops}", returns.get_ref());
        return complain(returns, what);
    }
    Ok(())
}

fn pwm(pwm: &Pwm) -> Checked {
    let channel = *pwm.channel.get_ref();
    if !PWM_CHANNELS.contains(&channel) {
        return complain(&pwm.channel, format!("PWM channel {channel}, expected 1 or 2"));
    }
    motion(&pwm.motion)?;
    intervals(&pwm.open)?;
    intervals(&pwm.stuck)
}

fn latency(latency: Option<&Spanned<Latency>>, limit: Time, kind: &str) -> Checked {
    let Some(at) = latency else { return Ok(()) };
    let Latency { min, max } = *at.get_ref();
    if min > max {
        return complain(at, format!("latency from {min} to {max}, expected min not above max"));
    }
    if max > limit {
        return complain(at, format!("{kind} latency {max}, expected at most {limit}"));
    }
    Ok(())
}

fn motion(moves: &Moves) -> Checked {
    let Moves::Table(points) = moves else { return Ok(()) };
    for pair in points.windows(2) {
        if let [before, after] = pair
            && before.get_ref().at > after.get_ref().at
        {
            let (before, late) = (before.get_ref().at, after.get_ref().at);
            return complain(after, format!("point at {late} after one at {before}, expected rising times"));
        }
    }
    Ok(())
}

fn unique<'a>(values: impl Iterator<Item = &'a Spanned<u8>>, name: &str) -> Checked {
    let mut seen = Vec::new();
    for value in values {
        if seen.contains(value.get_ref()) {
            let again = value.get_ref();
            return complain(value, format!("{name} {again} for the second time, expected each only once"));
        }
        seen.push(*value.get_ref());
    }
    Ok(())
}

fn intervals<T: Lasting>(intervals: &[Spanned<T>]) -> Checked {
    let mut free_from = 0;
    for interval in intervals {
        let (from, until) = interval.get_ref().bounds();
        let (from_text, until_text) = (Time(from), Time(until));
        if from >= until {
            let what = format!("interval from {from_text} until {until_text}, expected from before until");
            return complain(interval, what);
        }
        if from < free_from {
            let what = format!(
                "interval from {from_text} after one until {}, expected rising and separate intervals",
                Time(free_from)
            );
            return complain(interval, what);
        }
        free_from = until;
    }
    Ok(())
}

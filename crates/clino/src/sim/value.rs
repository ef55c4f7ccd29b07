//! Words that describe a sensor: `ADDRESS[,KEY[=VALUE]]…`, and the values in them.

use clino_sim::fault::AnswerFault;
use clino_sim::latency::Latency;
use clino_sim::motion::{DEGREE, Motion};
use clino_sim::node::Ns;

use crate::number::within;

/// Largest angle in degrees, and rate in degrees per second.
const LARGEST_DEGREES: f64 = 1e6;
/// Longest time: a day.
const LONGEST: Ns = 24 * 3_600 * NS_PER_S;
const NS_PER_S: Ns = 1_000_000_000;

const NO_MOTION: &str = "not an angle (in degrees), ramp:START:RATE, or sine:CENTRE:AMPLITUDE:PERIOD";
const NO_FAULT: &str = "not KIND/N, such as silent/10";

/// A fault of every so manieth answer.
pub type Every = (u64, AnswerFault);

/// The address, and the keys with their values. A key without a value has an empty one.
pub fn words(text: &str) -> (&str, impl Iterator<Item = (&str, &str)>) {
    let (address, rest) = text.split_once(',').unwrap_or((text, ""));
    let words = rest.split(',').filter(|word| !word.is_empty());
    (address, words.map(|word| word.split_once('=').unwrap_or((word, ""))))
}

/// A value that must not be there.
///
/// # Errors
/// It is there.
pub fn nothing(value: &str) -> Result<(), String> {
    if value.is_empty() { Ok(()) } else { Err("it takes no value".to_owned()) }
}

/// Degrees or degrees per second, in µ°.
///
/// # Errors
/// The limits.
pub fn degrees(text: &str) -> Result<i64, String> {
    match text.parse::<f64>() {
        Ok(degrees) if degrees.abs() <= LARGEST_DEGREES => Ok((degrees * DEGREE as f64).round() as i64),
        _ => Err("not degrees in -1000000..=1000000".to_owned()),
    }
}

/// A time with its unit, in ns.
///
/// # Errors
/// What a time looks like.
pub fn time(text: &str) -> Result<Ns, String> {
    let unit = text.trim_start_matches(|character: char| character.is_ascii_digit() || character == '.');
    let scale = match unit {
        "s" => NS_PER_S,
        "ms" => NS_PER_S / 1_000,
        "us" | "µs" => NS_PER_S / 1_000_000,
        _ => 0,
    };
    let number = text.strip_suffix(unit).and_then(|number| number.parse::<f64>().ok());
    let time = number.map(|number| (number * scale as f64).round() as Ns);
    time.filter(|&time| scale > 0 && time <= LONGEST)
        .ok_or_else(|| "not a time such as 2ms, 0.5s or 250us, at most a day".to_owned())
}

/// A time, or two with `..` between, at most `limit`.
///
/// # Errors
/// The limit.
pub fn latency(text: &str, limit: Ns) -> Result<Latency, String> {
    let (min, max) = text.split_once("..").unwrap_or((text, text));
    let latency = Latency::between(time(min)?, time(max)?);
    if latency.min > latency.max {
        return Err("the longer time comes first".to_owned());
    }
    if latency.max > limit {
        return Err(format!("more than {} ms", limit / (NS_PER_S / 1_000)));
    }
    Ok(latency)
}

/// How an angle moves.
///
/// # Errors
/// Lists the accepted values.
pub fn motion(text: &str) -> Result<Motion, String> {
    let parts: Vec<&str> = text.split(':').collect();
    match parts[..] {
        ["ramp", start, rate] => Ok(Motion::Ramp { start: degrees(start)?, rate: degrees(rate)? }),
        ["sine", centre, amplitude, period] => Ok(Motion::Sine {
            centre: degrees(centre)?,
            amplitude: degrees(amplitude)?,
            period: time(period)?,
            phase: 0,
        }),
        [angle] if angle.parse::<f64>().is_ok() => degrees(angle).map(Motion::Constant),
        _ => Err(NO_MOTION.to_owned()),
    }
}

/// A fault, and how often it strikes.
///
/// # Errors
/// Lists the accepted values.
pub fn fault(text: &str) -> Result<Every, String> {
    let (kind, every) = text.rsplit_once('/').ok_or(NO_FAULT)?;
    let every = within::<i64>(every, 1..=i64::MAX)?.unsigned_abs();
    let (kind, value) = kind.split_once(':').unwrap_or((kind, ""));
    let fault = match kind {
        "bad-checksum" => nothing(value).map(|()| AnswerFault::BadChecksum)?,
        "silent" => nothing(value).map(|()| AnswerFault::Silent)?,
        "late" => AnswerFault::Late(time(value)?),
        "truncated" => AnswerFault::Truncated(within::<u8>(value, 1..=u8::MAX)?.into()),
        _ => return Err("not one of bad-checksum, silent, late, truncated".to_owned()),
    };
    Ok((every, fault))
}

/// What is wrong with the value of a key.
pub fn of_key(key: &str, value: &str, why: &str) -> String {
    format!("{key}={value}: {why}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_and_words() {
        let (address, words) = words("5,angle=-1.5,,ascii,fault=late:2ms/3");
        assert_eq!(address, "5");
        let words: Vec<_> = words.collect();
        assert_eq!(words, [("angle", "-1.5"), ("ascii", ""), ("fault", "late:2ms/3")]);
        assert_eq!(super::words("127").1.count(), 0);
    }

    #[test]
    fn times_have_units_and_an_end() {
        for (text, ns) in [("2ms", 2_000_000), ("0.5s", 500_000_000), ("250us", 250_000), ("0ms", 0)] {
            assert_eq!(time(text), Ok(ns), "{text}");
        }
        assert_eq!(time("86400s"), Ok(86_400_000_000_000));
        for bad in ["", "2", "ms", "2 ms", "-2ms", "2m", "1e3ms", "86401s", "nans", "infs", "1.2.3s"] {
            assert!(time(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_latency_is_a_time_or_two_up_to_the_limit() {
        let limit = 2_000_000;
        assert_eq!(latency("2ms", limit), Ok(Latency::fixed(2_000_000)));
        assert_eq!(latency("0.5ms..1ms", limit), Ok(Latency::between(500_000, 1_000_000)));
        for bad in ["2.001ms", "1ms..3ms", "1ms..0.5ms", "1ms..", "..1ms"] {
            assert!(latency(bad, limit).is_err(), "{bad}");
        }
    }

    #[test]
    fn an_angle_stands_still_or_moves() {
        assert_eq!(motion("-12.3456785"), Ok(Motion::Constant(-12_345_679)));
        assert_eq!(motion("ramp:-175:20"), Ok(Motion::Ramp { start: -175_000_000, rate: 20_000_000 }));
        let sine = Motion::Sine { centre: 5_000_000, amplitude: 30_000_000, period: 4_000_000_000, phase: 0 };
        assert_eq!(motion("sine:5:30:4s"), Ok(sine));
        for bad in ["", "up", "nan", "inf", "1000001", "ramp:1", "ramp:1:2:3", "sine:1:2:3", "12.5:1"] {
            assert!(motion(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn faults_strike_every_so_often() {
        for (text, every, fault) in [
            ("bad-checksum/10", 10, AnswerFault::BadChecksum),
            ("silent/1", 1, AnswerFault::Silent),
            ("late:30ms/2", 2, AnswerFault::Late(30_000_000)),
            ("truncated:3/4", 4, AnswerFault::Truncated(3)),
        ] {
            assert_eq!(super::fault(text), Ok((every, fault)), "{text}");
        }
        for bad in ["silent", "silent/0", "silent/x", "silent:3/1", "late/1", "truncated:0/1", "loud/1", "/1"]
        {
            assert!(super::fault(bad).is_err(), "{bad}");
        }
    }
}

//! Captures: bytes with their times, one or more a line.
//!
//! | form | a line | from |
//! |---|---|---|
//! | seconds | `1.250000 05 01 83` | any program: the time of the first byte, the others follow it without a pause |
//! | bus log | `1250000000 t7 char gateway 05 end=… baud=… clean` | `cargo xtask sim --bus-log`: nanoseconds; other records are passed over |
//! | sigrok | `28800-29793 uart-1: 05` | `sigrok-cli -P uart:… -A uart=rx-data --protocol-decoder-samplenum`: samples, with `--samplerate` |
//!
//! `#` begins a comment. The form of each line is told by its first word.

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

use super::frames::Stamped;
use crate::hex;
use crate::sensors::Kind;

const US_PER_S: u64 = 1_000_000;
const NS_PER_US: u64 = 1_000;

/// What a capture does not say itself.
pub struct Settings {
    /// Which bus of a log.
    pub kind: Kind,
    /// Samples in a second.
    pub samplerate: Option<u64>,
    /// Length of a character.
    pub character_us: u64,
}

/// The bytes of a capture, in the order of their times.
///
/// # Errors
/// It cannot be read; the line that is none.
pub fn read(path: &Path, settings: &Settings) -> io::Result<Vec<Stamped>> {
    let mut bytes = Vec::new();
    if path == Path::new("-") {
        io::stdin().lock().read_to_end(&mut bytes)?;
    } else {
        bytes = fs::read(path)
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    }
    parse(&String::from_utf8_lossy(&bytes), settings)
}

fn parse(text: &str, settings: &Settings) -> io::Result<Vec<Stamped>> {
    let mut characters = Vec::new();
    for (line, number) in text.lines().zip(1_usize..) {
        let bad = |why: String| {
            io::Error::new(io::ErrorKind::InvalidData, format!("line {number} of the capture: {why}"))
        };
        self::line(line, settings, &mut characters).map_err(bad)?;
    }
    // A bus log has characters at their ends.
    characters.sort_by_key(|character| character.at_us);
    Ok(characters)
}

fn line(line: &str, settings: &Settings, characters: &mut Vec<Stamped>) -> Result<(), String> {
    let text = line.split('#').next().unwrap_or_default().trim();
    let Some((first, rest)) = text.split_once(char::is_whitespace) else {
        return if text.is_empty() { Ok(()) } else { Err("a time, and bytes".to_owned()) };
    };
    if let Some((start, _)) = first.split_once('-').filter(|(start, _)| is_number(start)) {
        let samplerate = settings.samplerate.ok_or("its times are samples: say --samplerate HZ")?;
        let sample: u64 = start.parse().map_err(|_| "no sample number".to_owned())?;
        let at_us = u64::try_from(u128::from(sample) * u128::from(US_PER_S) / u128::from(samplerate))
            .unwrap_or(u64::MAX);
        let what = rest.rsplit(':').next().unwrap_or_default().trim();
        // Start bits, stop bits and other annotations of the decoder are no bytes; an error of its is one without a stop bit.
        if let Some(byte) = byte(what) {
            characters.push(Stamped { at_us, byte, is_flawed: false });
        } else if what.eq_ignore_ascii_case("frame error")
            && let Some(last) = characters.last_mut()
        {
            last.is_flawed = true;
        }
        return Ok(());
    }
    if is_number(first) {
        let nanoseconds: u64 = first.parse().map_err(|_| "no time".to_owned())?;
        bus_log(nanoseconds, rest, settings.kind, characters);
        return Ok(());
    }
    let at_us = seconds(first)
        .ok_or_else(|| format!("'{first}' is no time: seconds with decimals, such as 1.250000"))?;
    let bytes = hex::parse(rest.as_bytes()).map_err(|bad| bad.message().to_owned())?;
    for (byte, place) in bytes.into_iter().zip(0_u64..) {
        characters.push(Stamped { at_us: at_us + place * settings.character_us, byte, is_flawed: false });
    }
    Ok(())
}

/// A record of a bus log: a character that reached the pair.
fn bus_log(nanoseconds: u64, rest: &str, kind: Kind, characters: &mut Vec<Stamped>) {
    let words: Vec<&str> = rest.split_whitespace().collect();
    let is_character = matches!(words[..], [bus, "char", ..] if bus == kind.name());
    // The name of a sensor may have blanks.
    let end = words.iter().position(|word| word.starts_with("end="));
    let Some(byte) = end
        .filter(|_| is_character)
        .and_then(|end| end.checked_sub(1))
        .and_then(|place| byte(words.get(place)?))
    else {
        return;
    };
    match words.last() {
        Some(&"undriven") => {}
        fate => characters.push(Stamped {
            at_us: nanoseconds / NS_PER_US,
            byte,
            is_flawed: fate != Some(&"clean"),
        }),
    }
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Two hexadecimal digits.
fn byte(text: &str) -> Option<u8> {
    let is_byte = text.len() == 2 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_byte.then(|| u8::from_str_radix(text, 16).ok()).flatten()
}

/// Seconds with decimals, in microseconds.
fn seconds(text: &str) -> Option<u64> {
    const DECIMALS: usize = 6;
    let (whole, decimals) = text.split_once('.')?;
    if !is_number(whole) || !is_number(decimals) {
        return None;
    }
    let digits = format!("{decimals:0<DECIMALS$}");
    let micros: u64 = digits.get(..DECIMALS)?.parse().ok()?;
    whole.parse::<u64>().ok()?.checked_mul(US_PER_S)?.checked_add(micros)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings = Settings { kind: Kind::T7, samplerate: Some(1_000_000), character_us: 87 };

    fn bytes(text: &str) -> Vec<(u64, u8, bool)> {
        let characters = parse(text, &SETTINGS).unwrap();
        characters.iter().map(|character| (character.at_us, character.byte, character.is_flawed)).collect()
    }

    #[test]
    fn every_form_gives_the_same_bytes() {
        let expected = [(1_250_000, 0x05, false), (1_250_087, 0x01, false)];
        assert_eq!(bytes("# a comment\n\n1.25 05 01\n"), expected);
        let log = "  1250000000 t7 char       gateway 05 end=1250086805 baud=115200 clean\n\
                     1250000000 t7 de         gateway high\n\
                     1250080000 t7 heard      gateway 77\n\
                     1250000000 isu char       gateway 99 end=1 baud=9600 clean\n\
                     1250087999 t7 char       t7-1 5 (serial 1) 01 end=1250174804 baud=115200 clean\n";
        assert_eq!(bytes(log), expected);
        let sigrok =
            "1250000-1250087 uart-1: 05\n1250000-1250009 uart-1: Start bit\n1250087-1250174 uart-1: 01\n";
        assert_eq!(bytes(sigrok), expected);
    }

    #[test]
    fn what_was_spoilt_is_marked_and_what_was_never_there_is_left_out() {
        let log = "1000 t7 char node 05 end=2 baud=115200 fought\n2000 t7 char node 06 end=3 baud=115200 undriven\n";
        assert_eq!(bytes(log), [(1, 0x05, true)]);
        assert_eq!(bytes("1-2 uart-1: 05\n1-2 uart-1: Frame error\n"), [(1, 0x05, true)]);
    }

    #[test]
    fn lines_that_are_none_are_named() {
        for (text, part) in
            [("1.0 05\nabc 05", "line 2"), ("1.0", "line 1"), ("1.0 5", "line 1"), ("-1.0 05", "no time")]
        {
            let error = parse(text, &SETTINGS).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        let none = Settings { samplerate: None, ..SETTINGS };
        assert!(parse("1-2 uart-1: 05", &none).unwrap_err().to_string().contains("--samplerate"));
    }
}

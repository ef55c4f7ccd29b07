//! Lines come out exactly where they stand in the stream.
#![no_main]

use clino_codec::DecodeProgress;
use clino_codec::ascii::{LINE_LENGTH, LineDecoder};
use clino_codec::character::Character;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = LineDecoder::new();
    for (index, &byte) in bytes.iter().enumerate() {
        let progress = decoder.push(Character::clean(byte));
        let line = (index + 1).checked_sub(LINE_LENGTH).map_or(&[][..], |start| &bytes[start..=index]);
        match progress {
            DecodeProgress::Frame(angle) => assert_eq!(Some(angle.get()), meaning(line)),
            _ => assert_eq!(meaning(line), None, "a good line was missed"),
        }
    }
});

/// A second reading of the format, over whole lines.
fn meaning(line: &[u8]) -> Option<i16> {
    let text = core::str::from_utf8(line).ok()?.strip_suffix("\r\n")?;
    let (sign, number) = text.split_at_checked(1)?;
    let (whole, part) = number.split_once('.')?;
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let whole = whole.trim_start_matches(' ');
    if number.len() != 6 || part.len() != 2 || whole.is_empty() || !digits(whole) || !digits(part) {
        return None;
    }
    let magnitude: i16 = format!("{whole}{part}").parse::<i32>().ok()?.try_into().ok()?;
    match (sign, magnitude) {
        (_, 18_001..) => None,
        ("+", magnitude) => Some(magnitude),
        ("-", magnitude) => Some(-magnitude),
        _ => None,
    }
}

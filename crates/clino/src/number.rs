//! Arguments that are numbers: decimal, or hexadecimal with `0x`.

use std::fmt::Display;
use std::ops::RangeInclusive;

/// The number that `text` is, if it lies within the limits.
///
/// # Errors
/// The limits.
pub fn within<T>(text: &str, limits: RangeInclusive<T>) -> Result<T, String>
where
    T: TryFrom<i64> + PartialOrd + Display,
{
    parse(text)
        .and_then(|number| T::try_from(number).ok())
        .filter(|number| limits.contains(number))
        .ok_or_else(|| format!("not a whole number in {}..={}", limits.start(), limits.end()))
}

/// A memory address of the ISU, 0–255; as in its document, `58H` is hexadecimal too.
///
/// # Errors
/// The limits.
pub fn memory_address(text: &str) -> Result<u8, String> {
    match text.strip_suffix(['h', 'H']) {
        Some(digits) => within(&format!("0x{digits}"), u8::MIN..=u8::MAX),
        None => within(text, u8::MIN..=u8::MAX),
    }
    .map_err(|limits| format!("{limits} (88, 0x58 and 58H are the same)"))
}

fn parse(text: &str) -> Option<i64> {
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        // The library would take a sign here.
        Some(digits) if digits.starts_with(['+', '-']) => None,
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_and_hexadecimal_up_to_the_limits() {
        assert_eq!(within("-180000", -180_000..=359_999), Ok(-180_000));
        assert_eq!(within("0x61C9", u32::MIN..=u32::MAX), Ok(25_033));
        assert_eq!(within("4294967295", u32::MIN..=u32::MAX), Ok(u32::MAX));
        for bad in ["", "0", "11", "256", "99999999999999999999", "5.0", "five", "0x", "0x+5", "0x-5", " 5"] {
            assert_eq!(within::<u8>(bad, 1..=10), Err("not a whole number in 1..=10".into()), "{bad}");
        }
    }

    #[test]
    fn memory_addresses_as_the_document_writes_them() {
        for text in ["88", "0x58", "0X58", "58H", "58h"] {
            assert_eq!(memory_address(text), Ok(0x58), "{text}");
        }
        assert_eq!(memory_address("D0H"), Ok(0xD0));
        for bad in ["100H", "256", "H", "", "D0", "0x58H_"] {
            assert!(memory_address(bad).is_err(), "{bad}");
        }
    }
}

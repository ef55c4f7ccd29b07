//! Numbers as people type them, without floating point.

/// Decimals of a number that may have a fraction.
pub const DECIMALS: u32 = 3;

/// A decimal number with at most so many decimals, in units of the last of them: with three, `1.5` is 1500.
pub fn parse(word: &str, decimals: u32) -> Option<i64> {
    let (negative, digits) = word.strip_prefix('-').map_or((false, word), |digits| (true, digits));
    let mut value = 0_i64;
    let mut room = decimals;
    let (mut any, mut fraction) = (false, false);
    for byte in digits.bytes() {
        match byte {
            b'0'..=b'9' if !fraction || room > 0 => {
                value = value.checked_mul(10)?.checked_add(i64::from(byte.wrapping_sub(b'0')))?;
                any = true;
                room = room.saturating_sub(u32::from(fraction));
            }
            b'.' if !fraction && decimals > 0 => fraction = true,
            _ => return None,
        }
    }
    let value = value.checked_mul(10_i64.checked_pow(room)?)?;
    any.then(|| if negative { value.wrapping_neg() } else { value })
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn numbers_are_read_as_they_are_meant() {
        for (word, decimals, value) in [
            ("0", 0, Some(0)),
            ("48", 0, Some(48)),
            ("-7", 0, Some(-7)),
            ("1.5", 3, Some(1_500)),
            ("-0.001", 3, Some(-1)),
            ("33.333", 3, Some(33_333)),
            (".5", 3, Some(500)),
            ("20", 3, Some(20_000)),
            ("1.2345", 3, None),
            ("1.5", 0, None),
            ("1.5.0", 3, None),
            ("", 0, None),
            ("-", 0, None),
            (".", 3, None),
            ("5x", 0, None),
            ("+5", 0, None),
            ("9223372036854775807", 0, Some(i64::MAX)),
            ("9223372036854775808", 0, None),
            ("9223372036854775807", 3, None),
        ] {
            assert_eq!(parse(word, decimals), value, "{word}");
        }
    }
}

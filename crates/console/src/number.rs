//! Numbers as people type them, without floating point.

/// Most digits: with the decimals of the others, still far from the largest `i64`.
const DIGITS: usize = 15;

/// A decimal number with at most `decimals` decimals, in units of the last of them: with three, `1.5` is 1500.
pub fn parse(word: &str, decimals: u32) -> Option<i64> {
    let (negative, digits) = word.strip_prefix('-').map_or((false, word), |digits| (true, digits));
    if digits.len() > DIGITS {
        return None;
    }
    let mut value = 0_i64;
    let mut room = decimals;
    let (mut any, mut fraction) = (false, false);
    for byte in digits.bytes() {
        match byte {
            b'0'..=b'9' if !fraction || room > 0 => {
                value = value.wrapping_mul(10).wrapping_add(i64::from(byte.wrapping_sub(b'0')));
                any = true;
                room = room.saturating_sub(u32::from(fraction));
            }
            b'.' if !fraction && decimals > 0 => fraction = true,
            _ => return None,
        }
    }
    // A point behind which there is nothing has lost what was typed there.
    if fraction && room == decimals {
        return None;
    }
    for _ in 0..room {
        value = value.wrapping_mul(10);
    }
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
            ("12.", 3, None),
            ("-0.", 3, None),
            ("5x", 0, None),
            ("+5", 0, None),
            ("999999999999999", 3, Some(999_999_999_999_999_000)),
            ("-999999999999999", 0, Some(-999_999_999_999_999)),
            ("1000000000000000", 0, None),
        ] {
            assert_eq!(parse(word, decimals), value, "{word}");
        }
    }
}

//! What a plot shows, as CSV (RFC 4180): an interval a line, empty where there is no value.

use crate::clock::Wall;
use crate::history::Span;

/// Columns.
const HEAD: &str = "utc,lowest_deg,highest_deg\r\n";

/// The text of a span that ended now.
pub fn write(span: &Span, now: Wall) -> String {
    let ms = |time: std::time::Duration| u64::try_from(time.as_millis()).unwrap_or(u64::MAX);
    let mut text = String::from(HEAD);
    for (number, extent) in (0_u64..).zip(&span.extents) {
        let back = ms(span.back).saturating_sub(number.saturating_mul(ms(span.interval)));
        text += &now.minus_ms(back).rfc3339().unwrap_or_default();
        match extent {
            Some((low, high)) => text += &format!(",{},{}\r\n", low, high),
            None => text += ",,\r\n",
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use clino_codec::angle::Angle;
    use std::time::Duration;

    #[test]
    fn a_line_an_interval() {
        let span = Span {
            interval: Duration::from_secs(1),
            back: Duration::from_secs(2),
            extents: vec![Angle::from_mdeg(-1).zip(Angle::from_mdeg(1_000)), None],
        };
        let expected = "utc,lowest_deg,highest_deg\r\n1970-01-01T00:00:08.000Z,-0.001,1.000\r\n1970-01-01T00:00:09.000Z,,\r\n";
        assert_eq!(write(&span, Wall(10_000)), expected);
    }
}

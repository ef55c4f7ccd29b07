//! Decimal text of an [`Angle`], without floating point and without a heap.

use core::fmt;

use super::Angle;
use crate::bytes::put;

/// Decimals that `{}` shows: a T7's resolution.
const DEFAULT_DECIMALS: usize = 3;
/// Decimals that an [`Angle`] holds.
const MAX_DECIMALS: usize = 6;
/// Longest text: `-2147.483648`.
const CAPACITY: usize = 12;

/// The text of an angle, in degrees.
#[derive(Clone, Copy, Debug)]
pub struct AngleText {
    /// Filled from the end, because digits come out last first.
    bytes: [u8; CAPACITY],
    start: usize,
}

impl AngleText {
    pub(super) fn new(angle: Angle, decimals: usize) -> Self {
        let decimals = decimals.min(MAX_DECIMALS);
        let mut digits = rounded_magnitude(angle, MAX_DECIMALS.saturating_sub(decimals));
        let negative = angle.udeg() < 0 && digits != 0;

        let mut text = Self { bytes: [b' '; CAPACITY], start: CAPACITY };
        let mut place = 0_usize;
        while digits != 0 || place <= decimals {
            text.prepend(b'0'.wrapping_add((digits % 10) as u8));
            digits /= 10;
            place = place.wrapping_add(1);
            if place == decimals {
                text.prepend(b'.');
            }
        }
        if negative {
            text.prepend(b'-');
        }
        text
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let text = self.bytes.get(self.start..).unwrap_or(&[]);
        // Digits, a point and a sign are always UTF-8.
        core::str::from_utf8(text).unwrap_or("")
    }

    #[inline(never)]
    fn prepend(&mut self, character: u8) {
        self.start = self.start.saturating_sub(1);
        put(&mut self.bytes, self.start, character);
    }
}

/// Micro-degrees without sign and without the last `dropped` digits, rounded half up.
fn rounded_magnitude(angle: Angle, dropped: usize) -> u32 {
    let unit = (0..dropped).fold(1_u32, |unit, _| unit.wrapping_mul(10));
    // At most 2^31 + 500 000: fits.
    let magnitude = angle.udeg().unsigned_abs().wrapping_add(unit / 2);
    (0..dropped).fold(magnitude, |digits, _| digits / 10)
}

/// Degrees with three decimals; `{:.6}` shows all that is held; `{:+}` and a width work as for numbers.
impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.text(f.precision().unwrap_or(DEFAULT_DECIMALS));
        match text.as_str().strip_prefix('-') {
            Some(magnitude) => f.pad_integral(false, "", magnitude),
            None => f.pad_integral(true, "", text.as_str()),
        }
    }
}

//! Angles in the three number formats of the map, in integer arithmetic.

/// Millidegrees per degree.
const PER_DEGREE: u64 = 1_000;
/// Millidegrees per turn, and per half turn.
const TURN: i32 = 360_000;
const HALF_TURN: i32 = 180_000;
/// Millidegrees per hundredth of a degree.
const PER_CENTIDEGREE: i32 = 10;

/// IEEE 754 binary32: bits of the fraction, the leading one included; bias of the exponent.
const SIGNIFICAND_BITS: u32 = 24;
const BIAS: u32 = 127;

/// The quiet NaN without a payload.
pub const NAN: u32 = 0x7FC0_0000;

/// The bits of the binary32 number that is nearest to `mdeg` / 1000 degrees; of two equally near, the even one.
///
/// ```
/// assert_eq!(clino_modbus::number::degrees(123_456), 123.456_f32.to_bits());
/// ```
pub const fn degrees(mdeg: i32) -> u32 {
    let sign = (mdeg as u32) & (1 << 31);
    let magnitude = mdeg.unsigned_abs() as u64;
    if magnitude == 0 {
        return 0;
    }
    // As many binary places as fit: the quotient has 54 or 55 bits, and whatever the division leaves over is noted in
    // its lowest.
    let places = magnitude.leading_zeros();
    let scaled = magnitude.wrapping_shl(places);
    let quotient = (scaled / PER_DEGREE) | !scaled.is_multiple_of(PER_DEGREE) as u64;
    let excess = u64::BITS.wrapping_sub(SIGNIFICAND_BITS).wrapping_sub(quotient.leading_zeros());
    let significand = quotient.wrapping_shr(excess) as u32;
    let rest = quotient.wrapping_shl(u64::BITS.wrapping_sub(excess));
    let half = 1 << 63;
    let up = rest > half || (rest == half && significand & 1 == 1);
    // The leading one of the significand adds one to the exponent field, and so does a carry out of the fraction.
    let exponent =
        BIAS.wrapping_add(SIGNIFICAND_BITS).wrapping_add(excess).wrapping_sub(places).wrapping_sub(2);
    sign | exponent
        .wrapping_shl(SIGNIFICAND_BITS.wrapping_sub(1))
        .wrapping_add(significand)
        .wrapping_add(up as u32)
}

/// The same direction in hundredths of a degree, −18000 to +18000, rounded half away from zero.
pub const fn centidegrees(mdeg: i32) -> i16 {
    let positive = mdeg.rem_euclid(TURN);
    let turned = if positive > HALF_TURN { positive.wrapping_sub(TURN) } else { positive };
    let half = if turned < 0 { -(PER_CENTIDEGREE / 2) } else { PER_CENTIDEGREE / 2 };
    (turned.wrapping_add(half) / PER_CENTIDEGREE) as i16
}

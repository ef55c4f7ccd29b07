//! Angles in the three number formats of the map, in integer arithmetic.

/// Millidegrees per degree.
const PER_DEGREE: u32 = 1_000;
/// Millidegrees per turn, and per half turn.
const TURN: i32 = 360_000;
const HALF_TURN: i32 = 180_000;
/// Millidegrees per hundredth of a degree.
const PER_CENTIDEGREE: i32 = 10;
/// Hundredths of a degree per half turn.
const HALF_TURN_CENTIDEGREES: i32 = HALF_TURN / PER_CENTIDEGREE;

/// IEEE 754 binary32: bits of the fraction; bias of the exponent.
const FRACTION_BITS: u32 = 23;
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
    let magnitude = mdeg.unsigned_abs();
    if magnitude == 0 {
        return 0;
    }
    // Long division: one binary place after the other, until the leading one is where it belongs. There are fewer than
    // 2^22 whole degrees, so that it always comes from the right.
    let mut significand = magnitude / PER_DEGREE;
    let mut rest = magnitude % PER_DEGREE;
    let mut exponent = BIAS.wrapping_add(FRACTION_BITS);
    while significand < 1 << FRACTION_BITS {
        rest = rest.wrapping_mul(2);
        significand = significand.wrapping_mul(2);
        if rest >= PER_DEGREE {
            rest = rest.wrapping_sub(PER_DEGREE);
            significand |= 1;
        }
        exponent = exponent.wrapping_sub(1);
    }
    let up = rest > PER_DEGREE / 2 || (rest == PER_DEGREE / 2 && significand & 1 == 1);
    // The leading one adds one to the exponent field, and so does a carry out of the fraction.
    let exponent = exponent.wrapping_sub(1) << FRACTION_BITS;
    sign | exponent.wrapping_add(significand).wrapping_add(up as u32)
}

/// The same direction in hundredths of a degree, −18000 up to, not including, +18000: rounded half away from zero, then
/// brought into that range.
pub const fn centidegrees(mdeg: i32) -> i16 {
    let positive = mdeg.rem_euclid(TURN);
    let turned = if positive >= HALF_TURN { positive.wrapping_sub(TURN) } else { positive };
    let half = if turned < 0 { -(PER_CENTIDEGREE / 2) } else { PER_CENTIDEGREE / 2 };
    match turned.wrapping_add(half) / PER_CENTIDEGREE {
        HALF_TURN_CENTIDEGREES => -HALF_TURN_CENTIDEGREES as i16,
        rounded => rounded as i16,
    }
}

//! Every angle that can be published, in every view: each view is in its documented range, and all of them are the same
//! angle, up to their own resolution.
//!
//! Which angle is published of what a sensor says is in `crates/gateway/src/value/publication/tests.rs`, for every ISU code
//! and every PWM tick; the copies of the map in `registers.rs`.

use clino_codec::angle::{Angle, Range};
use clino_gateway::Published;
use clino_modbus::number::{centidegrees, degrees};

/// Millidegrees in a turn.
const TURN: i32 = 360_000;

fn check(mdeg: i32, published: Published) {
    assert_eq!(published.mdeg(), mdeg);
    // Text, read by code that has nothing to do with how it was written.
    let text = published.to_string();
    let (whole, decimals) = text.split_once('.').expect("a decimal point");
    assert_eq!(decimals.len(), 3, "{text}");
    let said: i32 = format!("{whole}{decimals}").parse().expect("digits");
    assert_eq!(said, mdeg, "{text}");
    assert!(text != "-0.000", "there is one zero");
    // The float nearest to it: read as text, it is the same again.
    let float = f32::from_bits(degrees(mdeg));
    assert_eq!(float, text.parse::<f32>().expect("a number"), "{text}");
    assert_eq!((f64::from(float) * 1_000.0).round() as i32, mdeg, "{text} is {float}");
    assert!((-180.0..360.0).contains(&float), "{text} is {float}");
    // Hundredths: half a one off at most, on the circle.
    let hundredths = i32::from(centidegrees(mdeg));
    assert!((-18_000..18_000).contains(&hundredths), "{text} is {hundredths}");
    let off = (hundredths * 10 - mdeg).rem_euclid(TURN);
    assert!(off.min(TURN - off) <= 5, "{text} is {hundredths}");
}

#[test]
fn every_published_angle_is_the_same_in_every_view() {
    for mdeg in -180_000..180_000 {
        check(mdeg, Published::new(Angle::from_mdeg(mdeg).expect("small"), Range::Bidirectional));
    }
    for mdeg in 0..360_000 {
        check(mdeg, Published::new(Angle::from_mdeg(mdeg).expect("small"), Range::Unidirectional));
    }
}

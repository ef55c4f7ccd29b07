//! The sensors behind the gateway, and the truth about them: they stand still, so that it is one number each.

use std::fmt::Write as _;

/// A sensor that a slot of the image as delivered reads.
struct Sensor {
    /// Its table in the scenario.
    table: &'static str,
    /// Address, or channel.
    number: (&'static str, u8),
    degrees: f64,
    /// Half a step of its output, in degrees.
    tolerance: f64,
}

/// A T7 says millidegrees.
const T7: f64 = 0.000_5;
/// An ISU divides a turn by 65536.
const ISU: f64 = 360.0 / 65_536.0 / 2.0;
/// Its PWM output by 4096; and its clock is not that of the timer that measures it.
const PWM: f64 = 360.0 / 4_096.0 / 2.0 + 0.05;

/// By slot.
const SENSORS: [Sensor; 6] = [
    t7(1, 12.345),
    t7(2, -170.5),
    t7(3, 0.001),
    Sensor { table: "isu", number: ("address", 1), degrees: 271.25, tolerance: ISU },
    pwm(1, 45.0),
    pwm(2, 359.0),
];
/// No slot reads it until a test sets one.
const SPARE: Sensor = t7(SPARE_ADDRESS, 66.006);
/// Its address.
pub const SPARE_ADDRESS: u8 = 5;

const fn t7(address: u8, degrees: f64) -> Sensor {
    Sensor { table: "t7", number: ("address", address), degrees, tolerance: T7 }
}

const fn pwm(channel: u8, degrees: f64) -> Sensor {
    Sensor { table: "pwm", number: ("channel", channel), degrees, tolerance: PWM }
}

/// The scenario file.
pub fn scenario() -> String {
    let mut text = String::from("seed = 1\n");
    for Sensor { table, number: (key, number), degrees, .. } in SENSORS.iter().chain([&SPARE]) {
        write!(text, "[[{table}]]\n{key} = {number}\nmotion.constant = {degrees}\n").expect("memory");
    }
    text
}

/// The same for scripts: `slot:degrees:tolerance` of each slot, and the spare T7 as `address:degrees:tolerance`.
pub fn truth() -> Vec<String> {
    let of = |number: usize, sensor: &Sensor| format!("{number}:{}:{}", sensor.degrees, sensor.tolerance);
    let slots = SENSORS.iter().enumerate().map(|(slot, sensor)| of(slot, sensor));
    slots.chain([of(SPARE.number.1.into(), &SPARE)]).collect()
}

/// What a slot has to say, in degrees, and the tolerance of it; `None` of a slot that reads nothing.
pub fn angle(slot: usize) -> Option<(f64, f64)> {
    SENSORS.get(slot).map(|sensor| (sensor.degrees, sensor.tolerance))
}

/// What the spare sensor has to say, and the tolerance of it.
pub fn spare_angle() -> (f64, f64) {
    (SPARE.degrees, SPARE.tolerance)
}

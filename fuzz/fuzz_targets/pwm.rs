//! Any two counts give an angle within a turn or a fault that is true.
#![no_main]

use clino_codec::angle::Range;
use clino_codec::pwm::{Law, Limits, PwmFault, Ticks, measure};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: [u32; 4]| {
    let [period, high, timer_hz, tolerance] = input;
    let ticks = Ticks { period, high };
    let limits = Limits { period_tolerance_ppm: tolerance, ..Limits::new(timer_hz) };
    match measure(ticks, &limits, Law::Documented) {
        Ok(reading) => {
            assert!(Range::Unidirectional.contains(reading.angle));
            assert!((232_800..=767_200).contains(&reading.duty_ppm));
        }
        Err(PwmFault::Period { shortest, longest, .. }) => assert!(period < shortest || period > longest),
        Err(PwmFault::HighBeyondPeriod { .. }) => assert!(high > period || period == 0),
        Err(PwmFault::DutyBelow { duty_ppm, min_ppm }) => assert!(duty_ppm < min_ppm),
        Err(PwmFault::DutyAbove { duty_ppm, max_ppm }) => assert!(duty_ppm > max_ppm),
    }
});

//! The ISU's pulse-width output: ticks of any timer to duty and angle, by the documented law.
//!
//! Whether a real ISU could have sent such a pulse is not judged: at a bench one wants to see the number.

use std::io;

use clap::Args;
use clino_codec::pwm::{Law, Ticks};
use serde::Serialize;
use serde::ser::{SerializeMap as _, Serializer};

use crate::bad::Bad;
use crate::number;
use crate::outcome::{DecodeVerdict, Failure};
use crate::report;

/// One cycle, in ticks of one timer.
#[derive(Args)]
pub struct Arguments {
    /// Rising edge to rising edge, 1..=4294967295
    #[arg(long, value_name = "TICKS", value_parser = ticks)]
    period_ticks: u32,
    /// Rising edge to falling edge, at most the period
    #[arg(long, value_name = "TICKS", value_parser = ticks)]
    high_ticks: u32,
}

fn ticks(text: &str) -> Result<u32, String> {
    number::within(text, u32::MIN..=u32::MAX)
}

pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    let Arguments { period_ticks: period, high_ticks: high } = arguments;
    Ok(report::line(&mut io::stdout().lock(), measure(Ticks { period, high }))?)
}

fn measure(ticks: Ticks) -> Result<Measured, Bad> {
    let Ticks { period, high } = ticks;
    if period == 0 {
        return Err(Bad::new("zero_period", "the period is zero ticks").with("period_ticks", period));
    }
    match (ticks.duty_ppm(), Law::Documented.angle(ticks)) {
        (Some(duty_ppm), Some(angle)) => Ok(Measured { duty_ppm, angle_udeg: angle.udeg() }),
        _ => Err(Bad::new("high_beyond_period", "the pulse is longer than its period")
            .with("period_ticks", period)
            .with("high_ticks", high)),
    }
}

struct Measured {
    duty_ppm: u32,
    angle_udeg: i32,
}

impl Serialize for Measured {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("duty_ppm", &self.duty_ppm)?;
        object.serialize_entry("angle_udeg", &self.angle_udeg)?;
        object.end()
    }
}

//! One JSON object per line, fixed keys, `null` where there is no number.
//!
//! ```text
//! {"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":12.345,"age_ms":3}
//! {"stats":"t7","requests":152,"good":152,"no_answer":0, …}
//! ```
//!
//! `angle_deg` is in degrees with three decimals and is a number only while `status` is `ok`; `age_ms` is the
//! time since the last good value of that slot was received, whatever the status is now.

use core::fmt::{self, Write};

use clino_bus::{Counters, Micros};

use crate::config::{Bus, PwmInput, Source};
use crate::value::Reading;

/// Longest line this module writes, line end included: a statistics line with every counter at its largest.
pub const MAX_LINE: usize = 384;

/// How the line driver behaved, as the hardware measured it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriverEnable {
    /// Longest time from the end of a frame's last stop bit to DE low, in nanoseconds.
    pub release_max_ns: u32,
    /// Longest time DE was high, in microseconds.
    pub high_max_us: u32,
}

/// Writes a reading as it stands at `now`.
pub fn reading(out: &mut impl Write, reading: &Reading, now: Micros) -> fmt::Result {
    let (kind, bus, address) = name(&reading.source);
    write!(
        out,
        "{{\"slot\":{},\"kind\":\"{kind}\",\"bus\":\"{bus}\",\"address\":{address},\"status\":\"{}\",\"angle_deg\":",
        reading.slot,
        reading.status(now).name()
    )?;
    match reading.angle(now) {
        Some(angle) => write!(out, "{angle}")?,
        None => out.write_str("null")?,
    }
    out.write_str(",\"age_ms\":")?;
    match reading.age(now) {
        Some(age) => write!(out, "{}", age.as_millis())?,
        None => out.write_str("null")?,
    }
    out.write_str("}\r\n")
}

/// Writes the statistics of a bus.
pub fn statistics(out: &mut impl Write, bus: Bus, counters: &Counters, driver: &DriverEnable) -> fmt::Result {
    write!(
        out,
        "{{\"stats\":\"{}\",\"requests\":{},\"good\":{},\"no_answer\":{},\"bad_answer\":{},\"late\":{},\
         \"forced\":{},\"junk\":{},\"framing\":{},\"noise\":{},\"overrun\":{},\"response_us\":{},\
         \"response_max_us\":{},\"de_release_max_ns\":{},\"de_high_max_us\":{}}}\r\n",
        bus_name(bus),
        counters.requests,
        counters.good,
        counters.no_answer,
        counters.bad_answer,
        counters.late,
        counters.forced,
        counters.junk,
        counters.framing,
        counters.noise,
        counters.overrun,
        counters.response_last.0,
        counters.response_max.0,
        driver.release_max_ns,
        driver.high_max_us,
    )
}

fn name(source: &Source) -> (&'static str, &'static str, u8) {
    match source {
        Source::T7 { address, .. } => ("t7", bus_name(Bus::T7), address.get()),
        Source::Isu { address } => ("isu", bus_name(Bus::Isu), address.get()),
        Source::Pwm { input: PwmInput::Pwm1 } => ("pwm", "pwm1", 0),
        Source::Pwm { input: PwmInput::Pwm2 } => ("pwm", "pwm2", 0),
    }
}

const fn bus_name(bus: Bus) -> &'static str {
    match bus {
        Bus::T7 => "t7",
        Bus::Isu => "isu",
    }
}

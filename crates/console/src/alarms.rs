//! Alarms: which there are, and their acknowledgement.

use clino_gateway::order::Order;
use clino_gateway::{Alarm, AlarmDetail, MAX_SLOTS, Reading};

use crate::job::{Job, Outcome};
use crate::json;
use crate::slots::LAST_SLOT;
use crate::value::{DECIMALS, Value};

/// `alarms`: each alarm that is active or waits for its acknowledgement.
pub fn alarms(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let mut quiet = true;
    for slot in 0..MAX_SLOTS {
        let Some(reading) = job.host.reading(slot) else { break };
        for (alarm, ..) in Alarm::ALL {
            if let Some(detail) = job.host.alarm(reading.slot.into(), alarm) {
                show(job, alarm, &detail, &reading);
                quiet = false;
            }
        }
    }
    if quiet {
        job.reply.say(if job.reply.is_for_people() { "no alarms\n" } else { "{\"alarm\":null}\n" });
    }
    Ok(())
}

#[inline(never)]
fn show(job: &mut Job<'_, '_>, alarm: Alarm, detail: &AlarmDetail, reading: &Reading) {
    if !job.reply.is_for_people() {
        _ = json::alarm(job.reply.out, alarm, Some(*detail), reading, job.now);
        return;
    }
    let AlarmDetail { state, age_ms, extreme } = *detail;
    let (slot, name, state, seconds) = (reading.slot, alarm.name(), state.name(), age_ms / 1_000);
    _ = write!(job.reply.out, "slot {slot:>2}  {name:<8}  {state:<14}  {seconds} s");
    if let Some(extreme) = extreme {
        let unit = if alarm == Alarm::Rate { "deg/s" } else { "deg" };
        _ = write!(job.reply.out, "  extreme {} {unit}", Value::Decimal(extreme.into(), DECIMALS as u8));
    }
    job.reply.say("\n");
}

/// `acknowledge [SLOT]`
pub fn acknowledge(job: &mut Job<'_, '_>) -> Outcome {
    let slot = match job.typed.next() {
        Some(word) => Some(job.byte(word, "slot", 0, LAST_SLOT)?),
        None => None,
    };
    job.end()?;
    job.order(Order::Acknowledge(slot))
}

//! Alarms: which there are, and their acknowledgement.

use clino_gateway::order::Order;
use clino_gateway::{Alarm, AlarmDetail, MAX_SLOTS, Reading};

use crate::job::{Job, Outcome};
use crate::json;
use crate::slots::LAST_SLOT;
use crate::value::thousandths;

/// `alarms`: each alarm that is active or waits for its acknowledgement.
pub fn alarms(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let mut quiet = true;
    for slot in 0..MAX_SLOTS {
        let Some(reading) = &job.host.reading(slot) else { break };
        for alarm in Alarm::EACH {
            if let Some(detail) = job.host.alarm(reading.slot.into(), alarm) {
                show(job, alarm, &detail, reading);
                quiet = false;
            }
        }
    }
    if quiet {
        job.reply.either("no alarms\n", "{\"alarm\":null}\n");
    }
    Ok(())
}

#[inline(never)]
fn show(job: &mut Job<'_, '_>, alarm: Alarm, detail: &AlarmDetail, reading: &Reading) {
    if !job.reply.is_for_people() {
        return json::alarm(&mut job.reply, alarm, Some(*detail), reading, job.now);
    }
    let AlarmDetail { state, age_ms, extreme } = *detail;
    let values = [reading.slot.into(), alarm.name().into(), state.name().into(), (age_ms / 1_000).into()];
    job.reply.print("slot {0>2}  {1<8}  {2<14}  {3} s", &values);
    if let Some(extreme) = extreme {
        let unit = if alarm == Alarm::Rate { "deg/s" } else { "deg" };
        job.reply.print("  extreme {0} {1}", &[thousandths(extreme), unit.into()]);
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

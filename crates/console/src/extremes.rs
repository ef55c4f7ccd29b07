//! The lowest and the highest angle of each slot since they were cleared.

use clino_gateway::order::Order;
use clino_gateway::{Detail, Source};

use crate::job::{Job, Outcome, Reported};
use crate::slots::LAST_SLOT;

/// Milliseconds in a second.
const MS_PER_S: u64 = 1_000;

/// `extremes [SLOT]`, `extremes clear [SLOT]`
pub fn extremes(job: &mut Job<'_, '_>) -> Outcome {
    let word = job.typed.next();
    if word == Some("clear") {
        let word = job.typed.next();
        let slot = which(job, word)?;
        job.end()?;
        return job.order(Order::ClearExtremes(slot));
    }
    let slot = which(job, word)?;
    job.end()?;
    for number in 0..=LAST_SLOT {
        if slot.is_none_or(|slot| slot == number) {
            show(job, number, slot.is_some());
        }
    }
    Ok(())
}

/// The slot that is named, if one is.
fn which(job: &mut Job<'_, '_>, word: Option<&str>) -> Result<Option<u8>, Reported> {
    word.map(|word| job.byte(word, "slot", 0, LAST_SLOT)).transpose()
}

/// Shows those of a slot; of one that is not in use only if it is named.
#[inline(never)]
fn show(job: &mut Job<'_, '_>, slot: u8, named: bool) {
    let used = job.host.reading(slot.into()).is_some_and(|reading| reading.source != Source::Off);
    let Some(Detail { extremes, .. }) = job.host.detail(slot.into()).filter(|_| used || named) else {
        return;
    };
    let now = job.now;
    let mut list =
        job.reply.open_list("extremes lowest_deg lowest_age_s highest_deg highest_age_s", slot.into());
    for extreme in [extremes.lowest(now), extremes.highest(now)] {
        list.thousandths_of(extreme.map(|extreme| extreme.mdeg));
        list.next(extreme.map(|extreme| extreme.age_ms / MS_PER_S).into());
    }
    list.end();
}

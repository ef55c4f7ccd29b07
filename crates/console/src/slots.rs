//! Slots: what they read, and what they are.

use clino_bus::Micros;
use clino_codec::t7::Axis;
use clino_gateway::order::Order;
use clino_gateway::{Health, MAX_SLOTS, PwmInput, SlotConfig, Source, Status, json};

use crate::error::Error;
use crate::job::{Job, Outcome, Told};
use crate::pending::Next;
use crate::settings::{self, Field};
use crate::table;
use crate::tasks::{axis, one_isu, one_t7};
use crate::typed::Opt;
use crate::value::Value;
use crate::words::Kind;

/// The last slot.
pub const LAST_SLOT: u8 = MAX_SLOTS.saturating_sub(1) as u8;

const PERIOD: Opt = Opt(Some('p'), "period");
const RETRIES: Opt = Opt(Some('r'), "retries");
const STALE: Opt = Opt(Some('s'), "stale");

/// `list`
pub fn list(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    table::head(&mut job.reply);
    for reading in (0..MAX_SLOTS).map_while(|slot| job.host.reading(slot)) {
        table::row(&mut job.reply, &reading, job.now);
    }
    Ok(())
}

/// `read SLOT`
pub fn read(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    job.end()?;
    let Some(reading) = job.host.reading(slot.into()) else { return Ok(()) };
    let (now, (kind, bus, address)) = (job.now, json::name(&reading.source));
    let status = reading.status(now);
    // Of a value that is not there nothing is known, neither that it is well nor that it is new.
    let known = |value| if status == Status::Ok { value } else { Value::None };
    let health = match reading.health {
        Health::WELL if status != Status::Ok && job.reply.is_for_people() => "unknown".into(),
        health => Value::Health(health),
    };
    // The first ones are those of the stream.
    let names = "kind bus address status angle_deg age_ms health \
                 raw_deg rate_deg_s turns temperature_c fresh sequence";
    let values = [
        kind.into(),
        bus.into(),
        address.into(),
        status.name().into(),
        reading.angle(now).into(),
        reading.age(now).map(Micros::as_millis).into(),
        health,
        reading.raw(now).into(),
        reading.rate(now).map(|rate| Value::Thousandths(rate.into())).into(),
        known(reading.turns().into()),
        known(reading.temperature().map(|c| Value::Thousandths(i64::from(c).saturating_mul(10))).into()),
        known(Value::Flag(reading.is_fresh())),
        reading.sequence.into(),
    ];
    job.reply.list("slot", slot.into(), names, &values);
    Ok(())
}

/// `watch`
pub fn watch(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    table::head(&mut job.reply);
    *job.next = Next::Stream;
    Ok(())
}

/// `slot SLOT KIND ADDRESS`
pub fn slot(job: &mut Job<'_, '_>) -> Outcome {
    let axis = axis(job)?;
    let period = job.option(PERIOD)?;
    let retries = job.option(RETRIES)?;
    let stale = job.option(STALE)?;
    let slot = job.slot()?;
    let mut config = SlotConfig::usual(source(job, axis)?);
    for (field, word) in [(Field::Period, period), (Field::Retries, retries), (Field::Stale, stale)] {
        if let Some(word) = word {
            field.set(&mut config, word, job)?;
        }
    }
    set_slot(job, slot, config)
}

/// `show SLOT`
pub fn show(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    job.end()?;
    if let Some(config) = job.host.config(slot.into()) {
        settings::show(&mut job.reply, slot, &config);
    }
    Ok(())
}

/// `set SLOT FIELD VALUE`
pub fn set(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    let Some(mut config) = job.host.config(slot.into()) else { return Ok(()) };
    let field: Field = job.one_of("field")?;
    let word = job.word("value")?;
    field.set(&mut config, word, job)?;
    set_slot(job, slot, config)
}

/// `zero SLOT`
pub fn zero(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    let (Some(reading), Some(config)) = (job.host.reading(slot.into()), job.host.config(slot.into())) else {
        return Ok(());
    };
    // A slot that has just been told to read something else has not said what that is.
    let raw = reading.raw(job.now).filter(|_| reading.source == config.source);
    let Some(soft_zero) = raw else {
        return Err(job.refuse(&Error::NoValue { slot, status: reading.status(job.now) }));
    };
    set_slot(job, slot, SlotConfig { soft_zero, ..config })
}

impl Job<'_, '_> {
    /// The number of a slot.
    #[inline(never)]
    pub fn slot(&mut self) -> Result<u8, Told> {
        let word = self.word("slot")?;
        self.byte(word, "slot", 0, LAST_SLOT)
    }
}

#[inline(never)]
fn set_slot(job: &mut Job<'_, '_>, slot: u8, config: SlotConfig) -> Outcome {
    job.end()?;
    job.order(Order::Slot { slot, config })
}

fn source(job: &mut Job<'_, '_>, axis: Axis) -> Result<Source, Told> {
    let kind = job.one_of("kind")?;
    if kind == Kind::Off {
        return Ok(Source::Off);
    }
    let word = job.word("address")?;
    Ok(match kind {
        Kind::Off => Source::Off,
        Kind::T7 => Source::T7 { address: one_t7(job, word)?, axis },
        Kind::Isu => Source::Isu { address: one_isu(job, word)? },
        Kind::Pwm => Source::Pwm {
            input: match job.byte(word, "pwm_input", 1, 2)? {
                1 => PwmInput::Pwm1,
                _ => PwmInput::Pwm2,
            },
        },
    })
}

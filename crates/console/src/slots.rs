//! Slots: their readings and their settings.

use clino_codec::angle::Angle;
use clino_gateway::config::Kind;
use clino_gateway::order::Order;
use clino_gateway::settings::slot::{SETTINGS, id};
use clino_gateway::settings::{self, Definition, Given, Tabled};
use clino_gateway::{Bus, Health, MAX_SLOTS, Published, SlotConfig, Status};

use crate::error::{NO_EFFECT, NO_VALUE};
use crate::features::{ISU, MODBUS};
use crate::job::{Job, Outcome, Reported};
use crate::json;
use crate::label::Label;
use crate::pending::Next;
use crate::rows::{of_slot, row_of, rows};
use crate::settings::{Change, entries};
use crate::typed::Opt;
use crate::value::Value;
use crate::{buses, system, table};

/// The last slot.
pub const LAST_SLOT: u8 = MAX_SLOTS.saturating_sub(1) as u8;

/// Options of `slot`, and the settings that they name.
const OPTIONS: [(Opt, u8); 4] = [
    (Opt(Some(b'a'), "axis"), id::AXIS),
    (Opt(Some(b'p'), "period"), id::PERIOD),
    (Opt(Some(b'r'), "retries"), id::RETRIES),
    (Opt(Some(b's'), "stale"), id::STALE),
];

/// `list`
pub fn list(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    table::head(&mut job.reply);
    for reading in (0..MAX_SLOTS).map_while(|slot| job.host.reading(slot)) {
        let name = table::name_of(job.host, reading.slot);
        table::row(&mut job.reply, &reading, name, job.now);
    }
    table::summary(&mut job.reply, &job.host.summary());
    Ok(())
}

/// `read SLOT`
pub fn read(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    job.end()?;
    let Some(reading) = &job.host.reading(slot.into()) else { return Ok(()) };
    let Some(detail) = &job.host.detail(slot.into()) else { return Ok(()) };
    let (now, (kind, bus, address)) = (job.now, json::name(&reading.source));
    let status = reading.status(now);
    // A value that does not exist has neither health nor freshness.
    let is_ok = status == Status::Ok;
    let health = match reading.health {
        Health::WELL if !is_ok && job.reply.is_for_people() => "unknown".into(),
        health => Value::Health(health),
    };
    // The first ones are those of the stream.
    let row = "slot kind bus address status angle_deg age_ms health \
               raw_deg rate_deg_s turns temperature_c fresh sequence last_error unconfirmed quarantine";
    let mut list = job.reply.open_list(row, slot.into());
    list.text(kind);
    list.text(bus);
    list.count(address.into());
    list.text(status.name());
    list.next(reading.angle(now).into());
    list.next(reading.age_ms(now).into());
    list.next(health);
    list.next(reading.raw(now).map(Published::of_sensor).into());
    list.thousandths_of(reading.rate(now));
    list.next(if is_ok { reading.turns().into() } else { Value::None });
    list.thousandths_of(reading.temperature().filter(|_| is_ok).map(|c| i32::from(c).saturating_mul(10)));
    list.next(if is_ok { Value::Flag(reading.is_fresh()) } else { Value::None });
    list.count(reading.sequence);
    list.text_of(detail.last_error.map(Status::name));
    list.flag(detail.awaits_confirmation);
    list.flag(detail.is_dead);
    list.end();
    Ok(())
}

/// `watch`
pub fn watch(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    table::head(&mut job.reply);
    *job.next = Next::Stream;
    Ok(())
}

/// `slot SLOT KIND ADDRESS`: settings that are not named become the defaults of the kind.
pub fn slot(job: &mut Job<'_, '_>) -> Outcome {
    let mut words = [None; OPTIONS.len()];
    for (word, (option, _)) in words.iter_mut().zip(&OPTIONS) {
        *word = job.option(*option)?;
    }
    let slot = job.slot()?;
    let kind: Kind = job.one_of("kind")?;
    let mut change = Change::default();
    change.name(id::KIND, kind as i64);
    for (word, (_, id)) in words.iter().zip(&OPTIONS) {
        if let (Some(word), Some(row)) = (word, row_of(of_slot, *id)) {
            applies(job, row, kind)?;
            change.name(*id, job.value(row, word)?);
        }
    }
    if let (Kind::T7 | Kind::Isu | Kind::Pwm, Some(row)) = (kind, row_of(of_slot, id::ADDRESS)) {
        let word = job.word("address")?;
        change.name(id::ADDRESS, job.value(row, word)?);
    }
    set_slot(job, slot, &change)
}

/// A setting is only taken for a slot that has it.
#[inline(never)]
fn applies(job: &mut Job<'_, '_>, row: &Definition, kind: Kind) -> Outcome {
    if settings::slot::applies(row.id, kind) {
        return Ok(());
    }
    Err(job.refuse(NO_EFFECT, &[row.name.into(), kind.name().into()]))
}

/// `show SLOT`, or what else can be set
pub fn show(job: &mut Job<'_, '_>) -> Outcome {
    match target(job)? {
        Target::Slot(slot) => {
            job.end()?;
            let Some(config) = &job.host.config(slot.into()) else { return Ok(()) };
            let kind = config.source.kind();
            job.reply.begin_list("config", slot.into());
            entries(&mut job.reply, &Tabled::new(&SETTINGS, config), &|id| settings::slot::applies(id, kind));
            job.reply.entry(&Label::plain("name"), Value::Quoted(config.name.as_str()));
            job.reply.end_list();
            Ok(())
        }
        Target::Bus(bus) => {
            job.end()?;
            buses::show(job, bus);
            Ok(())
        }
        Target::Modbus => system::show_modbus(job),
        Target::Console => system::show_console(job),
    }
}

/// `set SLOT SETTING VALUE`, or of what else can be set; several settings at once
pub fn set(job: &mut Job<'_, '_>) -> Outcome {
    match target(job)? {
        Target::Slot(slot) => set_settings(job, slot),
        Target::Bus(bus) => buses::set(job, bus),
        Target::Modbus => system::set_modbus(job),
        Target::Console => system::set_console(job),
    }
}

fn set_settings(job: &mut Job<'_, '_>, slot: u8) -> Outcome {
    let mut change = Change::default();
    job.change(of_slot, &mut change)?;
    let kind = change.of(id::KIND).and_then(|given| u8::try_from(given.value).ok());
    let kind = match kind.and_then(Kind::from_code) {
        Some(kind) => kind,
        None => job.host.config(slot.into()).map_or(Kind::Off, |config| config.source.kind()),
    };
    // An unused slot keeps every setting.
    for (_, row) in rows(of_slot).filter(|(_, row)| kind != Kind::Off && change.of(row.id).is_some()) {
        applies(job, row, kind)?;
    }
    job.end()?;
    let result = job.host.change_slot(slot, &|id| change.of(id));
    job.accepted(result)?;
    job.reply.done();
    Ok(())
}

/// A target of `show` and `set`.
enum Target {
    Slot(u8),
    Bus(Bus),
    Modbus,
    Console,
}

#[inline(never)]
fn target(job: &mut Job<'_, '_>) -> Result<Target, Reported> {
    let word = job.word("slot")?;
    Ok(match word {
        "t7" => Target::Bus(Bus::T7),
        "isu" if ISU => Target::Bus(Bus::Isu),
        "modbus" if MODBUS => Target::Modbus,
        "console" => Target::Console,
        word => Target::Slot(job.byte(word, "slot", 0, LAST_SLOT)?),
    })
}

/// `zero SLOT`
pub fn zero(job: &mut Job<'_, '_>) -> Outcome {
    let slot = job.slot()?;
    let soft_zero = match raw(job, slot) {
        Ok(angle) => angle,
        Err(status) => return Err(job.refuse(NO_VALUE, &[slot.into(), status.name().into()])),
    };
    job.end()?;
    let zero = Given::exactly(soft_zero.udeg().into());
    let result = job.host.change_slot(slot, &|id| (id == id::ZERO).then_some(zero));
    job.accepted(result)?;
    job.reply.done();
    Ok(())
}

/// The angle of a slot, as its sensor gives it; its status if there is none.
#[inline(never)]
fn raw(job: &Job<'_, '_>, slot: u8) -> Result<Angle, Status> {
    let slot = usize::from(slot);
    let Some(reading) = &job.host.reading(slot) else { return Err(Status::Disabled) };
    // A slot whose source has just changed has no value of it yet.
    let is_its = job.host.config(slot).is_some_and(|config| config.source == reading.source);
    reading.raw(job.now).filter(|_| is_its).ok_or(reading.status(job.now))
}

impl Job<'_, '_> {
    /// The number of a slot.
    #[inline(never)]
    pub fn slot(&mut self) -> Result<u8, Reported> {
        let word = self.word("slot")?;
        self.byte(word, "slot", 0, LAST_SLOT)
    }
}

#[inline(never)]
fn set_slot(job: &mut Job<'_, '_>, slot: u8, change: &Change) -> Outcome {
    let config = settings::slot::changed(&SlotConfig::OFF, &|id| change.of(id));
    let config = config.map_err(|refusal| job.refused(&refusal))?;
    job.end()?;
    job.order(Order::Slot { slot, config })
}

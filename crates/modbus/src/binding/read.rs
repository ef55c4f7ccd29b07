//! Values of the registers of the map.

use clino_bus::{BusCounters, DriverEnable, Duration, Instant};
use clino_gateway::settings::{self, Shown, Tabled, console, port, slot};
use clino_gateway::summary::Summary;
use clino_gateway::{Bus, BusHealth, Detail, Health, Published, Reading, SlotConfig, Status};

use super::{Binding, Site};
use crate::bits::slot_bits;
use crate::command::Progress;
use crate::exception::Exception;
use crate::map::lookup::{self, Number, Register};
use crate::map::{
    BusItem, CommandItem, DetailItem, GatewayItem, Item, MAGIC, ReadingItem, SLOT_BASE, SLOT_STRIDE, SLOTS,
    StartItem, TEST_ANGLE, TEST_NUMBER, VERSION,
};
use crate::number;
use crate::settings::Settings;

mod start;

/// Ages from here on read "unavailable".
const LONGEST_AGE_MS: u32 = 0xFFFF;
const MILLIS_PER_SECOND: u64 = 1_000;
/// Unit of response times of slots, µs.
const RESPONSE_UNIT: u32 = 10;
/// Longer ones read this value, in that unit.
const LONGEST_RESPONSE: u32 = 0xFFFF;

/// Reads registers for one request. Remembers what was asked of the gateway for the register before.
pub struct Reader<'r, S> {
    binding: &'r Binding<S>,
    port: &'r Settings,
    progress: Option<Progress>,
    known: Known,
    summary: Option<Summary>,
}

/// What the gateway was asked last. A block is about one of these: a request that goes through a block asks once for each
/// instance.
enum Known {
    Nothing,
    /// Of a slot, if it is in use.
    Detail(usize, Option<Reading>, Option<Detail>),
    /// Of a slot.
    Config(usize, SlotConfig),
    Bus(Bus, BusCounters, BusHealth, DriverEnable),
}

impl<'r, S: Site> Reader<'r, S> {
    pub fn new(binding: &'r Binding<S>, port: &'r Settings) -> Reader<'r, S> {
        Reader { binding, port, progress: None, known: Known::Nothing, summary: None }
    }

    /// Hands out `quantity` registers, beginning with `first`.
    pub fn read(&mut self, first: u16, quantity: u16, take: &mut dyn FnMut(u16)) -> Result<(), Exception> {
        let end = u32::from(first).saturating_add(u32::from(quantity));
        let mut next = u32::from(first);
        let mut following: Option<Number> = None;
        while next < end {
            let address = u16::try_from(next).map_err(|_| Exception::IllegalDataAddress)?;
            let register = match following {
                Some(number) => Register::Of(number),
                None => lookup::find(address).ok_or(Exception::IllegalDataAddress)?,
            };
            let Register::Of(number) = register else {
                take(0);
                next = next.wrapping_add(1);
                continue;
            };
            following = number.next();
            let value = self.value(&number).unwrap_or(number.form.sentinel());
            let value = if number.form.is_swapped() { value.rotate_left(16) } else { value };
            // The high word, if it is asked for; the low one, if the request does not end before it.
            if number.form.registers() == 2 && number.word == 0 {
                take((value >> 16) as u16);
                next = next.wrapping_add(1);
            }
            if next < end {
                take(value as u16);
                next = next.wrapping_add(1);
            }
        }
        Ok(())
    }

    /// A number of the map, as its bits; `None` if there is none.
    fn value(&mut self, number: &Number) -> Option<u32> {
        let Number { index, .. } = *number;
        match number.item {
            Item::Gateway(item) => self.gateway(item, index),
            Item::Reading(item) => self.reading(item, index),
            Item::Detail(item) => self.detail(item, index),
            Item::Bus(item) => Some(self.bus(item, number.bus())),
            Item::Start(item) => self.start(item, index),
            Item::SlotSetting(id) => Some(self.slot_setting(id, index, number.scale)),
            Item::BusSetting(id) => {
                let table = settings::bus::settings(number.bus());
                let look = |settings: &_| setting(&Tabled::new(table, settings), id, number.scale);
                self.binding.site.gateway(|gateway| look(gateway.bus_settings(number.bus())))
            }
            Item::Port(id) => Some(setting(&Tabled::new(&port::SETTINGS, self.port), id, number.scale)),
            Item::Console(id) => {
                let settings = self.binding.site.gateway(|gateway| gateway.console_settings())?;
                Some(setting(&Tabled::new(&console::SETTINGS, &settings), id, number.scale))
            }
            Item::Command(item) => Some(self.command(item)),
            Item::Result(item) => self.binding.results.number(item, index),
            Item::Found(item) => self.binding.results.found(item, index),
        }
    }

    fn reading(&self, item: ReadingItem, slot: usize) -> Option<u32> {
        let now = self.binding.now;
        let look = |gateway: &mut clino_gateway::Gateway| {
            let mut mdeg = || Some(gateway.angle(slot, now)?.mdeg());
            match item {
                ReadingItem::Status => {
                    Some(gateway.status(slot, now).unwrap_or(Status::Disabled).code().into())
                }
                ReadingItem::Angle => mdeg().map(|mdeg| mdeg as u32),
                ReadingItem::Degrees => mdeg().map(number::degrees),
                ReadingItem::Centidegrees => mdeg().map(|mdeg| number::centidegrees(mdeg) as u16 as u32),
                ReadingItem::Age => age(gateway.age_ms(slot, now)),
            }
        };
        self.binding.site.gateway(look).flatten()
    }

    fn gateway(&mut self, item: GatewayItem, index: usize) -> Option<u32> {
        let bits = |set: u64| (set >> (index & 63)) as u32;
        Some(match item {
            GatewayItem::Magic => MAGIC,
            GatewayItem::MapVersion => u32::from(VERSION),
            GatewayItem::SlotCount => SLOTS as u32,
            GatewayItem::SlotBase => u32::from(SLOT_BASE),
            GatewayItem::SlotStride => u32::from(SLOT_STRIDE),
            GatewayItem::TestNumber => TEST_NUMBER,
            GatewayItem::TestAngle => number::degrees(TEST_ANGLE),
            GatewayItem::Version => {
                let (major, minor, _) = self.binding.site.version();
                u32::from(u16::from_be_bytes([major, minor]))
            }
            GatewayItem::Patch => u32::from(self.binding.site.version().2),
            GatewayItem::Uptime => seconds(self.binding.now.millis_since(Instant::ZERO)),
            GatewayItem::Sequence => u32::from(self.binding.generation as u16),
            GatewayItem::Status => u32::from(self.summary().signals.bits()),
            GatewayItem::Online => bits(self.summary().online),
            GatewayItem::Valid => bits(self.summary().valid),
            GatewayItem::Alarms => bits(self.summary().alarms),
            GatewayItem::Enabled => u32::from(self.summary().enabled),
            GatewayItem::Good => self.summary().good(),
            GatewayItem::OldestAge => return age(Some(self.summary().oldest_ms)),
        })
    }

    #[inline(never)]
    fn start(&self, item: StartItem, index: usize) -> Option<u32> {
        start::number(&self.binding.site.start(), item, index)
    }

    /// Made once for a request.
    #[inline(never)]
    fn summary(&mut self) -> &Summary {
        let binding = self.binding;
        self.summary.get_or_insert_with(|| binding.summary())
    }

    // What is asked is put in its place by functions of their own, whose stack is free again before the registers are made.

    fn ask_detail(&mut self, slot: usize) {
        self.known = Known::Detail(slot, None, None);
        if let Known::Detail(_, reading, detail) = &mut self.known {
            self.binding.put_slot(slot, reading, detail);
        }
    }

    fn ask_config(&mut self, slot: usize) {
        self.known = Known::Config(slot, SlotConfig::OFF);
        if let Known::Config(_, config) = &mut self.known {
            self.binding.put_config(slot, config);
        }
    }

    #[inline(never)]
    fn ask_bus(&mut self, bus: Bus) {
        let site = &self.binding.site;
        let look = |gateway: &mut clino_gateway::Gateway| (*gateway.counters(bus), gateway.health(bus));
        let (counters, health) = site.gateway(look).unwrap_or_default();
        self.known = Known::Bus(bus, counters, health, site.driver_enable(bus));
    }

    #[inline(never)]
    fn detail(&mut self, item: DetailItem, slot: usize) -> Option<u32> {
        let binding = self.binding;
        if !matches!(self.known, Known::Detail(known, ..) if known == slot) {
            self.ask_detail(slot);
        }
        let Known::Detail(_, Some(reading), Some(detail)) = &self.known else {
            // A slot without details has no counters.
            return (!item.is_optional()).then_some(0);
        };
        let now = binding.now;
        let counters = &detail.counters;
        let short = |count: u32| u32::from(count as u16);
        let extremes = &detail.extremes;
        let alarm = |alarm| {
            let look = |gateway: &mut clino_gateway::Gateway| gateway.alarm(slot, alarm, now);
            binding.site.gateway(look).flatten()
        };
        Some(match item {
            DetailItem::Flags => u32::from(flags(reading, detail, now)),
            DetailItem::Temperature => return reading.temperature().map(|value| value as u16 as u32),
            DetailItem::Sequence => short(reading.sequence),
            DetailItem::Raw => return reading.raw(now).map(|raw| Published::of_sensor(raw).mdeg() as u32),
            DetailItem::Unwrapped => return reading.unwrapped(now).map(|mdeg| mdeg as u32),
            DetailItem::LastError => return detail.last_error.map(|status| status.code().into()),
            DetailItem::Alarms => reading.alarms.bits().into(),
            DetailItem::AlarmAge(of) => return alarm(of).map(|alarm| seconds(alarm.age_ms)),
            DetailItem::AlarmExtreme(of) => return alarm(of)?.extreme.map(i32::cast_unsigned),
            DetailItem::Lowest => return Some(extremes.lowest(now)?.mdeg.cast_unsigned()),
            DetailItem::Highest => return Some(extremes.highest(now)?.mdeg.cast_unsigned()),
            DetailItem::LowestAge => return Some(seconds(extremes.lowest(now)?.age_ms)),
            DetailItem::HighestAge => return Some(seconds(extremes.highest(now)?.age_ms)),
            DetailItem::Kind => reading.source.kind() as u32,
            DetailItem::Address => reading.source.address().into(),
            DetailItem::Requests => counters.requests,
            DetailItem::FirstTry => counters.first_try,
            DetailItem::Retries => short(counters.retries),
            DetailItem::Timeouts => short(counters.no_answer),
            DetailItem::Checksum => counters.checksum.into(),
            DetailItem::Length => counters.length.wrapping_add(counters.foreign).into(),
            DetailItem::Late => counters.late.into(),
            DetailItem::Writes => counters.writes.into(),
            DetailItem::ResponseLast => response(counters.response_last()),
            DetailItem::ResponseMax => response(counters.response_max()),
            DetailItem::Foreign => counters.foreign.into(),
            DetailItem::Skipped => counters.skipped.into(),
            DetailItem::Garbled => counters.garbled.into(),
            DetailItem::Refused => counters.refused.into(),
            DetailItem::NotSent => counters.not_sent.into(),
            DetailItem::ResponseMin => response(counters.response_min()),
            DetailItem::Rate | DetailItem::Turns => {
                let rate = reading.rate(now)?;
                let value = if item == DetailItem::Rate { rate } else { reading.turns() };
                value.cast_unsigned()
            }
        })
    }

    fn slot_setting(&mut self, id: u8, slot: usize, scale: u16) -> u32 {
        if !matches!(self.known, Known::Config(known, _) if known == slot) {
            self.ask_config(slot);
        }
        match &self.known {
            Known::Config(_, config) => setting(&Tabled::new(&slot::SETTINGS, config), id, scale),
            _ => 0,
        }
    }

    fn bus(&mut self, item: BusItem, bus: Bus) -> u32 {
        if !matches!(self.known, Known::Bus(known, ..) if known == bus) {
            self.ask_bus(bus);
        }
        let Known::Bus(_, counters, health, driver) = &self.known else { return 0 };
        match item {
            BusItem::Requests => counters.requests,
            BusItem::Retries => counters.retries,
            BusItem::Writes => counters.writes,
            BusItem::Good => counters.good,
            BusItem::FirstTry => counters.first_try,
            BusItem::NoAnswer => counters.no_answer,
            BusItem::BadAnswer => counters.bad_answer,
            BusItem::Checksum => counters.checksum,
            BusItem::Length => counters.length,
            BusItem::Foreign => counters.foreign,
            BusItem::Late => counters.late,
            BusItem::Forced => counters.forced,
            BusItem::LineBusy => counters.line_busy,
            BusItem::Contention => counters.contention,
            BusItem::Echo => counters.echo,
            BusItem::Junk => counters.discarded,
            BusItem::Framing => counters.framing,
            BusItem::Noise => counters.noise,
            BusItem::Overrun => counters.overrun,
            BusItem::Parity => counters.parity,
            BusItem::ResponseLast => counters.response_last.as_micros(),
            BusItem::ResponseMin => counters.response_min.as_micros(),
            BusItem::ResponseMax => counters.response_max.as_micros(),
            BusItem::ReleaseMax => driver.release_max_ns,
            BusItem::HighMax => driver.high_max_us,
            BusItem::Unasked => counters.unasked,
            BusItem::Breaks => counters.breaks,
            BusItem::Fault => health.fault.map_or(0, |fault| fault as u32),
            BusItem::Faults => health.faults,
            BusItem::InVain => health.in_vain,
        }
    }

    fn command(&mut self, item: CommandItem) -> u32 {
        let binding = self.binding;
        let progress = *self.progress.get_or_insert_with(|| binding.progress());
        match item {
            CommandItem::Command | CommandItem::Target | CommandItem::Value | CommandItem::Key => 0,
            CommandItem::Last => progress.command.map_or(0, |command| command as u32),
            CommandItem::Outcome => progress.outcome as u32,
            CommandItem::Sequence => u32::from(progress.sequence),
            CommandItem::Done => u32::from(progress.done),
            CommandItem::Of => u32::from(progress.of),
            CommandItem::Reason => progress.reason.map_or(0, |reason| reason as u32),
            CommandItem::Silenced => u32::from(progress.silenced),
        }
    }
}

/// An age as its register has it; `None` if that does not fit.
fn age(ms: Option<u64>) -> Option<u32> {
    u32::try_from(ms?).ok().filter(|&ms| ms < LONGEST_AGE_MS)
}

fn flags(reading: &Reading, detail: &Detail, now: Instant) -> u16 {
    let flags = [
        (slot_bits::REPEATED, reading.angle(now).is_some() && !reading.is_fresh()),
        (slot_bits::UNCONFIRMED, detail.awaits_confirmation),
        (slot_bits::CROSS_CHECK, reading.health.has(Health::DISAGREES)),
        (slot_bits::QUARANTINE, detail.is_dead),
        (slot_bits::GRAVITY, reading.health.has(Health::GRAVITY)),
        (slot_bits::NOISY, reading.health.has(Health::NOISY)),
    ];
    flags.into_iter().filter(|&(_, on)| on).fold(0, |all, (bit, _)| all | bit)
}

/// A setting in steps of `scale`.
#[inline(never)]
fn setting(of: &dyn Shown, id: u8, scale: u16) -> u32 {
    of.find(id).map_or(0, |(place, _)| of.scaled(place, scale.into())) as u32
}

#[inline(never)]
fn response(time: Duration) -> u32 {
    (time.as_micros() / RESPONSE_UNIT).min(LONGEST_RESPONSE)
}

/// Whole seconds.
fn seconds(ms: u64) -> u32 {
    (ms / MILLIS_PER_SECOND) as u32
}

//! What the registers of the map say.

use clino_bus::{Counters, DriverEnable, Micros};
use clino_gateway::BusHealth;
use clino_gateway::summary::Summary;

use crate::config::{SlotConfig, echo_code};
use crate::exception::Exception;
use crate::frame::Frame;
use crate::host::{Bus, GatewayView, Host, SLOTS, SlotDetail, SlotReading};
use crate::map::lookup::{self, Number, Register};
use crate::map::{
    BusItem, BusSetting, CommandItem, DetailItem, GatewayItem, Item, MAGIC, PortSetting, ReadingItem,
    SLOT_BASE, SLOT_STRIDE, SlotSetting, TEST_ANGLE, TEST_NUMBER, VERSION,
};
use crate::number;
use crate::settings::Settings;
use crate::status::Status;

mod start;

/// Ages from here on are told as "none".
const LONGEST_AGE_MS: u32 = 0xFFFF;
const MICROS_PER_SECOND: u64 = 1_000_000;
/// Unit of response times of slots, µs.
const RESPONSE_UNIT: u32 = 10;
/// Longer ones are told as this, in that unit.
const LONGEST_RESPONSE: u32 = 0xFFFF;

/// Reads registers for one request. Remembers what was asked of the host for the register before.
pub struct Reader<'a, H> {
    host: &'a H,
    port: Settings,
    gateway: Option<GatewayView>,
    detail: Option<(usize, SlotDetail)>,
    config: Option<(usize, SlotConfig)>,
    counters: Option<(Bus, Counters, BusHealth, DriverEnable)>,
    summary: Option<Summary>,
}

impl<'a, H: Host> Reader<'a, H> {
    pub fn new(host: &'a H, port: Settings) -> Reader<'a, H> {
        Reader { host, port, gateway: None, detail: None, config: None, counters: None, summary: None }
    }

    /// Puts `quantity` registers, beginning with `first`, behind what is in the frame.
    pub fn read(&mut self, first: u16, quantity: u16, frame: &mut Frame) -> Result<(), Exception> {
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
                frame.word(0);
                next = next.wrapping_add(1);
                continue;
            };
            following = number.next();
            let value = self.value(number.item, number.index).unwrap_or(number.form.sentinel());
            let value = if number.form.is_swapped() { value.rotate_left(16) } else { value };
            // The high word, if it is asked for; the low one, if the request does not end before it.
            if number.form.registers() == 2 && number.word == 0 {
                frame.word((value >> 16) as u16);
                next = next.wrapping_add(1);
            }
            if next < end {
                frame.word(value as u16);
                next = next.wrapping_add(1);
            }
        }
        Ok(())
    }

    /// A number of the map, as its bits; `None` if there is none.
    fn value(&mut self, item: Item, index: usize) -> Option<u32> {
        match item {
            Item::Gateway(item) => self.gateway(item, index),
            Item::Reading(item) => reading(&self.host.reading(index), item),
            Item::Detail(item) => self.detail(item, index),
            Item::Bus(item) => Some(self.bus(item, bus(index))),
            Item::Start(item) => start::number(&self.host.start(), item, index),
            Item::SlotSetting(item) => Some(self.slot_setting(item, index)),
            Item::BusSetting(item) => Some(self.bus_setting(item, bus(index))),
            Item::Port(item) => Some(port_setting(&self.port, item)),
            Item::Command(item) => Some(self.command(item)),
        }
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
                let (major, minor, _) = self.view().version;
                u32::from(u16::from_be_bytes([major, minor]))
            }
            GatewayItem::Patch => u32::from(self.view().version.2),
            GatewayItem::Uptime => (self.view().uptime.0 / MICROS_PER_SECOND) as u32,
            GatewayItem::Status => u32::from(self.view().status),
            GatewayItem::Sequence => u32::from(self.view().sequence),
            GatewayItem::Online => bits(self.summary().online),
            GatewayItem::Valid => bits(self.summary().valid),
            GatewayItem::Enabled => u32::from(self.summary().enabled),
            GatewayItem::Good => self.summary().good(),
            GatewayItem::OldestAge => return age(Some(self.summary().oldest)),
        })
    }

    fn view(&mut self) -> GatewayView {
        *self.gateway.get_or_insert_with(|| self.host.gateway())
    }

    #[inline(never)]
    fn summary(&mut self) -> Summary {
        *self.summary.get_or_insert_with(|| self.host.summary())
    }

    fn detail(&mut self, item: DetailItem, slot: usize) -> Option<u32> {
        let detail = match self.detail {
            Some((known, detail)) if known == slot => detail,
            _ => self.detail.insert((slot, self.host.detail(slot))).1,
        };
        let counters = &detail.counters;
        Some(match item {
            DetailItem::Flags => u32::from(detail.flags),
            DetailItem::Temperature => return detail.temperature.map(|value| value as u16 as u32),
            DetailItem::Sequence => u32::from(detail.sequence),
            DetailItem::Raw => return detail.raw.map(|value| value as u32),
            DetailItem::Unwrapped => return detail.unwrapped.map(|value| value as u32),
            DetailItem::LastError => return detail.last_error.map(|status| status as u32),
            DetailItem::Kind => detail.kind as u32,
            DetailItem::Address => u32::from(detail.address),
            DetailItem::Requests => counters.requests,
            DetailItem::FirstTry => counters.first_try,
            DetailItem::Retries => u32::from(counters.retries),
            DetailItem::Timeouts => u32::from(counters.timeouts),
            DetailItem::Checksum => u32::from(counters.checksum),
            DetailItem::Length => u32::from(counters.length),
            DetailItem::Late => u32::from(counters.late),
            DetailItem::Writes => u32::from(counters.writes),
            DetailItem::ResponseLast => response(counters.response_last),
            DetailItem::ResponseMax => response(counters.response_max),
        })
    }

    fn slot_setting(&mut self, item: SlotSetting, slot: usize) -> u32 {
        let config = match self.config {
            Some((known, config)) if known == slot => config,
            _ => self.config.insert((slot, self.host.slot_config(slot))).1,
        };
        slot_setting(&config, item)
    }

    fn bus(&mut self, item: BusItem, bus: Bus) -> u32 {
        let (_, counters, health, driver) = match self.counters {
            Some(known) if known.0 == bus => known,
            _ => {
                let Self { host, .. } = self;
                *self.counters.insert((bus, host.counters(bus), host.health(bus), host.driver_enable(bus)))
            }
        };
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
            BusItem::Junk => counters.junk,
            BusItem::Framing => counters.framing,
            BusItem::Noise => counters.noise,
            BusItem::Overrun => counters.overrun,
            BusItem::Parity => counters.parity,
            BusItem::ResponseLast => micros(counters.response_last),
            BusItem::ResponseMin => micros(counters.response_min),
            BusItem::ResponseMax => micros(counters.response_max),
            BusItem::ReleaseMax => driver.release_max_ns,
            BusItem::HighMax => driver.high_max_us,
            BusItem::Unasked => counters.unasked,
            BusItem::Breaks => counters.breaks,
            BusItem::Fault => health.fault.map_or(0, |fault| fault as u32),
            BusItem::Faults => health.faults,
            BusItem::InVain => health.in_vain,
        }
    }

    fn bus_setting(&self, item: BusSetting, bus: Bus) -> u32 {
        let config = self.host.bus_config(bus);
        match item {
            BusSetting::Baud => config.baud,
            BusSetting::Guard => u32::from(config.guard_us),
            BusSetting::PreDelay => u32::from(config.pre_delay_us),
            BusSetting::PostDelay => u32::from(config.post_delay_us),
            BusSetting::Echo => echo_code(config.echo),
        }
    }

    fn command(&mut self, item: CommandItem) -> u32 {
        let progress = self.view().progress;
        match item {
            CommandItem::Command | CommandItem::Target | CommandItem::Value | CommandItem::Key => 0,
            CommandItem::Last => progress.command.map_or(0, |command| command as u32),
            CommandItem::Outcome => progress.outcome as u32,
            CommandItem::Sequence => u32::from(progress.sequence),
            CommandItem::Done => u32::from(progress.done),
            CommandItem::Of => u32::from(progress.of),
        }
    }
}

/// The bus with this number; the map has two.
pub fn bus(index: usize) -> Bus {
    if index == 0 { Bus::T7 } else { Bus::Isu }
}

fn reading(reading: &SlotReading, item: ReadingItem) -> Option<u32> {
    match item {
        ReadingItem::Status => Some(reading.status as u32),
        ReadingItem::Angle => angle(reading).map(|mdeg| mdeg as u32),
        ReadingItem::Degrees => angle(reading).map(number::degrees),
        ReadingItem::Centidegrees => angle(reading).map(|mdeg| number::centidegrees(mdeg) as u16 as u32),
        ReadingItem::Age => age(reading.age),
    }
}

/// An angle that is not right and fresh is none.
fn angle(reading: &SlotReading) -> Option<i32> {
    reading.angle.filter(|_| reading.status == Status::Ok)
}

/// Milliseconds; `None` if that does not fit.
fn age(age: Option<Micros>) -> Option<u32> {
    let ms = micros(age?) / 1_000;
    (ms < LONGEST_AGE_MS).then_some(ms)
}

fn slot_setting(config: &SlotConfig, item: SlotSetting) -> u32 {
    match item {
        SlotSetting::Enabled => u32::from(config.enabled),
        SlotSetting::Kind => config.kind as u32,
        SlotSetting::Address => u32::from(config.address),
        SlotSetting::Axis => u32::from(config.axis),
        SlotSetting::Period => config.period_ms,
        SlotSetting::Stale => config.stale_ms,
        SlotSetting::Timeout => u32::from(config.timeout_ms),
        SlotSetting::Retries => u32::from(config.retries),
        SlotSetting::Zero => config.zero_mdeg as u32,
        SlotSetting::Reversed => u32::from(config.reversed),
        SlotSetting::Unidirectional => u32::from(config.unidirectional),
        SlotSetting::Filter => config.filter as u32,
        SlotSetting::FilterLength => u32::from(config.filter_length),
        SlotSetting::Confirm => u32::from(config.confirm),
        SlotSetting::Jump => config.jump_mdeg_s,
    }
}

fn port_setting(settings: &Settings, item: PortSetting) -> u32 {
    match item {
        PortSetting::Address => u32::from(settings.address),
        PortSetting::Baud => settings.baud,
        PortSetting::Parity => settings.parity as u32,
        PortSetting::StopBits => settings.stop_bits as u32,
    }
}

fn response(time: Micros) -> u32 {
    (micros(time) / RESPONSE_UNIT).min(LONGEST_RESPONSE)
}

/// 32 bits of microseconds; more is told as the most.
fn micros(time: Micros) -> u32 {
    u32::try_from(time.0).unwrap_or(u32::MAX)
}

//! The gateway core as the server's [`Host`].
//!
//! Values come from the [`Snapshot`], all of one generation. How slots and buses are set, their counters and all changes
//! come from and go to the [`Gateway`] itself, which a [`Site`] lends for one short look at a time. What only a level
//! that may wait can do, the site is asked for ([`Wish`]).

use clino_bus::{Counters, DriverEnable, Micros};
use clino_gateway::order::{self, Order};
use clino_gateway::summary::Summary;
use clino_gateway::{Asker, BusHealth, Consequence, Gateway, Health, Published, Reading, Snapshot, View};
use clino_recovery::Start;

use crate::command::{Command, Outcome, Progress};
use crate::config::{BusConfig, SlotConfig};
use crate::host::{
    Bus, GatewayView, Host, Kind, Refusal, SlotCounters, SlotDetail, SlotReading, Write, slot_bits,
};

use crate::parts::parts;

mod bus;
mod news;
mod sensor;
mod slot;

/// Where the gateway runs.
pub trait Site {
    /// Time since reset.
    fn now(&self) -> Micros;

    /// Lends the gateway; `None` while there is none. The bus level waits meanwhile.
    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R>;

    /// Something was ordered, or fetched: the bus level has to look.
    fn wake(&self);

    /// How a bus's line driver behaved since reset.
    fn driver_enable(&self, bus: clino_gateway::Bus) -> DriverEnable;

    /// Version of the firmware: major, minor, patch.
    fn version(&self) -> (u8, u8, u16);

    /// Why, how often and how the gateway has started.
    fn start(&self) -> Start;

    /// Has this done soon; [`Desk::done`] is told what has come of it.
    ///
    /// # Errors
    /// [`Refusal::Failed`] where it cannot be done, [`Refusal::Busy`] while something else is.
    fn ask(&self, wish: Wish) -> Result<(), Refusal>;

    /// Whether the configuration in force is not the one that the next start has.
    fn is_unsaved(&self) -> bool;

    /// Whether something is stored that was not taken over at this start, and that a save replaces for good.
    fn has_unread(&self) -> bool {
        false
    }
}

/// What takes longer than a Modbus master waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wish {
    /// The configuration in force is to be stored.
    Save,
    /// From the next start on, the configuration is to be as delivered.
    FactoryReset,
}

/// The [`Host`].
pub struct Desk<'a, S> {
    site: S,
    snapshot: &'a Snapshot,
    view: View<'a>,
    now: Micros,
    progress: Progress,
    /// Where the last command is under way as a task.
    task: Option<Bus>,
    /// Nodes that the command in hand silences.
    silenced: u16,
}

impl<'a, S: Site> Desk<'a, S> {
    /// A desk at this site.
    pub fn new(site: S, snapshot: &'a Snapshot) -> Desk<'a, S> {
        let view = snapshot.view();
        Desk {
            site,
            snapshot,
            view,
            now: Micros::ZERO,
            progress: Progress::default(),
            task: None,
            silenced: 0,
        }
    }

    /// Hears what has become of a task. To be called when the bus level has run.
    pub fn poll(&mut self) {
        while let Some(news) = self.site.gateway(|gateway| gateway.news(Asker::Modbus)).flatten() {
            self.site.wake();
            if let Some(outcome) = news::outcome(&news) {
                self.end(outcome);
            }
        }
        // What the console has begun tells its end there.
        if let (Some(Command::Cancel), Some(bus)) = (self.progress.command, self.task)
            && !self.is_at_work(bus)
        {
            self.end(Outcome::Done);
        }
    }

    fn is_at_work(&self, bus: Bus) -> bool {
        self.site.gateway(|gateway| gateway.progress(bus.into()).is_some()).unwrap_or(false)
    }

    /// What the site was asked for is done, or has failed.
    pub fn done(&mut self, well: bool) {
        self.end(if well { Outcome::Done } else { Outcome::Failed });
    }

    fn end(&mut self, outcome: Outcome) {
        self.task = None;
        self.progress.outcome = outcome;
    }

    fn row(&self, slot: usize) -> Option<Reading> {
        self.view.reading(slot)
    }

    fn order(&self, order: Order) -> Result<(), Refusal> {
        let result = self.site.gateway(|gateway| gateway.carry_out(order, Asker::Modbus));
        self.site.wake();
        match result {
            Some(Ok(())) => Ok(()),
            Some(Err(order::Refusal::Busy)) => Err(Refusal::Busy),
            Some(Err(order::Refusal::Restrained(_))) => Err(Refusal::Failed),
            Some(Err(_)) => Err(Refusal::Value),
            None => Err(Refusal::Failed),
        }
    }

    /// How a slot is set, in the gateway's terms.
    fn config(&self, slot: usize) -> clino_gateway::SlotConfig {
        let config = self.site.gateway(|gateway| gateway.config(slot).copied()).flatten();
        config.unwrap_or(clino_gateway::SlotConfig::OFF)
    }

    /// Begins a command; says whether it goes on as a task or a wish.
    fn command(&mut self, command: Command, target: u16, value: i32) -> Result<Outcome, Refusal> {
        let slot = usize::from(target);
        match command {
            Command::Save => self.site.ask(Wish::Save)?,
            Command::FactoryReset => self.site.ask(Wish::FactoryReset)?,
            Command::ClearCounters => {
                self.site.gateway(Gateway::clear_counters);
                return Ok(Outcome::Done);
            }
            Command::SoftZero => {
                self.zero(target)?;
                return Ok(Outcome::Done);
            }
            Command::Cancel => {
                let bus = Bus::from_number(target).ok_or(Refusal::Value)?;
                // What is under way elsewhere would be told no more.
                if self.progress.outcome == Outcome::Running && self.task != Some(bus) {
                    return Err(Refusal::Busy);
                }
                self.order(Order::Cancel(bus.into()))?;
                self.task = Some(bus).filter(|&bus| self.is_at_work(bus));
                if self.task.is_none() {
                    return Ok(Outcome::Done);
                }
            }
            _ => {
                let order = sensor::order(command, self.config(slot).source, value).ok_or(Refusal::Value)?;
                let baud = self.bus_config(Bus::T7).baud;
                let slot_of = |slot: u8| Some(self.config(slot.into()));
                let Consequence { silenced, .. } = Consequence::of(&order, baud, &slot_of);
                self.order(order)?;
                self.silenced = silenced.into();
                self.task = self.config(slot).source.bus().map(Bus::from);
            }
        }
        Ok(Outcome::Running)
    }

    /// The slot says zero as it stands.
    fn zero(&self, target: u16) -> Result<(), Refusal> {
        let number = u8::try_from(target).map_err(|_| Refusal::Value)?;
        let row = self.row(usize::from(target)).ok_or(Refusal::Value)?;
        let soft_zero = row.raw(self.now).ok_or(Refusal::Failed)?;
        let config = self.config(usize::from(target));
        self.order(Order::Slot { slot: number, config: clino_gateway::SlotConfig { soft_zero, ..config } })
    }

    /// Whether a command is under way.
    pub fn has_command(&self) -> bool {
        self.progress.outcome == Outcome::Running
    }
}

impl<S: Site> Host for Desk<'_, S> {
    fn snapshot(&mut self) {
        self.view = self.snapshot.view();
        self.now = self.site.now();
    }

    fn held_still(&self) -> bool {
        self.view.holds()
    }

    fn gateway(&self) -> GatewayView {
        let mut progress = self.progress;
        if let Some(task) = self.task
            && let Some(steps) = self.site.gateway(|gateway| gateway.progress(task.into())).flatten()
        {
            let short = |n: u32| u16::try_from(n).unwrap_or(u16::MAX);
            (progress.done, progress.of) = (short(steps.done.into()), short(steps.of.into()));
        }
        GatewayView {
            version: self.site.version(),
            uptime: self.now,
            status: self.summary().signals.bits(),
            sequence: self.view.generation() as u16,
            progress,
        }
    }

    fn summary(&self) -> Summary {
        let (start, unsaved) = (self.site.start(), self.site.is_unsaved());
        let parts = self.site.gateway(|gateway| parts(gateway, &start, unsaved, self.has_command()));
        Summary::of(|slot| self.view.standing(slot, self.now), &parts.unwrap_or_default())
    }

    fn start(&self) -> Start {
        self.site.start()
    }

    fn reading(&self, slot: usize) -> SlotReading {
        self.view.value(slot, self.now).map_or_else(SlotReading::default, |value| SlotReading {
            status: slot::status(value.status),
            angle: value.angle.map(|angle| angle.mdeg()),
            age: value.age,
        })
    }

    fn detail(&self, slot: usize) -> SlotDetail {
        let known = self.site.gateway(|gateway| gateway.detail(slot)).flatten();
        let (Some(row), Some(known)) = (self.row(slot), known) else { return SlotDetail::default() };
        let (kind, address) = slot::place(row.source);
        if kind == Kind::None {
            return SlotDetail { sequence: row.sequence as u16, ..SlotDetail::default() };
        }
        let flags = [
            (slot_bits::REPEATED, row.angle(self.now).is_some() && !row.is_fresh()),
            (slot_bits::UNCONFIRMED, known.awaits_confirmation),
            (slot_bits::CROSS_CHECK, row.health.has(Health::DISAGREES)),
            (slot_bits::QUARANTINE, known.is_dead),
            (slot_bits::GRAVITY, row.health.has(Health::GRAVITY)),
            (slot_bits::NOISY, row.health.has(Health::NOISY)),
        ];
        let counters = &known.counters;
        SlotDetail {
            flags: flags.into_iter().filter(|&(_, on)| on).fold(0, |all, (bit, _)| all | bit),
            raw: row.raw(self.now).map(|angle| Published::of_sensor(angle).mdeg()),
            unwrapped: row.unwrapped(self.now),
            temperature: row.temperature(),
            sequence: row.sequence as u16,
            last_error: known.last_error.map(slot::status),
            kind,
            address,
            counters: SlotCounters {
                requests: counters.requests,
                first_try: counters.first_try,
                retries: counters.retries as u16,
                timeouts: counters.no_answer as u16,
                checksum: counters.checksum,
                length: counters.length.wrapping_add(counters.foreign),
                late: counters.late,
                writes: counters.writes,
                response_last: counters.response_last(),
                response_max: counters.response_max(),
            },
        }
    }

    fn counters(&self, bus: Bus) -> Counters {
        self.site.gateway(|gateway| *gateway.counters(bus.into())).unwrap_or_default()
    }

    fn health(&self, bus: Bus) -> BusHealth {
        self.site.gateway(|gateway| gateway.health(bus.into())).unwrap_or_default()
    }

    fn driver_enable(&self, bus: Bus) -> DriverEnable {
        self.site.driver_enable(bus.into())
    }

    fn slot_config(&self, slot: usize) -> SlotConfig {
        slot::shown(&self.config(slot))
    }

    fn bus_config(&self, bus: Bus) -> BusConfig {
        let shown = self.site.gateway(|gateway| bus::shown(gateway.bus_settings(bus.into())));
        shown.unwrap_or(BusConfig::NONE)
    }

    fn write(&mut self, write: &Write) -> Result<(), Refusal> {
        match *write {
            Write::Slot { slot, config } => {
                let now = self.config(usize::from(slot));
                let config = slot::changed(&now, &config).ok_or(Refusal::Value)?;
                self.order(Order::Slot { slot, config })
            }
            Write::Bus { bus, change } => self.order(Order::Bus { bus: bus.into(), change }),
            Write::Port(_) => Ok(()),
            Write::Command { command: Command::Save, armed: false, .. } if self.site.has_unread() => {
                Err(Refusal::Value)
            }
            Write::Command { command, target, value, armed: _ } => {
                if self.progress.outcome == Outcome::Running && command != Command::Cancel {
                    return Err(Refusal::Busy);
                }
                self.silenced = 0;
                let outcome = self.command(command, target, value)?;
                let sequence = self.progress.sequence.wrapping_add(1);
                let silenced = self.silenced;
                self.progress =
                    Progress { command: Some(command), outcome, sequence, done: 0, of: 0, silenced };
                Ok(())
            }
        }
    }
}

impl Bus {
    fn from_number(number: u16) -> Option<Bus> {
        [Bus::T7, Bus::Isu].into_iter().find(|&bus| bus as u16 == number)
    }
}

impl From<Bus> for clino_gateway::Bus {
    fn from(bus: Bus) -> clino_gateway::Bus {
        match bus {
            Bus::T7 => clino_gateway::Bus::T7,
            Bus::Isu => clino_gateway::Bus::Isu,
        }
    }
}

impl From<clino_gateway::Bus> for Bus {
    fn from(bus: clino_gateway::Bus) -> Bus {
        match bus {
            clino_gateway::Bus::T7 => Bus::T7,
            clino_gateway::Bus::Isu => Bus::Isu,
        }
    }
}

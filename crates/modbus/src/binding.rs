//! Binds the register map to the gateway: the server's [`Host`].
//!
//! All comes from and goes to the [`Gateway`], which a [`Site`] lends for one short look at a time: no interrupt is held off
//! while 48 slots are read. What was read is of one generation of readings if that has not changed meanwhile
//! ([`Host::held_still`]). Settings are bound by their ids; the gateway's tables describe them. Work that takes long is left
//! to the main loop: the site takes it as a [`DeferredRequest`].

use clino_bus::{DriverEnable, Instant};
use clino_codec::angle::Angle;
use clino_codec::t7::BaudRate;
use clino_commissioning::t7::Rates;
use clino_gateway::features::COMMISSIONING;
use clino_gateway::order::Order;
use clino_gateway::settings::{Given, console, slot};
use clino_gateway::summary::Summary;
use clino_gateway::task::Reason;
use clino_gateway::task::t7::Task;
use clino_gateway::{Bus, BusChange, Detail, Gateway, Reading, Requester, SlotConfig, Source};
use clino_recovery::Start;

use crate::command::{Command, Outcome, Progress};
use crate::exception::Exception;
use crate::host::{Host, Refusal, Write};
use crate::parts::parts;
use crate::settings::Settings;
use crate::values::Values;

mod read;
mod results;
mod sensor;
mod task;

use results::Results;

/// Where the gateway runs.
pub trait Site {
    /// Time since reset.
    fn now(&self) -> Instant;

    /// Lends the gateway; `None` while there is none. The bus level waits meanwhile.
    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R>;

    /// Wakes the bus level: it has an order to carry out, or its report was fetched.
    fn wake(&self);

    /// How a bus's line driver behaved since reset.
    fn driver_enable(&self, bus: Bus) -> DriverEnable;

    /// Version of the firmware: major, minor, patch.
    fn version(&self) -> (u8, u8, u16);

    /// Why, how often and how the gateway has started.
    fn start(&self) -> Start;

    /// Defers a request to the main loop, which reports the result with [`Binding::done`].
    ///
    /// # Errors
    /// [`Refusal::Failed`] where it cannot be done, [`Refusal::Busy`] while another request is deferred.
    fn ask(&self, request: DeferredRequest) -> Result<(), Refusal>;

    /// Whether the configuration in force is not the one that the next start has.
    fn is_unsaved(&self) -> bool;

    /// Whether something is stored that was not taken over at this start, and that a save replaces for good.
    fn has_unread(&self) -> bool {
        false
    }
}

/// A request that takes longer than a Modbus master waits: the main loop carries it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DeferredRequest {
    /// Stores the configuration in force.
    Save,
    /// Discards the stored configuration: from the next start on, the configuration is as delivered.
    FactoryReset,
    /// Restarts the gateway when the answer is out.
    Reboot,
}

/// The [`Host`].
pub struct Binding<S> {
    site: S,
    /// The generation of readings that the request is answered from.
    generation: u32,
    now: Instant,
    progress: Progress,
    /// Where the last command is under way as a task.
    task: Option<Bus>,
    /// Nodes that the command in hand silences.
    silenced: u16,
    results: Results,
}

impl<S: Site> Binding<S> {
    /// A binding of the gateway at this site.
    pub fn new(site: S) -> Binding<S> {
        Binding {
            site,
            generation: 0,
            now: Instant::ZERO,
            progress: Progress::default(),
            task: None,
            silenced: 0,
            results: Results::default(),
        }
    }

    /// Takes the reports of tasks. Call it when the bus level has run. A function of its own: its stack is not below the requests.
    #[inline(never)]
    pub fn poll(&mut self) {
        while let Some(news) = self.site.gateway(|gateway| gateway.task_event(Requester::Modbus)).flatten() {
            self.site.wake();
            self.results.take(&news);
            if let Some((outcome, reason)) = task::outcome(&news) {
                self.end(outcome, reason);
            }
        }
        // A task that the console has begun reports its end to the console.
        if let (Some(Command::Cancel), Some(bus)) = (self.progress.command, self.task)
            && !self.is_at_work(bus)
        {
            self.end(Outcome::Done, None);
        }
    }

    fn is_at_work(&self, bus: Bus) -> bool {
        self.site.gateway(|gateway| gateway.progress(bus).is_some()).unwrap_or(false)
    }

    /// The deferred request is done, or has failed.
    pub fn done(&mut self, well: bool) {
        if well {
            self.end(Outcome::Done, None);
        } else {
            self.end(
                Outcome::Failed,
                Some(Reason::NotStored).filter(|_| self.progress.command != Some(Command::Reboot)),
            );
        }
    }

    fn end(&mut self, outcome: Outcome, reason: Option<Reason>) {
        self.task = None;
        (self.progress.outcome, self.progress.reason) = (outcome, reason);
    }

    fn current_generation(&self) -> u32 {
        self.site.gateway(|gateway| gateway.generation()).unwrap_or_default()
    }

    /// What the sensor of a slot says. A function of its own: its stack is not below the orders.
    #[inline(never)]
    fn raw(&self, slot: usize) -> Result<Angle, Refusal> {
        let look = |gateway: &mut Gateway| Some(gateway.reading(slot)?.raw(self.now));
        self.site.gateway(look).flatten().ok_or(Refusal::Value)?.ok_or(Refusal::Failed)
    }

    /// Asks the gateway for a change.
    fn ask(
        &self,
        ask: impl FnOnce(&mut Gateway) -> Result<(), clino_gateway::order::Refusal>,
    ) -> Result<(), Refusal> {
        let result = self.site.gateway(ask);
        self.site.wake();
        result.ok_or(Refusal::Failed)?.map_err(Refusal::from)
    }

    fn order(&self, order: Order) -> Result<(), Refusal> {
        self.ask(|gateway| gateway.carry_out(order, Requester::Modbus))
    }

    /// How a slot is set.
    #[inline(never)]
    fn put_config(&self, slot: usize, place: &mut SlotConfig) {
        *place = SlotConfig::OFF;
        self.site.gateway(|gateway| {
            if let Some(config) = gateway.config(slot) {
                *place = *config;
            }
        });
    }

    /// The reading of a slot and its details, if it is in use.
    #[inline(never)]
    fn put_slot(&self, slot: usize, reading: &mut Option<Reading>, detail: &mut Option<Detail>) {
        self.site.gateway(|gateway| {
            *reading = gateway.reading(slot).filter(|reading| reading.source != Source::Off);
            *detail = gateway.detail(slot);
        });
    }

    /// A function of its own: its stack is not below that of the other writes, nor theirs below its.
    #[inline(never)]
    fn change_console(&self, values: &Values<'_>) -> Result<(), Refusal> {
        self.ask(|gateway| {
            let settings = console::changed(&gateway.console_settings(), &|id| values.of(id))?;
            gateway.carry_out(Order::Console(settings), Requester::Modbus)
        })
    }

    /// Begins a command; the outcome is *running* if it goes on as a task or a deferred request.
    fn command(&mut self, command: Command, target: u16, value: i32) -> Result<Outcome, Refusal> {
        let slot = usize::from(target);
        match command {
            Command::Save => self.site.ask(DeferredRequest::Save)?,
            Command::FactoryReset => self.site.ask(DeferredRequest::FactoryReset)?,
            // A sensor whose memory is being written must not be left half way.
            Command::Reboot if Bus::ALL.into_iter().any(|bus| self.is_at_work(bus)) => {
                return Err(Refusal::Busy);
            }
            Command::Reboot => self.site.ask(DeferredRequest::Reboot)?,
            Command::ClearCounters => {
                self.order(Order::ClearCounters)?;
                return Ok(Outcome::Done);
            }
            Command::SoftZero => {
                self.zero(target)?;
                return Ok(Outcome::Done);
            }
            Command::Acknowledge => {
                self.order(Order::Acknowledge(which(target, value)?))?;
                return Ok(Outcome::Done);
            }
            Command::ClearExtremes => {
                self.order(Order::ClearExtremes(which(target, value)?))?;
                return Ok(Outcome::Done);
            }
            Command::Cancel if COMMISSIONING => {
                let bus = Bus::from_number(target).ok_or(Refusal::Value)?;
                // The result of a task on another bus would be lost.
                if self.progress.outcome == Outcome::Running && self.task != Some(bus) {
                    return Err(Refusal::Busy);
                }
                self.order(Order::Cancel(bus))?;
                self.task = Some(bus).filter(|&bus| self.is_at_work(bus));
                if self.task.is_none() {
                    return Ok(Outcome::Done);
                }
            }
            Command::Scan if COMMISSIONING => {
                self.order(Order::T7(Task::Sweep(self.rates(target, value).ok_or(Refusal::Value)?)))?;
                self.task = Some(Bus::T7);
            }
            // What remains is about a sensor.
            _ if COMMISSIONING => {
                let look = |gateway: &mut Gateway| gateway.config(slot).map(|config| config.source);
                let source = self.site.gateway(look).flatten().unwrap_or(Source::Off);
                let order = sensor::order(command, source, value).ok_or(Refusal::Value)?;
                let consequence = self.site.gateway(|gateway| gateway.consequence(&order));
                self.order(order)?;
                self.silenced = consequence.map_or(0, |of| of.silenced.into());
                self.task = source.bus();
            }
            _ => return Err(Refusal::Value),
        }
        Ok(Outcome::Running)
    }

    /// At which bit rates a bus is to be scanned: its own, or every one.
    fn rates(&self, bus: u16, which: i32) -> Option<Rates> {
        Bus::from_number(bus).filter(|&bus| bus == Bus::T7)?;
        match which {
            0 => {
                let baud = self.site.gateway(|gateway| gateway.bus_settings(Bus::T7).timing.serial.baud)?;
                BaudRate::from_bits_per_second(baud).map(|rate| Rates::NONE.and(rate))
            }
            1 => Some(Rates::ALL),
            _ => None,
        }
    }

    /// Sets the soft zero so that the slot reads zero in its present position.
    fn zero(&self, target: u16) -> Result<(), Refusal> {
        let number = u8::try_from(target).map_err(|_| Refusal::Value)?;
        let zero = Given::exactly(self.raw(target.into())?.udeg().into());
        let named = |id: u8| (id == slot::id::ZERO).then_some(zero);
        self.ask(|gateway| gateway.change(number, &named, Requester::Modbus))
    }

    /// Outcome and progress of the last command.
    fn progress(&self) -> Progress {
        let mut progress = self.progress;
        if let Some(task) = self.task
            && let Some(steps) = self.site.gateway(|gateway| gateway.progress(task)).flatten()
        {
            let short = |n: u32| u16::try_from(n).unwrap_or(u16::MAX);
            (progress.done, progress.of) = (short(steps.done.into()), short(steps.of.into()));
        }
        progress
    }

    /// Whether a command is under way.
    pub fn has_command(&self) -> bool {
        self.progress.outcome == Outcome::Running
    }

    /// Its slots and faults, summed up.
    fn summary(&self) -> Summary {
        let (start, unsaved) = (self.site.start(), self.site.is_unsaved());
        let parts = self.site.gateway(|gateway| parts(gateway, &start, unsaved, self.has_command()));
        let standing = |slot| self.site.gateway(|gateway| gateway.standing(slot, self.now)).flatten();
        Summary::of(standing, &parts.unwrap_or_default())
    }
}

/// The slot of a command; `None` is all slots.
fn which(target: u16, value: i32) -> Result<Option<u8>, Refusal> {
    match value {
        0 => u8::try_from(target).map(Some).map_err(|_| Refusal::Value),
        1 => Ok(None),
        _ => Err(Refusal::Value),
    }
}

impl<S: Site> Host for Binding<S> {
    fn begin(&mut self) {
        self.generation = self.current_generation();
        self.now = self.site.now();
    }

    fn held_still(&self) -> bool {
        self.current_generation() == self.generation
    }

    fn status(&self) -> u16 {
        self.summary().signals.bits()
    }

    fn read(
        &self,
        port: &Settings,
        first: u16,
        quantity: u16,
        take: &mut dyn FnMut(u16),
    ) -> Result<(), Exception> {
        read::Reader::new(self, port).read(first, quantity, take)
    }

    /// A function of its own: the stack of what found out what to write is free again.
    #[inline(never)]
    fn write(&mut self, write: &Write<'_>) -> Result<(), Refusal> {
        match write {
            Write::Slot(slot, values) => {
                self.ask(|gateway| gateway.change(*slot, &|id| values.of(id), Requester::Modbus))
            }
            Write::Bus(bus, values) => {
                let change = BusChange::named(*bus, &|id| values.of(id))?;
                self.order(Order::Bus { bus: *bus, change })
            }
            Write::Console(values) => self.change_console(values),
            Write::Port(_) => Ok(()),
            Write::Command { command: Command::Save, armed: false, .. } if self.site.has_unread() => {
                Err(Refusal::Value)
            }
            Write::Command { command, target, value, armed: _ } => {
                let command = *command;
                if self.progress.outcome == Outcome::Running && command != Command::Cancel {
                    return Err(Refusal::Busy);
                }
                self.silenced = 0;
                let outcome = self.command(command, *target, *value)?;
                let sequence = self.progress.sequence.wrapping_add(1);
                self.progress = Progress {
                    command: Some(command),
                    outcome,
                    sequence,
                    silenced: self.silenced,
                    ..Progress::default()
                };
                self.results.begin(command, sequence);
                Ok(())
            }
        }
    }
}

//! The gateway as the console sees it.

use clino_bus::Micros;
use clino_console::{BusState, Host, Received, Saved, StorageError};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::summary::Summary;
use clino_gateway::task::News;
use clino_gateway::trace::Entry;
use clino_gateway::{Asker, Bus, Detail, Glance, Reading, SlotConfig};
use clino_modbus::binding::Wish;
use clino_modbus::{Counters, Settings};
use clino_recovery::Start;
use cortex_m::peripheral::SCB;
use heapless::spsc::Consumer;

use crate::keeper::{self, Keeper};
use crate::{bus, clock, console, modbus, shared, start};

/// The gateway: all of it is shared, but for who stores its configuration, and what is typed.
pub struct Gateway {
    pub keeper: &'static mut Keeper,
    /// What is typed.
    pub keys: Consumer<'static, Received>,
}

impl Gateway {
    /// Does what the Modbus level cannot wait for; says whether it was done.
    pub fn fulfil(&mut self, wish: Wish) -> bool {
        match wish {
            Wish::Save => self.keeper.save().is_ok(),
            Wish::FactoryReset => self.keeper.factory_reset().is_ok(),
            // The answer to the master comes first.
            Wish::Reboot if keeper::await_silence() => SCB::sys_reset(),
            Wish::Reboot => false,
        }
    }
}

/// What is found in the gateway. In one place, not in an option in an option, which would be copied twice.
fn look<R>(find: impl FnOnce(&mut clino_gateway::Gateway) -> Option<R>) -> Option<R> {
    let mut found = None;
    bus::with(|gateway| found = find(gateway));
    found
}

impl Host for Gateway {
    fn now(&self) -> Micros {
        clock::now()
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        shared::reading(slot)
    }

    fn glance(&self, slot: usize, now: Micros) -> Option<Glance> {
        shared::SNAPSHOT.read(|view| view.glance(slot, now))
    }

    fn summary(&self) -> Summary {
        let (start, unsaved, command) = (start::start(), keeper::is_unsaved(), modbus::has_command());
        let parts = bus::with(|gateway| clino_modbus::parts(gateway, &start, unsaved, command));
        let (parts, now) = (parts.unwrap_or_default(), clock::now());
        shared::SNAPSHOT.read(|view| Summary::of(|slot| view.standing(slot, now), &parts))
    }

    fn config(&self, slot: usize) -> Option<SlotConfig> {
        look(|gateway| gateway.config(slot).copied())
    }

    fn detail(&self, slot: usize) -> Option<Detail> {
        look(|gateway| gateway.detail(slot))
    }

    fn trace(&self, age: usize) -> Option<Entry> {
        look(|gateway| gateway.trace().iter().nth(age).copied())
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        bus::state(bus)
    }

    fn news(&mut self) -> Option<News> {
        let news = look(|gateway| gateway.news(Asker::Console));
        if news.is_some() {
            // The task has waited for this.
            bus::wake();
        }
        news
    }

    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal> {
        let result = bus::with(|gateway| gateway.change(slot, named, Asker::Console));
        bus::wake();
        result.unwrap_or(Err(Refusal::Busy))
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        let result = bus::with(|gateway| gateway.carry_out(order, Asker::Console));
        bus::wake();
        result.unwrap_or(Err(Refusal::Busy))
    }

    fn flush(&mut self) {
        console::drain();
    }

    fn received(&mut self) -> Option<Received> {
        self.keys.dequeue()
    }

    fn lost_characters(&self) -> u32 {
        console::lost()
    }

    fn version(&self) -> &'static str {
        env!("CARGO_PKG_VERSION")
    }

    fn start(&self) -> Start {
        start::start()
    }

    fn has_unread(&self) -> bool {
        keeper::has_unread()
    }

    fn save(&mut self) -> Result<Saved, StorageError> {
        self.keeper.save()
    }

    fn factory_reset(&mut self) -> Result<(), StorageError> {
        self.keeper.factory_reset()
    }

    fn reboot(&mut self) {
        console::drain();
        SCB::sys_reset()
    }

    fn console(&self) -> ConsoleSettings {
        bus::with(|gateway| gateway.console_settings()).unwrap_or(ConsoleSettings::DEFAULT)
    }

    fn modbus(&self) -> Option<Settings> {
        Some(modbus::settings())
    }

    fn modbus_counters(&self) -> Option<Counters> {
        modbus::counters()
    }

    fn set_modbus(&mut self, settings: Settings) {
        modbus::set(settings);
    }
}

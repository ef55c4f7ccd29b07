//! The main loop with the console; and the gateway as the console sees it.

use core::cell::RefCell;
use core::convert::Infallible;

use clino_bus::Instant;
use clino_console::{BusState, BusWork, Host, Port, Received, Saved, Shell, StorageError};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::summary::Summary;
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::Entry;
use clino_gateway::{
    Alarm, AlarmDetail, Bus, BusSettings, Consequence, Detail, Reading, ReadingBrief, Requester, SlotConfig,
};
use clino_modbus::{Counters, Settings};
use clino_recovery::{MonitoredTask, Start};
use embedded_io::{ErrorType, Write};
use heapless::spsc::Consumer;
use rtic::Mutex;

use crate::app::idle::{LocalResources, SharedResources};
use crate::config_store::ConfigStore;
use crate::main_loop::{self, Common};
use crate::{bus, clock, params, quiet, shared, watchdog};

/// Runs for ever. The console is on its stack for good: 1.1 KB.
pub fn serve(local: LocalResources<'_>, shared: SharedResources<'_>) -> ! {
    let LocalResources { start, keys, writer, store, .. } = local;
    let common = Common { shared: RefCell::new(shared), writer: RefCell::new(writer) };
    let console = Console(&common);
    let mut host = Gateway { start, store, keys, common: &common };
    let mut out = Port::new(console);
    let mut shell = Shell::new(&mut out);
    loop {
        main_loop::end_safe_mode(host.start);
        if let Some(key) = host.keys.dequeue() {
            shell.input(key, &mut host);
            continue;
        }
        let has_worked =
            main_loop::carry_out_deferred(&common, host.store) || console.has_room() && shell.poll(&mut host);
        if !has_worked {
            shared::sleep_until_work();
        }
    }
}

/// The writing end of the console.
#[derive(Clone, Copy)]
struct Console<'a>(&'a Common<'a>);

impl Console<'_> {
    /// Whether the next line may be printed: little is waiting, so it will be out soon.
    fn has_room(self) -> bool {
        self.0.writer.try_borrow().is_ok_and(|writer| writer.len() < params::CONSOLE_LOW_WATER)
    }
}

impl ErrorType for Console<'_> {
    type Error = Infallible;
}

impl Write for Console<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        loop {
            let taken = self.0.writer.try_borrow_mut().map_or(0, |mut writer| {
                bytes.iter().take_while(|&&byte| writer.enqueue(byte).is_ok()).count()
            });
            self.0.with(|shared| shared.console.lock(|port| port.go_on()));
            if taken > 0 || bytes.is_empty() {
                // A long answer is no hang for as long as its characters go out.
                watchdog::check_in(MonitoredTask::Console);
                return Ok(taken);
            }
            // The next character that goes out ends the sleep.
            cortex_m::asm::wfi();
        }
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The gateway: all of it is shared but the configuration store and the received characters.
pub struct Gateway<'a> {
    start: &'static Start,
    store: &'a mut ConfigStore,
    /// Characters received by the console.
    keys: &'a mut Consumer<'static, Received>,
    common: &'a Common<'a>,
}

impl Gateway<'_> {
    /// A value of the gateway. One option: an option in an option would be copied twice.
    fn look<R>(&self, find: impl FnOnce(&mut clino_gateway::Gateway) -> Option<R>) -> Option<R> {
        let mut found = None;
        self.common.gateway(|gateway| found = find(gateway));
        found
    }
}

impl Host for Gateway<'_> {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        self.look(|gateway| gateway.reading(slot))
    }

    fn brief(&self, slot: usize, now: Instant) -> Option<ReadingBrief> {
        self.look(|gateway| gateway.brief(slot, now))
    }

    fn summary(&self) -> Summary {
        let (unsaved, command) = (self.common.is_unsaved(), self.common.has_command());
        let parts = self.common.gateway(|gateway| clino_modbus::parts(gateway, self.start, unsaved, command));
        let (parts, now) = (parts.unwrap_or_default(), clock::now());
        Summary::of(|slot| self.look(|gateway| gateway.standing(slot, now)), &parts)
    }

    fn config(&self, slot: usize) -> Option<SlotConfig> {
        self.look(|gateway| gateway.config(slot).copied())
    }

    fn detail(&self, slot: usize) -> Option<Detail> {
        self.look(|gateway| gateway.detail(slot))
    }

    fn alarm(&self, slot: usize, alarm: Alarm) -> Option<AlarmDetail> {
        let now = clock::now();
        self.look(|gateway| gateway.alarm(slot, alarm, now))
    }

    fn trace(&self, age: usize) -> Option<Entry> {
        self.look(|gateway| gateway.trace().iter().nth(age).copied())
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        let driver = self.common.driver_enable(bus);
        self.common.gateway(|gateway| bus::state(gateway, bus, driver))
    }

    fn bus_settings(&self, bus: Bus) -> Option<BusSettings> {
        self.look(|gateway| Some(*gateway.bus_settings(bus)))
    }

    fn bus_work(&self, bus: Bus) -> Option<BusWork> {
        self.look(|gateway| {
            Some(BusWork { in_force: gateway.is_in_force(bus), progress: gateway.progress(bus) })
        })
    }

    fn consequence(&self, order: &Order) -> Consequence {
        self.common.gateway(|gateway| gateway.consequence(order)).unwrap_or_default()
    }

    fn task_event(&mut self) -> Option<TaskEvent> {
        let news = self.look(|gateway| gateway.task_event(Requester::Console));
        if news.is_some() {
            // The task has waited for this.
            shared::wake_bus();
        }
        news
    }

    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal> {
        let result = self.common.gateway(|gateway| gateway.change(slot, named, Requester::Console));
        shared::wake_bus();
        result.unwrap_or(Err(Refusal::Busy))
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        let result = self.common.gateway(|gateway| gateway.carry_out(order, Requester::Console));
        shared::wake_bus();
        result.unwrap_or(Err(Refusal::Busy))
    }

    fn flush(&mut self) {
        self.common.drain();
    }

    fn received(&mut self) -> Option<Received> {
        self.keys.dequeue()
    }

    fn lost_characters(&self) -> u32 {
        self.common.with(|shared| shared.console.lock(|port| port.lost())).unwrap_or(0)
    }

    fn version(&self) -> &'static str {
        env!("CARGO_PKG_VERSION")
    }

    fn start(&self) -> Start {
        *self.start
    }

    fn has_unread(&self) -> bool {
        self.common.kept().unread
    }

    fn save(&mut self) -> Result<Saved, StorageError> {
        self.store.save(&mut { self.common })
    }

    fn factory_reset(&mut self) -> Result<(), StorageError> {
        self.store.factory_reset(&mut { self.common })
    }

    fn reboot(&mut self) {
        self.common.drain();
        quiet::restart(&mut { self.common })
    }

    fn console(&self) -> ConsoleSettings {
        self.common.gateway(|gateway| gateway.console_settings()).unwrap_or(ConsoleSettings::DEFAULT)
    }

    fn modbus(&self) -> Option<Settings> {
        cfg!(feature = "modbus").then(|| self.common.settings())
    }

    fn modbus_counters(&self) -> Option<Counters> {
        let counters = self.common.with(|shared| shared.port_counters.lock(|it| *it));
        counters.filter(|_| cfg!(feature = "modbus"))
    }

    fn set_modbus(&mut self, settings: Settings) {
        self.common.with(|shared| shared.new_settings.lock(|place| *place = Some(settings)));
        shared::wake_modbus();
    }
}

//! A console on a desk: a gateway core behind it, a string in front of it.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::rc::Rc;

use clino_bus::{Instant, Serial, Timing};
use clino_codec::{isu, pwm, t7};
use clino_console::{BusState, BusWork, Host, Received, Saved, Shell, StorageError};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::summary::{Standing, Summary};
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::Entry;
use clino_gateway::{Bus, Consequence, Detail, Gateway, Reading, Requester, Settings, SlotConfig, Source};
use clino_recovery::{Start, StartCause, Uid};
use embedded_io::{ErrorType, Write};

/// What the far end reads.
#[derive(Clone, Default)]
pub struct Port(Rc<RefCell<Vec<u8>>>);

impl Port {
    /// What has come since the last look.
    pub fn take(&self) -> String {
        String::from_utf8(std::mem::take(&mut *self.0.borrow_mut())).expect("text")
    }
}

impl ErrorType for Port {
    type Error = Infallible;
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The rest of the gateway.
pub struct Rest {
    pub gateway: Gateway,
    pub readings: BTreeMap<usize, Reading>,
    pub orders: Vec<Order>,
    pub now: Instant,
    /// Characters that the port has received and the console has not fetched.
    pub waiting: VecDeque<Received>,
    pub modbus: Option<clino_modbus::Settings>,
    /// What was stored, forgotten or started again, in that order.
    pub done: Vec<&'static str>,
    pub broken_storage: bool,
    /// Something is stored that was not read at this start.
    pub unread: bool,
    /// The settings in force are not saved.
    pub unsaved: bool,
    pub start: Start,
}

impl Host for Rest {
    fn now(&self) -> Instant {
        self.now
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        self.readings.get(&slot).copied()
    }

    fn summary(&self) -> Summary {
        let parts = clino_modbus::parts(&self.gateway, &self.start, self.unsaved, false);
        let standing = |reading: &Reading| Standing {
            source: reading.source,
            status: reading.status(self.now),
            health: reading.health,
            alarms: reading.alarms,
            age_ms: reading.age_ms(self.now),
        };
        Summary::of(|slot| self.readings.get(&slot).map(standing), &parts)
    }

    fn config(&self, slot: usize) -> Option<SlotConfig> {
        self.gateway.config(slot).copied()
    }

    fn detail(&self, slot: usize) -> Option<Detail> {
        self.gateway.detail(slot)
    }

    fn alarm(&self, slot: usize, alarm: clino_gateway::Alarm) -> Option<clino_gateway::AlarmDetail> {
        self.gateway.alarm(slot, alarm, self.now)
    }

    fn trace(&self, age: usize) -> Option<Entry> {
        self.gateway.trace().iter().nth(age).copied()
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        let driver = Default::default();
        Some(BusState {
            settings: *self.gateway.bus_settings(bus),
            counters: *self.gateway.counters(bus),
            health: self.gateway.health(bus),
            driver,
        })
    }

    fn bus_work(&self, bus: Bus) -> Option<BusWork> {
        let gateway = &self.gateway;
        Some(BusWork { in_force: gateway.is_in_force(bus), progress: gateway.progress(bus) })
    }

    fn consequence(&self, order: &Order) -> Consequence {
        self.gateway.consequence(order)
    }

    fn task_event(&mut self) -> Option<TaskEvent> {
        self.gateway.task_event(Requester::Console)
    }

    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal> {
        let now = self.gateway.config(slot.into()).expect("a slot");
        let config = clino_gateway::settings::slot::changed(now, named)?;
        self.order(Order::Slot { slot, config })
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        order.check()?;
        self.orders.push(order);
        self.gateway.carry_out(order, Requester::Console)?;
        for bus in [Bus::T7, Bus::Isu] {
            self.gateway.poll(bus, self.now, |_| {});
        }
        self.publish();
        Ok(())
    }

    fn flush(&mut self) {}

    fn received(&mut self) -> Option<Received> {
        self.waiting.pop_front()
    }

    fn lost_characters(&self) -> u32 {
        7
    }

    fn version(&self) -> &'static str {
        "9.8.7"
    }

    fn start(&self) -> Start {
        self.start
    }

    fn has_unread(&self) -> bool {
        self.unread
    }

    fn save(&mut self) -> Result<Saved, StorageError> {
        if self.broken_storage {
            return Err(StorageError::Failed);
        }
        self.done.push("save");
        Ok(Saved::Written)
    }

    fn factory_reset(&mut self) -> Result<(), StorageError> {
        if self.broken_storage {
            return Err(StorageError::Failed);
        }
        self.done.push("factory reset");
        Ok(())
    }

    fn reboot(&mut self) {
        self.done.push("reboot");
    }

    fn console(&self) -> ConsoleSettings {
        self.gateway.console_settings()
    }

    fn modbus(&self) -> Option<clino_modbus::Settings> {
        self.modbus
    }

    fn modbus_counters(&self) -> Option<clino_modbus::Counters> {
        Some(clino_modbus::Counters { messages: 12, requests: 9, ..Default::default() })
    }

    fn set_modbus(&mut self, settings: clino_modbus::Settings) {
        self.modbus = Some(settings);
    }
}

impl Rest {
    /// Takes over what has changed.
    pub fn publish(&mut self) {
        while let Some(reading) = self.gateway.next_changed() {
            self.readings.insert(usize::from(reading.slot), reading);
        }
    }
}

/// A prompt is left alone after so long.
pub const IDLE_S: u32 = 60;

/// A console after power-up, streaming.
pub struct Desk {
    shell: Shell<'static>,
    port: Port,
    pub rest: Rest,
}

impl Desk {
    pub fn new() -> Desk {
        Desk::left_alone_after(IDLE_S)
    }

    /// The same, with another idle time, in seconds.
    pub fn left_alone_after(idle_s: u32) -> Desk {
        let table = [
            SlotConfig::usual(Source::T7 { address: t7::Address::new(5).unwrap(), axis: t7::Axis::Two }),
            SlotConfig::usual(Source::Isu { address: isu::Address::new(3).unwrap() }),
        ];
        let (t7, isu) = (Timing::t7(Serial::T7_DEFAULT), Timing::isu());
        let console = ConsoleSettings { idle_s };
        let settings = Settings { console, ..Settings::new(&table, t7, isu) };
        let gateway = Gateway::new(&settings, pwm::Limits::new(84_000_000));
        let mut rest = Rest {
            gateway,
            readings: BTreeMap::new(),
            orders: Vec::new(),
            now: Instant::ZERO,
            waiting: VecDeque::new(),
            modbus: Some(clino_modbus::Settings::DEFAULT),
            done: Vec::new(),
            broken_storage: false,
            unread: false,
            unsaved: false,
            start: Start { cause: StartCause::PowerOn, boots: 1, uid: Uid([0, 1, 2]), ..Start::default() },
        };
        rest.publish();
        let port = Port::default();
        Desk { shell: Shell::new(Box::leak(Box::new(clino_console::Port::new(port.clone())))), port, rest }
    }

    /// A console with a person at it.
    pub fn with_person() -> Desk {
        let mut desk = Desk::new();
        desk.type_in("\r");
        desk
    }

    /// Types this and returns what is printed meanwhile.
    pub fn type_in(&mut self, text: &str) -> String {
        self.type_bytes(text.as_bytes())
    }

    /// Types these bytes and returns what is printed meanwhile.
    pub fn type_bytes(&mut self, bytes: &[u8]) -> String {
        bytes.iter().for_each(|&byte| self.receive(Received::clean(byte)));
        self.printed()
    }

    /// The port hands on a character; then what is waiting by then.
    pub fn receive(&mut self, received: Received) {
        self.rest.waiting.push_back(received);
        self.fetch();
    }

    /// The console takes what is waiting.
    pub fn fetch(&mut self) {
        while let Some(received) = self.rest.waiting.pop_front() {
            self.shell.input(received, &mut self.rest);
        }
    }

    /// Pastes this: it is all there before the first character is taken. Returns what is printed meanwhile.
    pub fn paste(&mut self, text: &str) -> String {
        self.rest.waiting.extend(text.bytes().map(Received::clean));
        self.fetch();
        self.printed()
    }

    /// Time passes; what is printed meanwhile.
    pub fn wait_ms(&mut self, ms: u64) -> String {
        self.rest.now = Instant::from_micros(self.rest.now.as_micros() + 1_000 * ms);
        self.stream()
    }

    /// What a stream prints now.
    pub fn stream(&mut self) -> String {
        while self.shell.poll(&mut self.rest) {}
        self.printed()
    }

    /// What is printed next, if anything.
    pub fn step(&mut self) -> String {
        self.shell.poll(&mut self.rest);
        self.printed()
    }

    /// What was printed since the last look.
    pub fn printed(&mut self) -> String {
        self.port.take()
    }
}

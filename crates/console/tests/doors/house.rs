//! A real gateway with simulated sensors on both buses, a console and a Modbus server, in virtual time.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;
use std::sync::{Arc, Mutex};

use clino_bus::{DriverEnable, Duration, Instant, Serial, Timing, earliest};
use clino_codec::character::Character;
use clino_codec::pwm::{Limits, Ticks};
use clino_codec::{isu, t7};
use clino_console::{BusState, BusWork, Host, Received, Saved, Shell, StorageError};
use clino_gateway::config::{AlarmConfig, AlarmLimits, Ask};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::summary::Summary;
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::Entry;
use clino_gateway::{
    Action, Alarm, AlarmDetail, Bus, Capture, Consequence, DegradedMode, Detail, Gateway, PwmInput, Reading,
    Requester, Settings, SlotConfig, Source,
};
use clino_modbus::binding::{Binding, DeferredRequest, Site};
use clino_modbus::{Counters, Identification, Server};
use clino_recovery::{Start, StartCause, Uid};
use clino_segment::chance::Chance;
use clino_segment::{Noise, SegmentSettings as Line};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu, Options as IsuOptions};
use clino_sim::motion::Motion;
use clino_sim::t7::{Identity, Options, StoredSettings as Memory, T7};
use clino_testkit::rig::{Port, sensor};
use embedded_io::{ErrorType, Write};

const MS: u64 = 1_000;
/// Timer ticks in a second; the period of a PWM output.
const CLOCK: u32 = 84_000_000;
const PERIOD: u64 = 33_333;
/// No command takes longer.
const LONGEST: u64 = 120_000 * MS;

const IDENTIFICATION: &Identification =
    &Identification(["Vendor", "P", "1.2.3", "https://a.example", "G", "M"]);

/// What the console prints.
#[derive(Clone, Default)]
struct Text(Rc<RefCell<Vec<u8>>>);

impl ErrorType for Text {
    type Error = Infallible;
}

impl Write for Text {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// What is between the doors and the buses.
struct Inside {
    gateway: RefCell<Gateway>,
    now: Cell<Instant>,
    start: Cell<Start>,
    /// What a level that may wait is to do.
    deferred: RefCell<Vec<DeferredRequest>>,
    /// What it has done.
    done: RefCell<Vec<&'static str>>,
    port: Cell<clino_modbus::Settings>,
    counters: Cell<Counters>,
}

#[derive(Clone)]
struct Doors(Rc<Inside>);

impl Site for Doors {
    fn now(&self) -> Instant {
        self.0.now.get()
    }

    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
        Some(look(&mut self.0.gateway.borrow_mut()))
    }

    fn wake(&self) {}

    fn driver_enable(&self, _: Bus) -> DriverEnable {
        DriverEnable { release_max_ns: 1_700, high_max_us: 300 }
    }

    fn version(&self) -> (u8, u8, u16) {
        (9, 8, 7)
    }

    fn start(&self) -> Start {
        self.0.start.get()
    }

    fn ask(&self, request: DeferredRequest) -> Result<(), clino_modbus::Refusal> {
        self.0.deferred.borrow_mut().push(request);
        Ok(())
    }

    fn is_unsaved(&self) -> bool {
        false
    }
}

impl Host for Doors {
    fn now(&self) -> Instant {
        self.0.now.get()
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        self.0.gateway.borrow_mut().reading(slot)
    }

    fn summary(&self) -> Summary {
        let parts = clino_modbus::parts(&self.0.gateway.borrow(), &self.0.start.get(), false, false);
        let now = self.0.now.get();
        Summary::of(|slot| self.0.gateway.borrow_mut().standing(slot, now), &parts)
    }

    fn config(&self, slot: usize) -> Option<SlotConfig> {
        self.0.gateway.borrow().config(slot).copied()
    }

    fn detail(&self, slot: usize) -> Option<Detail> {
        self.0.gateway.borrow().detail(slot)
    }

    fn alarm(&self, slot: usize, alarm: Alarm) -> Option<AlarmDetail> {
        self.0.gateway.borrow().alarm(slot, alarm, self.0.now.get())
    }

    fn trace(&self, age: usize) -> Option<Entry> {
        self.0.gateway.borrow().trace().iter().nth(age).copied()
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        let gateway = self.0.gateway.borrow();
        Some(BusState {
            settings: *gateway.bus_settings(bus),
            counters: *gateway.counters(bus),
            health: gateway.health(bus),
            driver: self.driver_enable(bus),
        })
    }

    fn bus_work(&self, bus: Bus) -> Option<BusWork> {
        let gateway = self.0.gateway.borrow();
        Some(BusWork { in_force: gateway.is_in_force(bus), progress: gateway.progress(bus) })
    }

    fn consequence(&self, order: &Order) -> Consequence {
        self.0.gateway.borrow().consequence(order)
    }

    fn task_event(&mut self) -> Option<TaskEvent> {
        self.0.gateway.borrow_mut().task_event(Requester::Console)
    }

    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal> {
        self.0.gateway.borrow_mut().change(slot, named, Requester::Console)
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        self.0.gateway.borrow_mut().carry_out(order, Requester::Console)
    }

    fn flush(&mut self) {}

    fn received(&mut self) -> Option<Received> {
        None
    }

    fn lost_characters(&self) -> u32 {
        0
    }

    fn version(&self) -> &'static str {
        "9.8.7"
    }

    fn start(&self) -> Start {
        self.0.start.get()
    }

    fn save(&mut self) -> Result<Saved, StorageError> {
        self.0.done.borrow_mut().push("save");
        Ok(Saved::Written)
    }

    fn factory_reset(&mut self) -> Result<(), StorageError> {
        self.0.done.borrow_mut().push("factory reset");
        Ok(())
    }

    fn reboot(&mut self) {
        self.0.done.borrow_mut().push("reboot");
    }

    fn console(&self) -> ConsoleSettings {
        self.0.gateway.borrow().console_settings()
    }

    fn modbus(&self) -> Option<clino_modbus::Settings> {
        Some(self.0.port.get())
    }

    fn modbus_counters(&self) -> Option<Counters> {
        Some(self.0.counters.get())
    }

    fn set_modbus(&mut self, settings: clino_modbus::Settings) {
        self.0.port.set(settings);
    }
}

/// All of it.
pub struct House {
    doors: Doors,
    shell: Shell<'static>,
    text: Text,
    server: Server,
    binding: Binding<Doors>,
    lines: [Port; 2],
    pub t7s: Vec<Arc<Mutex<T7>>>,
    pub isu: Arc<Mutex<Isu>>,
    /// The server's own time, µs.
    ticks: u64,
    pwm: u64,
}

/// A T7 with a serial number of its own. Its memory holds the place of its rate: 115200, 57600, and so on.
fn a_t7(address: u8, baud_index: u8, serial: u32, motion: Motion) -> Arc<Mutex<T7>> {
    let identity = Identity { serial, ..Identity::default() };
    let memory = Memory { address, baud_index, damping_ms: 20, ..Memory::default() };
    let still = Motion::Constant(0);
    let options = Options { motion: [still.clone(), still, motion], ..Options::default() };
    Arc::new(Mutex::new(T7::new(identity, memory, options).expect("a T7")))
}

impl House {
    /// T7 5 in slot 0 and T7 9, which turns, in slot 3; two T7s at address 20, which no slot reads; ISU 3 in slot 1, a PWM
    /// output in slot 2. All have been read for a second.
    pub fn new() -> House {
        let turning = Motion::Ramp { start: 0, rate: 20_000_000 };
        House::with(vec![
            a_t7(5, 0, 1_005, Motion::Constant(30_000_000)),
            a_t7(9, 0, 1_009, turning),
            a_t7(20, 0, 2_001, Motion::Constant(0)),
            a_t7(20, 0, 77_777, Motion::Constant(0)),
        ])
    }

    /// The same, but that T7 8 at 57600 bit/s is alone on its bus.
    pub fn with_a_stranger() -> House {
        House::with(vec![a_t7(8, 1, 1_008, Motion::Constant(0))])
    }

    fn with(t7s: Vec<Arc<Mutex<T7>>>) -> House {
        let line = || Line { chance: Chance::new(1), echo: false, noise: Noise::default() };
        let eeprom =
            Eeprom::factory(Content { address: 3, ..Content::default() }, ChecksumScope::default(), 1);
        let options = IsuOptions { motion: Motion::Constant(40_000_000), ..IsuOptions::default() };
        let isu = Arc::new(Mutex::new(Isu::new(eeprom, options)));
        let t7 =
            |address| Source::T7 { address: t7::Address::new(address).expect("one"), axis: t7::Axis::Two };
        let mut table = [
            SlotConfig { ask: Ask::Everything, ..SlotConfig::usual(t7(5)) },
            SlotConfig::usual(Source::Isu { address: isu::Address::new(3).expect("one") }),
            SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 }),
            SlotConfig::usual(t7(9)),
        ];
        // One alarm each: the T7 is at 30°, the ISU at 40°, the PWM input has no signal for long, the other T7 turns.
        let off = AlarmConfig::OFF;
        table[0].alarm = AlarmConfig { limits: AlarmLimits::High, high: 10_000, latching: true, ..off };
        table[1].alarm = AlarmConfig { limits: AlarmLimits::Low, low: 90_000, ..off };
        table[2].alarm = AlarmConfig { no_value: 1, ..off };
        table[3].alarm = AlarmConfig { rate: 5_000, ..off };
        let timings = [Timing::t7(Serial::T7_DEFAULT), Timing::isu()];
        let gateway = Gateway::new(&Settings::new(&table, timings[0], timings[1]), Limits::new(CLOCK));
        let stations = t7s.iter().map(|t7| sensor("t7", Box::new(Arc::clone(t7)))).collect();
        let doors = Doors(Rc::new(Inside {
            gateway: RefCell::new(gateway),
            now: Cell::new(Instant::ZERO),
            start: Cell::new(Start {
                cause: StartCause::PowerOn,
                boots: 1,
                uid: Uid([7, 8, 9]),
                ..Start::default()
            }),
            deferred: RefCell::default(),
            done: RefCell::default(),
            port: Cell::new(clino_modbus::Settings::DEFAULT),
            counters: Cell::default(),
        }));
        let text = Text::default();
        let mut house = House {
            shell: Shell::new(Box::leak(Box::new(clino_console::Port::new(text.clone())))),
            text,
            server: Server::new(clino_modbus::Settings::DEFAULT, IDENTIFICATION, Instant::ZERO),
            binding: Binding::new(doors.clone()),
            doors,
            lines: [
                Port::with_line(timings[0].line(), line(), stations),
                Port::with_line(timings[1].line(), line(), vec![sensor("isu", Box::new(Arc::clone(&isu)))]),
            ],
            t7s,
            isu,
            ticks: 2_000_000,
            pwm: 0,
        };
        house.run(1_000 * MS);
        _ = house.typed("json on");
        house
    }

    /// From now on the buses are not served, as in safe mode.
    pub fn in_safe_mode(&mut self) {
        self.doors.0.gateway.borrow_mut().degrade(DegradedMode::NoBuses);
    }

    /// The start is another one.
    pub fn set_start(&mut self, start: Start) {
        self.doors.0.start.set(start);
    }

    /// Time passes in the gateway.
    pub fn run(&mut self, micros: u64) {
        let until = self.doors.0.now.get().as_micros() + micros;
        while self.doors.0.now.get().as_micros() < until {
            let at = Instant::from_micros((self.doors.0.now.get().as_micros() + MS).min(until));
            for (bus, line) in Bus::ALL.into_iter().zip(&mut self.lines) {
                serve(&mut self.doors.0.gateway.borrow_mut(), bus, line, at);
            }
            self.doors.0.now.set(at);
            if at.as_micros() >= self.pwm {
                self.pwm = at.as_micros() + PERIOD;
                let period = CLOCK / 30;
                let cycle = Capture::Cycle(Ticks { period, high: period / 2 });
                self.doors.0.gateway.borrow_mut().pwm(PwmInput::Pwm1, cycle, at);
            }
            self.doors.0.gateway.borrow_mut().publish();
            self.binding.poll();
            while self.shell.poll(&mut self.doors) {}
        }
    }

    /// Types a line, waits until nothing is under way, and returns the lines that were printed.
    pub fn typed(&mut self, line: &str) -> Vec<String> {
        self.text.0.borrow_mut().clear();
        for byte in line.bytes().chain([b'\r']) {
            self.shell.input(Received::clean(byte), &mut self.doors);
        }
        while self.shell.poll(&mut self.doors) {}
        self.finish();
        let text = String::from_utf8(self.text.0.take()).expect("text");
        text.lines().filter(|line| !line.starts_with("{\"progress\"")).map(str::to_owned).collect()
    }

    /// Types a line, and goes on after so long.
    pub fn begin_typed(&mut self, line: &str, micros: u64) {
        for byte in line.bytes().chain([b'\r']) {
            self.shell.input(Received::clean(byte), &mut self.doors);
        }
        self.run(micros);
    }

    /// Waits until nothing is under way.
    pub fn finish(&mut self) {
        let begun = self.doors.0.now.get().as_micros();
        loop {
            let gateway = self.doors.0.gateway.borrow();
            let is_idle = Bus::ALL.iter().all(|&bus| gateway.progress(bus).is_none())
                && ![Requester::Console, Requester::Modbus]
                    .into_iter()
                    .any(|requester| gateway.has_task_event(requester));
            drop(gateway);
            if is_idle {
                return;
            }
            self.run(20 * MS);
            assert!(self.doors.0.now.get().as_micros() - begun < LONGEST, "it does not end");
        }
    }

    /// A request without address and checksum; the answer without them. The gateway's time stands still.
    pub fn ask(&mut self, pdu: &[u8]) -> Vec<u8> {
        let mut frame = vec![1];
        frame.extend_from_slice(pdu);
        frame.extend_from_slice(&crc(&frame).to_le_bytes());
        for byte in frame {
            self.ticks += 600;
            self.server.heard(Character::clean(byte), Instant::from_micros(self.ticks));
        }
        let answer = loop {
            let at = self.server.poll_at().expect("an answer");
            self.ticks = self.ticks.max(at.as_micros());
            if let Some(answer) = self.server.poll(Instant::from_micros(self.ticks), &mut self.binding) {
                break answer.to_vec();
            }
        };
        self.ticks += 600 * answer.len() as u64;
        self.server.sent(Instant::from_micros(self.ticks));
        self.ticks += 2_000_000;
        self.doors.0.counters.set(*self.server.counters());
        assert_eq!(crc(&answer), 0);
        answer[1..answer.len() - 2].to_vec()
    }

    /// Registers.
    pub fn read(&mut self, first: u16, quantity: u16) -> Vec<u16> {
        let ([a, b], [c, d]) = (first.to_be_bytes(), quantity.to_be_bytes());
        let answer = self.ask(&[3, a, b, c, d]);
        assert_eq!(answer[..2], [3, (quantity * 2) as u8], "{first:#06x}: {answer:?}");
        answer[2..].chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
    }

    /// Writes the command block with the key if it takes one; the exception, if there is one.
    ///
    /// # Errors
    /// The exception code.
    pub fn command(&mut self, code: u16, target: u16, value: i32, key: u16) -> Result<(), u8> {
        let [high, low] = [(value >> 16) as u16, value as u16];
        let words = [code, target, high, low, key];
        let mut pdu = vec![16, 0x1F, 0x00, 0, 5, 10];
        pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
        let answer = self.ask(&pdu);
        if answer[0] != 16 {
            return Err(answer[1]);
        }
        let deferred = self.doors.0.deferred.take();
        for request in deferred {
            let done = match request {
                DeferredRequest::Save => "save",
                DeferredRequest::FactoryReset => "factory reset",
                DeferredRequest::Reboot => "reboot",
            };
            self.doors.0.done.borrow_mut().push(done);
            self.binding.done(true);
        }
        Ok(())
    }

    /// All that a command can have changed.
    pub fn truth(&self) -> String {
        let gateway = self.doors.0.gateway.borrow();
        let memories: Vec<_> = self
            .t7s
            .iter()
            .map(|t7| {
                let t7 = t7.lock().expect("a T7");
                (t7.settings().clone(), t7.writes())
            })
            .collect();
        let isu = self.isu.lock().expect("an ISU");
        let resets = isu.mode();
        let slots: Vec<_> = (0..4).filter_map(|slot| gateway.config(slot)).collect();
        let alarms = gateway.alarm(0, Alarm::High, self.doors.0.now.get()).map(|alarm| alarm.state);
        let counted = Bus::ALL.map(|bus| gateway.counters(bus).requests > 3);
        format!(
            "{memories:?} {:?} {} {resets:?} {slots:?} {:?} {counted:?} {alarms:?} {:?}",
            isu.eeprom,
            isu.writes(),
            Bus::ALL.map(|bus| gateway.bus_settings(bus)),
            self.doors.0.done.borrow(),
        )
    }
}

/// Serves one bus until then.
fn serve(gateway: &mut Gateway, bus: Bus, line: &mut Port, until: Instant) {
    while line.now() < until {
        let now = line.now();
        gateway.poll(bus, now, |action| match action {
            Action::Send(frame) => {
                line.submit(frame, now + Duration::from_micros(10_000)).expect("the line is idle")
            }
            Action::Run(timing, _) => line.set_serial(timing.serial, timing.guard),
        });
        let now = line.now();
        let next = earliest(gateway.poll_at(bus), Some(until)).unwrap_or(until);
        let at = if next <= now { now + Duration::from_micros(20) } else { next.min(until) };
        if let Some(event) = line.run(at) {
            gateway.line(bus, event);
        }
    }
}

/// Zero over a frame with its checksum (MODBUS over Serial Line V1.02, section 6.2.2).
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    })
}

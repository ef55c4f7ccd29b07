//! The Modbus level: a software task in which the Modbus server runs.
//!
//! The port and the clock's second alarm wake it. Each run hands the server the events of the port, sends its answer,
//! and sets the alarm for the next deadline.

use core::cell::RefCell;

use clino_bus::{DriverEnable, Event, Instant};
use clino_gateway::Gateway;
use clino_gateway::settings::SettingsPart;
use clino_modbus::binding::{self, Binding, DeferredRequest};
use clino_modbus::{Identification, Refusal, Settings};
use clino_recovery::{MonitoredTask, Start};
use rtic::Mutex;
use stm32f4xx_hal::rcc::Rcc;

use crate::app::modbus_level::SharedResources;
use crate::board::ModbusLine;
use crate::clock::Alarm;
use crate::quiet::Kept;
use crate::{board, clock, events, params, ports, shared, watchdog};

pub mod port;

pub use clino_modbus::Server;

static IDENTIFICATION: Identification = Identification([
    "clino",
    board::PRODUCT,
    env!("CARGO_PKG_VERSION"),
    env!("CARGO_PKG_REPOSITORY"),
    "Inclinometer gateway",
    board::CHIP,
]);

/// What has happened on the line.
pub struct Lines {
    pub events: events::Consumer,
}

/// Takes the port into service.
pub fn start(
    line: ModbusLine,
    rcc: &mut Rcc,
    settings: &Settings,
    queues: &'static mut port::Queues,
) -> (port::Port, Lines) {
    let (usart, de, clock_hz) = line.start(rcc);
    port::start(usart, de, clock_hz, settings, queues)
}

/// The server of a port that runs like this.
pub fn server(settings: Settings) -> Server {
    Server::new(settings, &IDENTIFICATION, clock::now())
}

/// Resources that the level shares with others. The server's host uses them, too, while the server runs.
pub type Shared<'a> = RefCell<SharedResources<'a>>;

/// State of the level.
pub struct Level<'a> {
    pub lines: &'a mut Lines,
    pub server: &'a mut Server,
    pub binding: Binding<Site<'a>>,
    pub shared: &'a Shared<'a>,
}

impl<'a> Level<'a> {
    /// The level that answers for the gateway in `shared`.
    pub fn new(
        lines: &'a mut Lines,
        server: &'a mut Server,
        start: &'static Start,
        shared: &'a Shared<'a>,
    ) -> Self {
        Level { lines, server, binding: Binding::new(Site { shared, start }), shared }
    }

    /// A run of the level. Returns whether there is something to do already.
    pub fn run(&mut self) -> bool {
        // Events after this look are for the next run.
        let now = clock::now();
        while let Some(event) = events::take(&mut self.lines.events, now) {
            match event {
                Event::Heard { character, at } => self.server.heard(character, at),
                // The last stop bit of the answer is out.
                Event::Released { at } => self.server.sent(at),
                // The port has no other events.
                _ => {}
            }
        }
        if let Some(settings) = with(self.shared, |shared| shared.new_settings.lock(Option::take)).flatten() {
            self.server.set(settings, now);
        }
        self.binding.poll();
        if let Some(well) = with(self.shared, |shared| shared.done.lock(Option::take)).flatten() {
            self.binding.done(well);
        }
        if let Some(answer) = self.server.poll(now, &mut self.binding) {
            with(self.shared, |shared| shared.uplink.lock(|port| port.send(answer)));
        }
        if let Some(settings) = self.server.reconfigured() {
            with(self.shared, |shared| {
                shared.uplink.lock(|port| port.set_up(&settings));
                shared.settings.lock(|place| *place = settings);
            });
        }
        let has_command = self.binding.has_command();
        let counters = *self.server.counters();
        with(self.shared, |shared| {
            shared.has_command.lock(|place| *place = has_command);
            shared.port_counters.lock(|place| *place = counters);
        });
        let next = self.server.poll_at();
        if next.is_none_or(|at| at > now) {
            watchdog::check_in(MonitoredTask::Modbus);
        }
        let set =
            |at| with(self.shared, |shared| shared.timer.lock(|timer| timer.set(Alarm::Modbus, at, now)));
        next.and_then(set).unwrap_or(false)
    }
}

/// Looks at the shared resources; `None` within such a look.
fn with<'a, R>(shared: &Shared<'a>, look: impl FnOnce(&mut SharedResources<'a>) -> R) -> Option<R> {
    shared.try_borrow_mut().ok().map(|mut shared| look(&mut shared))
}

/// The board as the Modbus server sees it.
pub struct Site<'a> {
    shared: &'a Shared<'a>,
    start: &'static Start,
}

impl Site<'_> {
    fn kept(&self) -> Kept {
        with(self.shared, |shared| shared.kept.lock(|kept| *kept)).unwrap_or(Kept::UNKNOWN)
    }
}

impl binding::Site for Site<'_> {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
        with(self.shared, |shared| shared.gateway.lock(|gateway| look(gateway)))
    }

    fn wake(&self) {
        shared::wake_bus();
    }

    fn driver_enable(&self, bus: clino_gateway::Bus) -> DriverEnable {
        with(self.shared, |shared| ports::driver_enable(bus, &mut shared.t7, &mut shared.isu))
            .unwrap_or_default()
    }

    fn version(&self) -> (u8, u8, u16) {
        params::VERSION
    }

    fn start(&self) -> Start {
        *self.start
    }

    fn ask(&self, request: DeferredRequest) -> Result<(), Refusal> {
        if !cfg!(feature = "storage") && request != DeferredRequest::Reboot {
            // As any command that does not exist.
            return Err(Refusal::Value);
        }
        let before =
            with(self.shared, |shared| shared.deferred.lock(|place| place.replace(request))).flatten();
        shared::note_work();
        if before.is_some() { Err(Refusal::Busy) } else { Ok(()) }
    }

    fn is_unsaved(&self) -> bool {
        let fingerprint = SettingsPart::together(|part| {
            binding::Site::gateway(self, |gateway| gateway.fingerprint_of(part)).unwrap_or(0)
        });
        let port = with(self.shared, |shared| shared.settings.lock(|settings| *settings));
        self.kept().is_unsaved((fingerprint, port.unwrap_or(params::MODBUS)))
    }

    fn has_unread(&self) -> bool {
        self.kept().unread
    }
}

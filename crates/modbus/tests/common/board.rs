//! A board with a real gateway whose buses are not connected: PWM cycles are handed in, tasks find no node.

use std::cell::{Cell, RefCell};

use clino_bus::{DriverEnable, Duration, Instant, Serial, Timing};
use clino_codec::pwm::{Limits, Ticks};
use clino_codec::{isu, t7};
use clino_gateway::{Bus as Line, Capture, Gateway, PwmInput, Settings, SlotConfig, Source};
use clino_modbus::Refusal;
use clino_modbus::binding::{DeferredRequest, Site};
use clino_recovery::Start;

/// Timer ticks in a second.
const CLOCK: u32 = 84_000_000;

pub struct Board {
    pub gateway: RefCell<Gateway>,
    pub now: Cell<Instant>,
    pub deferred: RefCell<Vec<DeferredRequest>>,
    pub start: Cell<Start>,
    /// Something is stored that was not read at this start.
    pub unread: Cell<bool>,
}

impl Site for &Board {
    fn now(&self) -> Instant {
        self.now.get()
    }

    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
        Some(look(&mut self.gateway.borrow_mut()))
    }

    fn wake(&self) {}

    fn driver_enable(&self, _: Line) -> DriverEnable {
        DriverEnable { release_max_ns: 1_700, high_max_us: 300 }
    }

    fn version(&self) -> (u8, u8, u16) {
        (1, 2, 3)
    }

    fn start(&self) -> Start {
        self.start.get()
    }

    fn ask(&self, request: DeferredRequest) -> Result<(), Refusal> {
        self.deferred.borrow_mut().push(request);
        Ok(())
    }

    fn is_unsaved(&self) -> bool {
        true
    }

    fn has_unread(&self) -> bool {
        self.unread.get()
    }
}

impl Board {
    /// Slot 0 reads T7 5, slot 1 ISU 3, slot 2 the first PWM input.
    pub fn new() -> Board {
        let t7 = Source::T7 { address: t7::Address::new(5).unwrap(), axis: t7::Axis::Two };
        let isu = Source::Isu { address: isu::Address::new(3).unwrap() };
        let table = [t7, isu, Source::Pwm { input: PwmInput::Pwm1 }].map(SlotConfig::usual);
        Board::with(&table)
    }

    /// These slots, beginning with the first.
    pub fn with(table: &[SlotConfig]) -> Board {
        let settings = Settings::new(table, Timing::t7(Serial::T7_DEFAULT), Timing::isu());
        Board {
            gateway: RefCell::new(Gateway::new(&settings, Limits::new(CLOCK))),
            now: Cell::new(Instant::from_micros(1_000_000)),
            deferred: RefCell::default(),
            start: Cell::default(),
            unread: Cell::new(false),
        }
    }

    /// A PWM cycle of 30 Hz with this duty, in parts of a million.
    pub fn cycle(&self, ppm: u64) {
        let period = CLOCK / 30;
        let high = (u64::from(period) * ppm / 1_000_000) as u32;
        let mut gateway = self.gateway.borrow_mut();
        gateway.pwm(PwmInput::Pwm1, Capture::Cycle(Ticks { period, high }), self.now.get());
        gateway.publish();
    }

    pub fn config(&self, slot: usize) -> SlotConfig {
        *self.gateway.borrow().config(slot).unwrap()
    }

    /// Lets the bus levels run for a second; frames go nowhere.
    pub fn run(&self) {
        for _ in 0..1_000 {
            self.now.set(self.now.get() + Duration::from_micros(1_000));
            let mut gateway = self.gateway.borrow_mut();
            gateway.poll(Line::T7, self.now.get(), |_| {});
            gateway.poll(Line::Isu, self.now.get(), |_| {});
        }
    }
}

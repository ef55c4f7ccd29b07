//! A microcontroller that does not exist: a UART, a driver-enable pin and a delay in virtual time, on a simulated RS485
//! pair with simulated sensors. Examples and tests share it; on a real one, all this comes from its HAL.
//!
//! Every call costs [`CALL`], so that code that polls takes time as it does in life.
#![allow(dead_code, reason = "each example uses a part")]

#[cfg(feature = "async")]
pub mod executor;
pub mod sensors;
pub mod uart;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::rc::Rc;

use clino_segment::log::SharedLog;
use clino_segment::wire::Wire as _;
use clino_segment::{LineFaults, Segment, SegmentSettings, Station};
use clino_sim::node::Ns;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, OutputPin};

pub use uart::{Model, Uart};

/// What a call into the hardware costs, nanoseconds.
pub const CALL: Ns = 200;

/// No example and no test needs longer: what does not end fails instead.
const DOOMSDAY: Ns = 60_000_000_000;

/// All that moves with time.
pub struct World {
    segment: Segment,
    now: Ns,
    uart: uart::Registers,
    /// Wake-up times of futures.
    timers: BTreeMap<u64, Ns>,
}

/// Shared access to the world.
#[derive(Clone)]
pub struct Board(Rc<RefCell<World>>);

impl Board {
    /// A board at time 0 on a pair with these sensors.
    pub fn new(baud: u32, model: Model, settings: SegmentSettings, stations: Vec<Station>) -> Board {
        Self::with_faults(baud, model, settings, stations, LineFaults::default())
    }

    /// The same, on a pair that is not as it should be.
    pub fn with_faults(
        baud: u32,
        model: Model,
        settings: SegmentSettings,
        stations: Vec<Station>,
        faults: LineFaults,
    ) -> Board {
        let mut segment = Segment::new(settings, stations).with_faults(faults);
        let uart = uart::Registers::new(baud, model);
        segment.set_receiver(0, Some(uart.format()));
        Board(Rc::new(RefCell::new(World { segment, now: 0, uart, timers: BTreeMap::new() })))
    }

    /// Its UART.
    pub fn uart(&self) -> Uart {
        Uart(self.clone())
    }

    /// The pin that enables its line driver.
    pub fn de(&self) -> De {
        De(self.clone())
    }

    /// Its delay.
    pub fn delay(&self) -> Delay {
        Delay(self.clone())
    }

    /// What happened on the pair.
    pub fn log(&self) -> SharedLog {
        self.0.borrow().segment.log()
    }

    /// Time since power-up.
    pub fn now(&self) -> Ns {
        self.0.borrow().now
    }

    /// Lets time pass.
    pub fn pass(&self, span: Ns) {
        let mut world = self.0.borrow_mut();
        let to = world.now + span;
        world.advance(to);
    }

    fn call<T>(&self, act: impl FnOnce(&mut World) -> T) -> T {
        self.pass(CALL);
        act(&mut self.0.borrow_mut())
    }
}

impl World {
    /// The next instant at which the simulation does something.
    fn next_event(&self) -> Option<Ns> {
        let timer = self.timers.values().copied().min();
        [self.segment.next_event(), self.uart.next_event(), timer].into_iter().flatten().min()
    }

    fn advance(&mut self, to: Ns) {
        assert!(self.now < DOOMSDAY, "a task waits for ever");
        loop {
            let next = [self.segment.next_event(), self.uart.next_event()].into_iter().flatten().min();
            let at = next.filter(|&next| next <= to).unwrap_or(to).max(self.now);
            self.now = at;
            self.segment.advance(at);
            self.uart.run(at, &mut self.segment);
            if at >= to {
                return;
            }
        }
    }
}

/// An output pin.
pub struct De(Board);

impl ErrorType for De {
    type Error = Infallible;
}

impl OutputPin for De {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.call(|world| world.segment.drive_enable(world.now, false));
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.call(|world| world.segment.drive_enable(world.now, true));
        Ok(())
    }
}

/// A delay.
pub struct Delay(pub Board);

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.pass(CALL + Ns::from(ns));
    }

    fn delay_us(&mut self, us: u32) {
        self.0.pass(CALL + 1_000 * Ns::from(us));
    }
}

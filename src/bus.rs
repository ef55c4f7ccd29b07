//! The bus level: a software interrupt in which the gateway core runs.
//!
//! Any port, the clock's alarm and the clock's rounds raise it. Each run hands the core what has come in, sends
//! what it wants sent, publishes what it has read, and sets the alarm for the next deadline.

use core::cell::Cell;

use clino_bus::{Event, Micros, earliest};
use clino_console::BusState;
use clino_gateway::order::Order;
use clino_gateway::task::News;
use clino_gateway::{Action, Bus, Capture, Gateway, Publisher, PwmInput};
use cortex_m::peripheral::NVIC;
use cortex_m::singleton;
use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac::{Interrupt, interrupt};

use crate::{clock, params, ports, shared};

/// The interrupt line is borrowed from EXTI0, which has nothing connected here; only software raises it.
pub const INTERRUPT: Interrupt = Interrupt::EXTI0;

/// What the ports have for the bus level.
pub struct Inbox {
    pub t7: Consumer<'static, Event>,
    pub isu: Consumer<'static, Event>,
    pub pwm1: Consumer<'static, Capture>,
    pub pwm2: Consumer<'static, Capture>,
    pub order: Consumer<'static, Order>,
}

struct BusLevel {
    inbox: Inbox,
    news: Producer<'static, News>,
    gateway: Gateway,
    snapshot: Publisher<'static>,
    statistics_due: Micros,
}

/// Carries the bus level from the main program into its interrupt.
static HANDOVER: Mutex<Cell<Option<&'static mut BusLevel>>> = Mutex::new(Cell::new(None));

/// Makes the bus level ready to run; it does once its interrupt is let in.
pub fn start(inbox: Inbox, news: Producer<'static, News>, gateway: Gateway) {
    let snapshot = shared::SNAPSHOT.publisher();
    let level =
        singleton!(: BusLevel = BusLevel { inbox, news, gateway, snapshot, statistics_due: Micros::ZERO });
    critical_section::with(|cs| HANDOVER.borrow(cs).set(level));
    wake();
}

/// Runs the bus level soon: at once if nothing of higher priority is running.
pub fn wake() {
    NVIC::pend(INTERRUPT);
}

#[interrupt]
fn EXTI0() {
    static mut LEVEL: Option<&'static mut BusLevel> = None;
    if LEVEL.is_none() {
        *LEVEL = critical_section::with(|cs| HANDOVER.borrow(cs).take());
    }
    if let Some(level) = LEVEL {
        level.run();
    }
}

impl BusLevel {
    fn run(&mut self) {
        let now = clock::now();
        self.fetch(now);
        self.carry_out();
        for bus in shared::BUSES {
            self.gateway.poll(bus, now, |action| match action {
                Action::Send(frame) => ports::submit(bus, frame),
                Action::Run(timing, line) => ports::run(bus, &timing, line),
            });
        }
        let ports_at = ports::poll(now);
        self.publish(now);
        let gateway_at = shared::BUSES.map(|bus| self.gateway.poll_at(bus)).into_iter().fold(None, earliest);
        if let Some(at) = earliest(ports_at, gateway_at) {
            clock::wake_at(at);
        }
    }

    fn fetch(&mut self, now: Micros) {
        while let Some(event) = self.inbox.t7.dequeue() {
            self.gateway.line(Bus::T7, event);
        }
        while let Some(event) = self.inbox.isu.dequeue() {
            self.gateway.line(Bus::Isu, event);
        }
        while let Some(capture) = self.inbox.pwm1.dequeue() {
            self.gateway.pwm(PwmInput::Pwm1, capture, now);
        }
        while let Some(capture) = self.inbox.pwm2.dequeue() {
            self.gateway.pwm(PwmInput::Pwm2, capture, now);
        }
    }

    fn carry_out(&mut self) {
        while let Some(order) = self.inbox.order.dequeue() {
            if let Err(refusal) = self.gateway.carry_out(order) {
                self.tell(News::Refused(refusal));
            }
            self.statistics_due = Micros::ZERO;
        }
    }

    fn tell(&mut self, news: News) {
        if self.news.enqueue(news).is_err() {
            defmt::warn!("nobody fetches the news");
        }
        shared::note_work();
    }

    fn publish(&mut self, now: Micros) {
        while self.news.ready()
            && let Some(news) = self.gateway.news()
        {
            self.tell(news);
        }
        if self.gateway.publish(&mut self.snapshot) {
            shared::note_work();
        }
        if now >= self.statistics_due {
            self.statistics_due = now + params::PUBLISH_EVERY;
            for bus in shared::BUSES {
                let (timing, counters) = (*self.gateway.timing(bus), *self.gateway.counters(bus));
                let (line, driver) = (*self.gateway.line_settings(bus), ports::driver_enable(bus));
                let progress = self.gateway.progress(bus);
                shared::publish_bus(bus, BusState { timing, line, counters, driver, progress });
            }
        }
    }
}

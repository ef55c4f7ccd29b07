//! The bus level: a software task in which the gateway core runs.
//!
//! Any port, the clock's alarm and the clock's rounds wake it. Each run hands the core the events of the ports, sends
//! its requests, publishes its readings, and sets the alarm for the next deadline.
//!
//! The levels below give orders and ask for details by locking the gateway, which holds this level off for as long as
//! it takes: they look at one thing at a time.

use clino_bus::{DriverEnable, Event, Instant, earliest};
use clino_console::BusState;
use clino_gateway::{Bus, Capture, Gateway, PwmInput, Requester};
use clino_recovery::MonitoredTask;
use heapless::spsc::Consumer;
use rtic::Mutex;

use crate::app::bus_level::{LocalResources, SharedResources};
use crate::clock::Alarm;
use crate::{clock, ports, shared, watchdog};

/// Events of the ports for the bus level.
pub struct Inbox {
    pub t7: Consumer<'static, Event>,
    pub isu: Consumer<'static, Event>,
    pub pwm1: Consumer<'static, Capture>,
    pub pwm2: Consumer<'static, Capture>,
}

impl Inbox {
    fn is_empty(&self) -> bool {
        self.t7.is_empty() && self.isu.is_empty() && self.pwm1.is_empty() && self.pwm2.is_empty()
    }

    /// Hands the gateway the events.
    fn empty_into(&mut self, gateway: &mut Gateway, now: Instant) {
        while let Some(event) = self.t7.dequeue() {
            gateway.line(Bus::T7, event);
        }
        while let Some(event) = self.isu.dequeue() {
            gateway.line(Bus::Isu, event);
        }
        while let Some(capture) = self.pwm1.dequeue() {
            gateway.pwm(PwmInput::Pwm1, capture, now);
        }
        while let Some(capture) = self.pwm2.dequeue() {
            gateway.pwm(PwmInput::Pwm2, capture, now);
        }
        watchdog::check_in(MonitoredTask::Pwm);
    }
}

/// A run of the level. Returns whether there is something to do already.
pub fn run(local: &mut LocalResources<'_>, shared: &mut SharedResources<'_>) -> bool {
    let SharedResources { gateway, t7, isu, pwm1, pwm2, timer, .. } = shared;
    gateway.lock(|gateway| {
        let now = clock::now();
        local.inbox.empty_into(gateway, now);
        gateway.poll(Bus::T7, now, |action| ports::act(t7, action));
        gateway.poll(Bus::Isu, now, |action| ports::act(isu, action));
        // One port at a time, so that no interrupt waits for all.
        let ports_at = [ports::poll(t7), ports::poll(isu)];
        let pwm_now = clock::now();
        let pwm1_at = pwm1.lock(|port| {
            port.poll(pwm_now);
            port.poll_at()
        });
        let pwm2_at = pwm2.lock(|port| {
            port.poll(pwm_now);
            port.poll_at()
        });
        let gateway_at = shared::BUSES.map(|bus| gateway.poll_at(bus));
        for (at, task) in gateway_at.iter().zip([MonitoredTask::T7Bus, MonitoredTask::IsuBus]) {
            // A bus that still wants something of the past has not gone on.
            if at.is_none_or(|at| at > now) {
                watchdog::check_in(task);
            }
        }
        if gateway.publish(local.snapshot) || gateway.has_task_event(Requester::Console) {
            shared::note_work();
        }
        if gateway.has_task_event(Requester::Modbus) {
            shared::wake_modbus();
        }
        let next = ports_at.into_iter().chain(gateway_at).chain([Some(pwm1_at), Some(pwm2_at)]);
        let has_passed =
            next.fold(None, earliest).is_some_and(|at| timer.lock(|timer| timer.set(Alarm::Bus, at)));
        has_passed || !local.inbox.is_empty()
    })
}

/// Counters of a bus since reset, and its settings.
pub fn state(gateway: &Gateway, bus: Bus, driver: DriverEnable) -> BusState {
    BusState {
        settings: *gateway.bus_settings(bus),
        in_force: gateway.is_in_force(bus),
        counters: *gateway.counters(bus),
        health: gateway.health(bus),
        driver,
        progress: gateway.progress(bus),
    }
}

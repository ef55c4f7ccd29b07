//! The bus level: a software task in which the gateway core runs.
//!
//! Any port, the clock's alarm and the clock's rounds wake it. Each run hands the core the events of the ports, sends
//! its requests, publishes its readings, and sets the alarm for the next deadline.
//!
//! The levels below read values and give orders by locking the gateway, which holds this level off for as long as it takes:
//! they look at one thing at a time.

use clino_bus::{DriverEnable, Instant};
use clino_console::BusState;
use clino_gateway::{Bus, Capture, Gateway, PwmInput, Requester};
use clino_recovery::MonitoredTask;
use heapless::spsc::Consumer;
use rtic::Mutex;

use crate::app::bus_level::{LocalResources, SharedResources};
use crate::clock::Alarm;
use crate::{clock, events, ports, shared, watchdog};

/// Events of the ports for the bus level.
pub struct Inbox {
    pub t7: events::Consumer,
    pub isu: events::Consumer,
    pub pwm1: Consumer<'static, Capture>,
    pub pwm2: Consumer<'static, Capture>,
}

impl Inbox {
    fn is_empty(&self) -> bool {
        self.t7.is_empty() && self.isu.is_empty() && self.pwm1.is_empty() && self.pwm2.is_empty()
    }

    /// Hands the gateway the events. A function of its own: its stack is free again when an exchange begins.
    #[inline(never)]
    fn empty_into(&mut self, gateway: &mut Gateway, now: Instant) {
        for (bus, queue) in [(Bus::T7, &mut self.t7), (Bus::Isu, &mut self.isu)] {
            while let Some(event) = events::take(queue, now) {
                gateway.line(bus, event);
            }
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
        // What has become due meanwhile, a delay of a driver, does not wait for another run.
        let later = clock::now();
        // One port at a time, so that no interrupt waits for all.
        let mut next = pwm1.lock(|port| port.poll(later)).min(pwm2.lock(|port| port.poll(later)));
        for port_at in [ports::poll(t7, later), ports::poll(isu, later)] {
            next = next.min(port_at.unwrap_or(Instant::NEVER));
        }
        for (bus, task) in shared::BUSES.iter().zip([MonitoredTask::T7Bus, MonitoredTask::IsuBus]) {
            let at = gateway.poll_at(*bus).unwrap_or(Instant::NEVER);
            // A bus that still wants something of the past has not gone on.
            if at > now {
                watchdog::check_in(task);
            }
            next = next.min(at);
        }
        if gateway.publish() || gateway.has_task_event(Requester::Console) {
            shared::note_work();
        }
        if gateway.has_task_event(Requester::Modbus) {
            shared::wake_modbus();
        }
        let has_passed = timer.lock(|timer| timer.set(Alarm::Bus, next, now));
        has_passed || !local.inbox.is_empty()
    })
}

/// Counters of a bus since reset, and its settings.
pub fn state(gateway: &Gateway, bus: Bus, driver: DriverEnable) -> BusState {
    BusState {
        settings: *gateway.bus_settings(bus),
        counters: *gateway.counters(bus),
        health: gateway.health(bus),
        driver,
    }
}

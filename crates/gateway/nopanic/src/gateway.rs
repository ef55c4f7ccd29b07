//! clino-gateway.

use clino_bus::Instant;
use clino_gateway::lint::{Finding, Lint};
use clino_gateway::order::Order;
use clino_gateway::settings::{bus, console, port, slot};
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::{Entry as Exchange, Purpose, Trace, Verdict};
use clino_gateway::{
    Action, Bus, BusChange, BusSettings, Configuration, Gateway, Health, Reading, Settings, SlotConfig, SlotCounters,
    Source, Status,
};

use crate::{Entry, entries};

pub static ENTRIES: &[Entry] = &entries![
    Gateway::new,
    Gateway::line,
    Gateway::pwm,
    Gateway::carry_out,
    Gateway::task_event,
    Gateway::has_task_event,
    Gateway::progress,
    poll,
    Gateway::poll_at,
    Gateway::next_changed,
    Gateway::publish,
    Gateway::generation,
    Gateway::reading,
    Gateway::status,
    Gateway::angle,
    Gateway::age_ms,
    Gateway::standing,
    Gateway::brief,
    Gateway::config,
    Gateway::slot_counters,
    Gateway::detail,
    Gateway::bus_settings,
    Gateway::set_up,
    <Gateway as Configuration>::slot,
    <Gateway as Configuration>::bus,
    <Gateway as Configuration>::set_slot,
    <Gateway as Configuration>::set_bus,
    <Gateway as Configuration>::console,
    <Gateway as Configuration>::set_console,
    <Settings as Configuration>::slot,
    <Settings as Configuration>::bus,
    <Settings as Configuration>::set_slot,
    <Settings as Configuration>::set_bus,
    Gateway::fingerprint,
    Gateway::console_settings,
    Gateway::clear_counters,
    Gateway::trace,
    Gateway::counters,
    Gateway::timing,
    Gateway::is_in_force,
    Gateway::lost_edges,
    Source::bus,
    Source::node,
    SlotConfig::usual,
    SlotConfig::every,
    SlotConfig::bus,
    SlotConfig::is_on,
    SlotConfig::stale_after,
    Source::of,
    Source::held,
    SlotCounters::response_last,
    SlotCounters::response_min,
    SlotCounters::response_max,
    Health::has,
    Health::bits,
    Health::from_bits,
    health_names,
    findings,
    Lint::load,
    Order::check,
    slot::changed,
    slot::check,
    bus::check,
    BusChange::named,
    BusSettings::first,
    port::changed,
    console::changed,
    BusSettings::usual,
    BusSettings::new,
    Settings::new,
    TaskEvent::is_end,
    Verdict::name,
    Purpose::name,
    Exchange::took,
    Trace::new,
    Trace::total,
    trace,
    Status::name,
    Reading::brief,
    Reading::status,
    Reading::angle,
    Reading::raw,
    Reading::rate,
    Reading::turns,
    Reading::temperature,
    Reading::is_fresh,
    Reading::age_ms,
];

// What takes a function or returns an iterator exists only where it is used.

fn poll(gateway: &mut Gateway, bus: Bus, now: Instant, act: fn(Action<'_>)) {
    gateway.poll(bus, now, act);
}

fn health_names(health: Health) -> usize {
    health.names().count()
}

fn findings(lint: Lint<'_>, found: fn(Finding)) {
    lint.findings(&mut |finding| found(finding));
}

fn trace(trace: &Trace, age: usize) -> Option<&Exchange> {
    #[cfg(feature = "planted")]
    core::hint::black_box([0u8; 4][age]);
    trace.iter().nth(age)
}

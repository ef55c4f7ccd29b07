#![forbid(unsafe_code)]
//! clino gateways seen from afar: a live page, and many gateways on one MQTT broker.
//!
//! ```text
//!  gateway's console ─┐                        ┌─▶ page         browser, server-sent events
//!  gateway's Modbus  ─┼─▶ source ─▶ hub ─▶ news┼─▶ mqtt         store, broker, Home Assistant, Sparkplug B
//!  sensors on a bus  ─┘            (state)     ├─▶ influx       line protocol
//!                                              └─▶ prometheus   a scrape reads the state
//! ```
//!
//! A source tells the hub what it hears ([`source`]); the hub keeps the last state of every sensor and passes the news on. A
//! value is an angle with the instant at which it was measured: reception minus age. It is a value only while the gateway
//! says *ok* and the source speaks; a source that goes away takes its values with it, and its going is told.
//!
//! There is no server of our own behind the page: a broker carries a fleet, and what people already run keeps its history.

mod bridge;
mod clock;
pub mod config;
mod csv;
mod health;
mod history;
mod hub;
mod influx;
mod mqtt;
mod page;
mod prometheus;
mod queue;
mod say;
mod sensor;
mod serve;
pub mod source;
mod store;

pub use bridge::bridge;
pub use serve::serve;

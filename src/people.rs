//! The gateway as the console sees it.

use clino_bus::Micros;
use clino_console::{BusState, Host};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::News;
use clino_gateway::{Asker, Bus, Reading};

use crate::{bus, clock, console, shared};

/// The gateway: all of it is shared, so there is nothing to hold.
pub struct Gateway;

impl Host for Gateway {
    fn now(&self) -> Micros {
        clock::now()
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        shared::reading(slot)
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        bus::state(bus)
    }

    fn news(&mut self) -> Option<News> {
        let news = bus::with(|gateway| gateway.news(Asker::Console)).flatten();
        if news.is_some() {
            // The task has waited for this.
            bus::wake();
        }
        news
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        let result = bus::with(|gateway| gateway.carry_out(order, Asker::Console));
        bus::wake();
        result.unwrap_or(Err(Refusal::Busy))
    }

    fn lost_characters(&self) -> u32 {
        console::lost()
    }

    fn version(&self) -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}

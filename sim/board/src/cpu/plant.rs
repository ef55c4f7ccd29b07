//! Injects faults: sets the core's registers when a fault is due and its level is executing.

use clino_sim::node::Ns;
use rsemu::core::space::MemAttrs;
use rsemu::core::value::Width;
use rsemu::cpu::arm::v7m::{ArmV7m, xpsr};

use super::{Cpu, NEVER};
use crate::incident::Event;
use crate::injection::{Injection, Payload, What};

/// Faults to be planted, and when the next one is due.
#[derive(Default)]
pub(super) struct Planting {
    orders: Vec<Order>,
}

/// One fault to be planted.
struct Order {
    plant: Injection,
    payload: Payload,
    /// From when on; `None` until the reset that the last time is to bring, and after the last time.
    due: Option<Ns>,
    left: u32,
}

impl Planting {
    /// One more.
    pub fn add(&mut self, plant: Injection, payload: Payload) {
        self.orders.push(Order { plant, payload, due: Some(plant.at), left: plant.times });
    }

    fn next(&self) -> Option<Ns> {
        self.orders.iter().filter_map(|order| order.due).min()
    }

    /// The chip was reset.
    pub fn reset(&mut self, now: Ns) {
        for order in self.orders.iter_mut().filter(|order| order.due.is_none() && order.left > 0) {
            order.due = Some(now.saturating_add(order.plant.again));
        }
    }
}

impl Cpu {
    /// The cycle from which on a fault is to be planted.
    pub(super) fn next_planting(&self, planting: &Planting) -> u64 {
        planting.next().map_or(NEVER, |ns| self.timeline.cycle_from(ns))
    }

    /// Plants what is due at `at`, if its level is about to execute an instruction. Returns whether anything was.
    pub(super) fn plant(&self, planting: &mut Planting, at: u64) -> bool {
        let now = self.timeline.ns_at(at);
        let core = &self.core;
        let fits = |order: &Order| order.due.is_some_and(|due| due <= now) && is_at(core, &order.plant);
        let Some(order) = planting.orders.iter_mut().find(|order| fits(order)) else { return false };
        let Injection { what, level, .. } = order.plant;
        let pc = core.pc();
        match order.payload.reset {
            Some(cause) => self.reset_from(cause),
            None => order.payload.swallow(core),
        }
        let event = Event::Planted { what, level, pc, to: core.pc() };
        order.left = order.left.saturating_sub(1);
        order.due = None;
        self.chronicle.note(now, event);
        true
    }
}

/// Whether the core is about to execute an instruction where `plant` wants it.
fn is_at(core: &ArmV7m, plant: &Injection) -> bool {
    if core.current_exception().0 != plant.level.exception() || core.is_asleep() || core.is_locked_up() {
        return false;
    }
    let regs = core.regs();
    // Higher levels have to get through to a level that hangs.
    plant.what != What::Hang || !regs.primask && regs.basepri == 0
}

impl Payload {
    /// Sets the registers, or the memory.
    fn swallow(&self, core: &ArmV7m) {
        if let Some((address, mask)) = self.flips {
            flip(core, address, mask);
            return;
        }
        let mut regs = core.regs();
        regs.r[15] = self.pc;
        for (number, value) in self.registers.iter().flatten() {
            if let Some(register) = regs.r.get_mut(usize::from(*number)) {
                *register = *value;
            }
        }
        // The gateway has one stack: the main one.
        regs.msp = self.sp.unwrap_or(regs.msp);
        regs.primask |= self.masked;
        // The instruction must not be taken for one of the block that was being executed.
        regs.xpsr &= !xpsr::IT_MASK;
        core.set_regs(regs);
    }
}

/// Turns the bits of `mask` in the byte at `address`.
fn flip(core: &ArmV7m, address: u32, mask: u8) {
    let Some(space) = core.space() else { return };
    // Where there is no memory, there is nothing to turn.
    if let Ok(byte) = space.read(u64::from(address), Width::U8, MemAttrs::DEBUG) {
        let _ = space.write(u64::from(address), Width::U8, byte ^ u64::from(mask), MemAttrs::DEBUG);
    }
}

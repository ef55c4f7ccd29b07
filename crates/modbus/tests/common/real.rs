//! A real gateway behind the server, with a note of what was asked of it.

use std::cell::Cell;

use clino_gateway::{Reading, SlotConfig};
use clino_modbus::binding::Binding;
use clino_modbus::command::Command;
use clino_modbus::settings::Settings;
use clino_modbus::{Exception, Host, Refusal, Write};

use super::board::Board;

/// What was accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    Settings,
    Port,
    Command { command: Command, target: u16, value: i32, armed: bool },
}

/// Slots and buses are set for real; commands are noted, and not carried out.
pub struct Real {
    pub board: &'static Board,
    pub binding: Binding<&'static Board>,
    /// Requests that were begun.
    pub begun: u32,
    /// What was accepted.
    pub writes: Vec<Written>,
    /// What the next change is answered with.
    pub refusal: Option<Refusal>,
    /// Reads so far.
    pub reads: Cell<u32>,
}

impl Real {
    /// Of a board of its own, which lives as long as the test.
    pub fn new() -> Real {
        Real::on(Board::new())
    }

    pub fn on(board: Board) -> Real {
        let board: &'static Board = Box::leak(Box::new(board));
        board.gateway.borrow_mut().publish();
        let binding = Binding::new(board);
        Real { board, binding, begun: 0, writes: Vec::new(), refusal: None, reads: Cell::new(0) }
    }

    /// How a slot is set.
    pub fn config(&self, slot: usize) -> SlotConfig {
        self.board.config(slot)
    }

    /// What a slot says.
    pub fn reading(&self, slot: usize) -> Reading {
        self.board.gateway.borrow_mut().reading(slot).expect("a slot")
    }

    /// How all slots are set.
    pub fn slots(&self) -> Vec<SlotConfig> {
        (0..48).map(|slot| self.config(slot)).collect()
    }
}

impl Host for Real {
    fn begin(&mut self) {
        self.begun += 1;
        self.binding.begin();
    }

    fn held_still(&self) -> bool {
        self.binding.held_still()
    }

    fn status(&self) -> u16 {
        self.binding.status()
    }

    fn read(
        &self,
        port: &Settings,
        first: u16,
        quantity: u16,
        take: &mut dyn FnMut(u16),
    ) -> Result<(), Exception> {
        self.reads.set(self.reads.get() + 1);
        self.binding.read(port, first, quantity, take)
    }

    fn write(&mut self, write: &Write<'_>) -> Result<(), Refusal> {
        if let Some(refusal) = self.refusal {
            return Err(refusal);
        }
        let written = match *write {
            Write::Command { command, target, value, armed } => {
                Written::Command { command, target, value, armed }
            }
            Write::Port(_) => Written::Port,
            Write::Slot(..) | Write::Bus(..) | Write::Console(_) => Written::Settings,
        };
        if !matches!(write, Write::Command { .. }) {
            self.binding.write(write)?;
        }
        self.writes.push(written);
        Ok(())
    }
}

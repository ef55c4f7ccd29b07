//! Silence on all lines, for what stalls the core, and what is known of the stored configuration.

use clino_bus::Duration;
use clino_console::StorageError;
use clino_gateway::Gateway;
use clino_modbus::Settings;
use clino_recovery::MonitoredTask;

use crate::{board, clock, watchdog};

/// How long a driver that is on is waited for: the longest answer on the Modbus port, 256 characters of 11 bits at
/// 2400 bit/s, lasts 1.17 s.
const LONGEST_WAIT: Duration = Duration::from_millis(1_300);

/// Identifies a configuration: fingerprint of the gateway's settings, and the Modbus port.
pub type Known = (u32, Settings);

/// Content of the flash, as far as it is known.
#[derive(Clone, Copy)]
pub struct Kept {
    /// Configuration of the next start; `None` if it is not known.
    pub next: Option<Known>,
    /// The flash holds a configuration that was not taken over at this start; a save replaces it for good.
    pub unread: bool,
}

impl Kept {
    /// Nothing yet.
    pub const UNKNOWN: Kept = Kept { next: None, unread: false };

    /// Whether the configuration in force differs, or may differ, from that of the next start.
    pub fn is_unsaved(&self, in_force: Known) -> bool {
        self.next != Some(in_force)
    }
}

/// Something to do with the gateway and the settings of the Modbus port. A trait and no closure: the stack analysis tells its
/// functions from other closures' by their names.
pub trait Work {
    /// Does it.
    fn run(&mut self, gateway: &Gateway, modbus: &Settings);
}

/// Work that may stall the core. No other monitored task can check in meanwhile: this takes less than the shortest of their
/// deadlines, stalls left out.
struct Stalling<'a>(&'a mut dyn Work);

impl Work for Stalling<'_> {
    fn run(&mut self, gateway: &Gateway, modbus: &Settings) {
        watchdog::check_in(MonitoredTask::Storage);
        clock::across_stall(|| self.0.run(gateway, modbus));
        watchdog::rest(MonitoredTask::Storage);
    }
}

/// Access to the levels above the main loop, for storing.
pub trait Quiet {
    /// Does something that may stall the core with the gateway and the settings of the Modbus port, while no line
    /// driver is on and none can be switched on; `false`, and nothing is done, if one is on now.
    ///
    /// A driver that is on while the core stands still holds its line against all nodes. An answer that comes in
    /// meanwhile is lost, and asked for again.
    fn while_silent(&mut self, work: &mut dyn Work) -> bool;

    /// Sets the known content of the flash.
    fn note(&mut self, kept: Kept);
}

/// Restarts the board.
struct Restart;

impl Work for Restart {
    fn run(&mut self, _: &Gateway, _: &Settings) {
        board::reset()
    }
}

/// Restarts the board when all lines have sent their frames, or do not fall silent.
pub fn restart(shared: &mut dyn Quiet) -> ! {
    // A line that is driven all the time is one more reason to restart.
    let _ = silently(shared, &mut Restart);
    board::reset()
}

/// Waits until all lines are silent, and does this with the gateway, once.
pub fn silently(shared: &mut dyn Quiet, work: &mut dyn Work) -> Result<(), StorageError> {
    let begin = clock::now();
    while clock::now().since(begin) < LONGEST_WAIT {
        watchdog::check_in(MonitoredTask::Console);
        if shared.while_silent(&mut Stalling(work)) {
            return Ok(());
        }
        cortex_m::asm::wfi();
    }
    Err(StorageError::Busy)
}

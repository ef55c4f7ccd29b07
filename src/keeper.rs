//! The stored configuration: taken over at the start, stored on request; and whether what is in force is what the next start
//! has.
//!
//! For the people level only. Storing stalls the core, interrupts included, for 16 µs a word, and for 250 to 500 ms when a
//! sector has to be erased (`flash.rs`): what is on the buses then is lost, and asked for again.

use core::cell::Cell;

use clino_bus::Micros;
use clino_console::{Saved, StorageError};
use clino_gateway::Gateway;
use clino_recovery::MonitoredTask;
use clino_storage::{LoadError, Loaded, SaveError, Store};
use critical_section::Mutex;
use stm32f4xx_hal::pac;

use crate::flash::{self, ConfigurationFlash};
use crate::log::log;
use crate::{bus, clock, modbus, params, watchdog};

/// How long a driver that is on is waited for: the longest answer on the Modbus port, 256 characters of 11 bits at
/// 2400 bit/s, lasts 1.17 s.
const LONGEST_WAIT: Micros = Micros::from_millis(1_300);

/// By what a configuration is known: fingerprint of the gateway's settings, and the Modbus port.
type Known = (u32, clino_modbus::Settings);

/// What is known of the flash.
#[derive(Clone, Copy)]
struct Kept {
    /// What the next start has; `None` if that is not known.
    next: Option<Known>,
    /// There is something that was not taken over at this start, and that a save replaces for good.
    unread: bool,
}

static KEPT: Mutex<Cell<Kept>> = Mutex::new(Cell::new(Kept { next: None, unread: false }));

/// Whether the configuration in force is not what the next start has, or may not be.
pub fn is_unsaved() -> bool {
    kept().next != Some(in_force())
}

/// Whether a save replaces something that was not taken over at this start: in bare mode, which reads nothing, or because
/// another firmware has stored it.
pub fn has_unread() -> bool {
    kept().unread
}

fn kept() -> Kept {
    critical_section::with(|cs| KEPT.borrow(cs).get())
}

fn note(next: Option<Known>, unread: bool) {
    critical_section::with(|cs| KEPT.borrow(cs).set(Kept { next, unread }));
}

fn in_force() -> Known {
    (bus::with(|gateway| gateway.fingerprint()).unwrap_or(0), modbus::settings())
}

/// Who stores.
pub struct Keeper {
    store: Store<ConfigurationFlash>,
    /// The configuration as delivered.
    delivered: Known,
}

impl Keeper {
    /// Nothing is read yet, and the configuration in force is the delivered one.
    pub fn new(flash: pac::FLASH) -> Keeper {
        let delivered = (bus::with(|gateway| gateway.fingerprint()).unwrap_or(0), params::MODBUS);
        Keeper { store: Store::new(ConfigurationFlash::new(flash)), delivered }
    }

    /// Takes over nothing, and reads nothing that could do harm.
    pub fn leave(&mut self) {
        let is_blank = self.store.is_blank();
        note(is_blank.then_some(self.delivered), !is_blank);
    }

    /// Takes over what is stored; what cannot be taken stays as it is. Before the gateway begins.
    #[inline(never)]
    pub fn load(&mut self, modbus: &mut clino_modbus::Settings) {
        let loaded = bus::with(|gateway| self.store.load(gateway, modbus)).unwrap_or(Err(LoadError::Library));
        match loaded {
            Ok(Loaded::Stored { version }) => log!(info, "configuration of version {=u8}", version),
            Ok(Loaded::Factory | Loaded::Nothing) => log!(info, "configuration as delivered"),
            Err(LoadError::Rejected(_)) => {
                log!(error, "what is stored is no configuration for this firmware")
            }
            Err(LoadError::Flash(_) | LoadError::Library) => log!(error, "the configuration cannot be read"),
        }
        // What is not taken now is not taken next time either.
        let fingerprint = bus::with(|gateway| gateway.fingerprint()).unwrap_or(0);
        note(Some((fingerprint, *modbus)), matches!(loaded, Err(LoadError::Rejected(_))));
    }

    /// Stores what is in force.
    pub fn save(&mut self) -> Result<Saved, StorageError> {
        let (saved, stored) = silently(|gateway| {
            let modbus = modbus::settings();
            (self.store.save(gateway, &modbus), (gateway.fingerprint(), modbus))
        })?;
        let saved = saved.map_err(told)?;
        note(Some(stored), false);
        Ok(match saved {
            clino_storage::SaveOutcome::Unchanged => Saved::Unchanged,
            clino_storage::SaveOutcome::Written => Saved::Written,
        })
    }

    /// Forgets what is stored, from the next start on.
    pub fn factory_reset(&mut self) -> Result<(), StorageError> {
        let forgotten = silently(|_| self.store.factory_reset())?;
        // After a failure the old settings may be there, or nothing.
        note(forgotten.is_ok().then_some(self.delivered), false);
        forgotten.map(|_| ()).map_err(told)
    }
}

/// Waits until what is being sent is out; `false` if a line does not fall silent.
pub fn await_silence() -> bool {
    silently(|_| ()).is_ok()
}

/// Waits until all lines are silent, and does this with the gateway.
fn silently<R>(mut work: impl FnMut(&Gateway) -> R) -> Result<R, StorageError> {
    let begin = clock::now();
    while clock::now().since(begin) < LONGEST_WAIT {
        watchdog::check_in(MonitoredTask::Console);
        let result = bus::while_silent(|gateway| {
            // Nobody else can check in meanwhile: this takes less than the shortest of their deadlines, stalls left out.
            watchdog::check_in(MonitoredTask::Storage);
            let result = clock::across_stall(|| work(gateway));
            watchdog::rest(MonitoredTask::Storage);
            result
        });
        if let Some(result) = result {
            return Ok(result);
        }
        cortex_m::asm::wfi();
    }
    Err(StorageError::Busy)
}

fn told(error: SaveError<flash::Error>) -> StorageError {
    match error {
        SaveError::Rejected(_) => log!(error, "not stored: the settings are not valid"),
        SaveError::Flash(_) => log!(error, "not stored: the flash does not take it"),
        SaveError::Library => log!(error, "not stored: what is stored cannot be read"),
    }
    StorageError::Failed
}

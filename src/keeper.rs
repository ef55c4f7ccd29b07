//! The stored configuration: taken over at the start, stored when somebody asks for it.
//!
//! For the people level only. Storing stalls the core, interrupts included, for 16 µs a word, and for 250 to 500 ms when a
//! sector has to be erased (`flash.rs`): what is on the buses then is lost, and asked for again.

use core::cell::Cell;

use clino_bus::Micros;
use clino_console::{Saved, StorageError};
use clino_gateway::Gateway;
use clino_recovery::Duty;
use clino_storage::{LoadError, Loaded, SaveError, Store};
use critical_section::Mutex;
use stm32f4xx_hal::pac;

use crate::flash::{self, ConfigurationFlash};
use crate::log::log;
use crate::{bus, clock, modbus, params, watchdog};

/// How long a driver that is on is waited for: the longest answer on the Modbus port, 256 characters of 11 bits at
/// 2400 bit/s, lasts 1.17 s.
const LONGEST_WAIT: Micros = Micros::from_millis(1_300);

/// What was in force when it was stored last: fingerprint of the gateway's settings, and the Modbus port.
static STORED: Mutex<Cell<(u32, clino_modbus::Settings)>> = Mutex::new(Cell::new((0, params::MODBUS)));

/// Whether the configuration in force is not the one that is stored, or would be delivered.
pub fn is_unsaved() -> bool {
    in_force() != critical_section::with(|cs| STORED.borrow(cs).get())
}

fn in_force() -> (u32, clino_modbus::Settings) {
    (bus::with(|gateway| gateway.fingerprint()).unwrap_or(0), modbus::settings())
}

fn note_stored(stored: (u32, clino_modbus::Settings)) {
    critical_section::with(|cs| STORED.borrow(cs).set(stored));
}

/// Who stores.
pub struct Keeper {
    store: Store<ConfigurationFlash>,
}

impl Keeper {
    /// Nothing is read yet.
    pub fn new(flash: pac::FLASH) -> Keeper {
        Keeper { store: Store::new(ConfigurationFlash::new(flash)) }
    }

    /// Takes over what is stored; what cannot be taken stays as it is. Before the gateway begins.
    #[inline(never)]
    pub fn load(&mut self, modbus: &mut clino_modbus::Settings) {
        match bus::with(|gateway| self.store.load(gateway, modbus)).unwrap_or(Err(LoadError::Library)) {
            Ok(Loaded::Stored { version }) => log!(info, "configuration of version {=u8}", version),
            Ok(Loaded::Factory | Loaded::Nothing) => log!(info, "configuration as delivered"),
            Err(LoadError::Rejected(_)) => {
                log!(error, "what is stored is no configuration for this firmware")
            }
            Err(LoadError::Flash(_) | LoadError::Library) => log!(error, "the configuration cannot be read"),
        }
        let fingerprint = bus::with(|gateway| gateway.fingerprint()).unwrap_or(0);
        note_stored((fingerprint, *modbus));
    }

    /// Stores what is in force.
    pub fn save(&mut self) -> Result<Saved, StorageError> {
        let stored = in_force();
        let saved = silently(|gateway| self.store.save(gateway, &stored.1))?.map_err(told)?;
        note_stored(stored);
        Ok(match saved {
            clino_storage::Saved::Unchanged => Saved::Unchanged,
            clino_storage::Saved::Written => Saved::Written,
        })
    }

    /// Forgets what is stored, from the next start on.
    pub fn factory_reset(&mut self) -> Result<(), StorageError> {
        silently(|_| self.store.factory_reset())?.map(|_| ()).map_err(told)
    }
}

/// Waits until all lines are silent, and does this with the gateway.
fn silently<R>(mut work: impl FnMut(&Gateway) -> R) -> Result<R, StorageError> {
    let begin = clock::now();
    while clock::now().since(begin) < LONGEST_WAIT {
        watchdog::check_in(Duty::Console);
        let result = bus::while_silent(|gateway| {
            // Nobody else can check in meanwhile: this takes less than the shortest of their deadlines, stalls left out.
            watchdog::check_in(Duty::Storage);
            let result = clock::across_stall(|| work(gateway));
            watchdog::rest(Duty::Storage);
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

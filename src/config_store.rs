//! The stored configuration: taken over at the start, stored on request, compared with the configuration in force.
//!
//! For the main loop only. Storing stalls the core, interrupts included, for 16 µs a word, and for 250 to 500 ms when a
//! sector has to be erased (`flash.rs`): frames on the buses are then lost, and requested again.

use clino_console::{Saved, StorageError};
use clino_gateway::Gateway;
use clino_modbus::Settings;
use clino_storage::{LoadError, Loaded, SaveError, SaveOutcome, Store};

use crate::flash::ConfigurationFlash;
use crate::log::log;
use crate::params;
use crate::quiet::{Kept, Known, Quiet, Work, silently};

/// Stores the configuration.
pub struct ConfigStore {
    store: Store<'static>,
    /// The configuration as delivered.
    delivered: Known,
}

impl ConfigStore {
    /// Nothing is read yet, and the configuration in force is the delivered one.
    pub fn new(flash: &'static mut ConfigurationFlash, gateway: &Gateway) -> ConfigStore {
        let delivered = (gateway.fingerprint(), params::MODBUS);
        ConfigStore { store: Store::new(flash), delivered }
    }

    /// Takes over nothing, and reads nothing that could do harm.
    pub fn leave(&mut self) -> Kept {
        let is_blank = self.store.is_blank();
        Kept { next: is_blank.then_some(self.delivered), unread: !is_blank }
    }

    /// Takes over the stored configuration; settings that cannot be taken stay as they are. Call it before the gateway
    /// begins.
    #[inline(never)]
    pub fn load(&mut self, gateway: &mut Gateway, modbus: &mut Settings) -> Kept {
        let loaded = self.store.load(gateway, modbus);
        match loaded {
            Ok(Loaded::Stored { version }) => log!(info, "configuration of version {=u8}", version),
            Ok(Loaded::Factory | Loaded::Nothing) => log!(info, "configuration as delivered"),
            Err(LoadError::Rejected(_)) => {
                log!(error, "the stored configuration is not for this firmware")
            }
            Err(LoadError::Flash(_) | LoadError::Library) => log!(error, "the configuration cannot be read"),
        }
        // A setting that is not taken now is not taken next time either.
        Kept {
            next: Some((gateway.fingerprint(), *modbus)),
            unread: matches!(loaded, Err(LoadError::Rejected(_))),
        }
    }

    /// Stores the configuration in force.
    pub fn save(&mut self, shared: &mut dyn Quiet) -> Result<Saved, StorageError> {
        let mut saving = Saving { store: &mut self.store, result: None };
        silently(shared, &mut saving)?;
        let (saved, stored) = saving.result.ok_or(StorageError::Busy)?;
        let saved = saved.map_err(told)?;
        shared.note(Kept { next: Some(stored), unread: false });
        Ok(match saved {
            SaveOutcome::Unchanged => Saved::Unchanged,
            SaveOutcome::Written => Saved::Written,
        })
    }

    /// Discards the stored configuration: the next start uses the configuration as delivered.
    pub fn factory_reset(&mut self, shared: &mut dyn Quiet) -> Result<(), StorageError> {
        let mut forgetting = Forgetting { store: &mut self.store, result: None };
        silently(shared, &mut forgetting)?;
        let forgotten = forgetting.result.ok_or(StorageError::Busy)?;
        // After a failure the old settings may be there, or nothing.
        shared.note(Kept { next: forgotten.is_ok().then_some(self.delivered), unread: false });
        forgotten.map(|_| ()).map_err(told)
    }
}

/// Whether something was stored.
type Stored = Result<SaveOutcome, SaveError>;

/// Stores the configuration in force.
struct Saving<'a> {
    store: &'a mut Store<'static>,
    /// The result, and what was stored.
    result: Option<(Stored, Known)>,
}

impl Work for Saving<'_> {
    fn run(&mut self, gateway: &Gateway, modbus: &Settings) {
        self.result = Some((self.store.save(gateway, modbus), (gateway.fingerprint(), *modbus)));
    }
}

/// Discards what is stored.
struct Forgetting<'a> {
    store: &'a mut Store<'static>,
    result: Option<Stored>,
}

impl Work for Forgetting<'_> {
    fn run(&mut self, _: &Gateway, _: &Settings) {
        self.result = Some(self.store.factory_reset());
    }
}

fn told(error: SaveError) -> StorageError {
    match error {
        SaveError::Rejected(_) => log!(error, "not stored: the settings are not valid"),
        SaveError::Flash(_) => log!(error, "not stored: the flash does not take it"),
        SaveError::Library => log!(error, "not stored: the stored data cannot be read"),
    }
    StorageError::Failed
}

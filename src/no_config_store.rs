//! In the place of `config_store.rs` in an image without storage: the configuration is the delivered one at every start, and
//! what is in the sectors of the configuration stays as it is.

use clino_console::{Saved, StorageError};
use clino_gateway::Gateway;
use clino_modbus::Settings;

use crate::flash::ConfigurationFlash;
use crate::params;
use crate::quiet::{Kept, Known, Quiet};

/// Stores nothing.
pub struct ConfigStore {
    /// The configuration as delivered.
    delivered: Known,
}

impl ConfigStore {
    pub fn new(_: &'static mut ConfigurationFlash, gateway: &Gateway) -> ConfigStore {
        ConfigStore { delivered: (gateway.fingerprint(), params::MODBUS) }
    }

    pub fn leave(&mut self) -> Kept {
        Kept { next: Some(self.delivered), unread: false }
    }

    pub fn load(&mut self, _: &mut Gateway, _: &mut Settings) -> Kept {
        Kept { next: Some(self.delivered), unread: false }
    }

    pub fn save(&mut self, _: &mut dyn Quiet) -> Result<Saved, StorageError> {
        Err(StorageError::Failed)
    }

    pub fn factory_reset(&mut self, _: &mut dyn Quiet) -> Result<(), StorageError> {
        Err(StorageError::Failed)
    }
}

//! The module that an operation addresses.

use core::fmt;

use clino_codec::isu::Address;

use crate::SingleDevice;

/// One module: by its address, or the only one attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Module(Address);

/// Address 0 addresses every module, 15 none. [`Module::single`] takes the caller's statement that there is only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NotOneModule(pub Address);

impl Module {
    /// The module of that address, 1–14.
    ///
    /// # Errors
    /// [`NotOneModule`] for 0 and 15.
    pub const fn at(address: Address) -> Result<Module, NotOneModule> {
        if address.is_any() || address.is_reserved() {
            Err(NotOneModule(address))
        } else {
            Ok(Module(address))
        }
    }

    /// The only module attached, whatever its address is.
    pub const fn single(_: SingleDevice) -> Module {
        Module(Address::ANY)
    }

    /// What its requests are addressed to.
    pub const fn address(self) -> Address {
        self.0
    }

    /// Whether it is the only one.
    pub const fn is_single(self) -> bool {
        self.0.is_any()
    }
}

impl fmt::Display for NotOneModule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "address {} is no single module's (1-14): 0 takes the statement that one is attached",
            self.0.get()
        )
    }
}

impl core::error::Error for NotOneModule {}

//! The device that an operation addresses.

use core::fmt;

use clino_codec::t7::Address;

use crate::SingleDevice;

/// One device: by its address, or the only one attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Device(Address);

/// The all-respond address names no single device. [`Device::single`] takes the caller's statement that there is only one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NotOneDevice;

impl Device {
    /// The device of that address, 1–100 or 127.
    ///
    /// # Errors
    /// [`NotOneDevice`] for 126.
    pub const fn at(address: Address) -> Result<Device, NotOneDevice> {
        if address.is_all() { Err(NotOneDevice) } else { Ok(Device(address)) }
    }

    /// The only device attached, whatever its address is. Only commands whose response length value is at most eight can
    /// be sent so (section 1.4): operations that need others refuse this device.
    pub const fn single(_: SingleDevice) -> Device {
        Device(Address::ALL)
    }

    /// What its requests are addressed to.
    pub const fn address(self) -> Address {
        self.0
    }
}

impl From<Device> for Address {
    fn from(device: Device) -> Address {
        device.address()
    }
}

impl fmt::Display for NotOneDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "address 126 is every device's: it takes the statement that one is attached")
    }
}

impl core::error::Error for NotOneDevice {}

//! The caller's statement that one sensor is attached.

/// Exactly one sensor is attached to the line.
///
/// Only the caller can know this. With two sensors, both execute each write and their answers collide.
///
/// ```
/// use clino_commissioning::{SingleDevice, t7::Device};
///
/// let device = Device::single(SingleDevice::i_have_attached_one_sensor_only());
/// assert!(device.address().is_all());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SingleDevice(());

impl SingleDevice {
    /// States that one sensor is attached.
    pub const fn i_have_attached_one_sensor_only() -> SingleDevice {
        SingleDevice(())
    }
}

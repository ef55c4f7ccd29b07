//! The caller's statement that one sensor is attached.

/// Exactly one sensor hangs on the line.
///
/// Only a person can know this. With a second sensor, answers collide, and both are written to.
///
/// ```
/// use clino_commissioning::{Alone, t7::Device};
///
/// let device = Device::alone(Alone::i_have_attached_one_sensor_only());
/// assert!(device.address().is_all());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Alone(());

impl Alone {
    /// The statement.
    pub const fn i_have_attached_one_sensor_only() -> Alone {
        Alone(())
    }
}

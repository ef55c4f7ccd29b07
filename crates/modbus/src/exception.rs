//! Why a request is answered with an exception.
//!
//! Source: MODBUS Application Protocol V1.1b3, section 7.

/// An exception code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Exception {
    /// The function, or the sub-function, is not there.
    IllegalFunction = 1,
    /// Not all registers are in the map; or on a write: not all can be written, or half a 32-bit value is left out.
    IllegalDataAddress = 2,
    /// A value is out of its range, the arm key is missing, or the request is not as long as it says.
    IllegalDataValue = 3,
    /// It could not be done.
    ServerDeviceFailure = 4,
    /// Something else is under way; ask again.
    ServerDeviceBusy = 6,
}

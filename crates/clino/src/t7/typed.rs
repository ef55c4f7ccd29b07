//! Values of a T7 as they are typed. The errors name what can stand there.

use clino_codec::angle::Range;
use clino_codec::t7::{Address, Axis, BaudRate, Direction, MAX_DAMPING_MS, MIN_DAMPING_MS, Millidegrees};

use super::names;
use crate::choice::choose;
use crate::number::within;

/// Highest address that can be given to a device. Source: T7 guide §2.8.
const MAX_NEW_ADDRESS: u8 = 100;

/// The axis of that number.
pub fn axis(text: &str) -> Result<Axis, String> {
    choose(text, Axis::ALL, Axis::get)
}

/// An angle or offset in 0.001°.
pub fn millidegrees(text: &str) -> Result<Millidegrees, String> {
    within(text, Millidegrees::MIN.0..=Millidegrees::MAX.0).map(Millidegrees)
}

/// The direction of that name.
pub fn direction(text: &str) -> Result<Direction, String> {
    choose(text, names::DIRECTIONS, names::direction)
}

/// An averaging time in milliseconds.
pub fn damping_ms(text: &str) -> Result<u16, String> {
    within(text, MIN_DAMPING_MS..=MAX_DAMPING_MS)
}

/// The output range of that name.
pub fn range(text: &str) -> Result<Range, String> {
    choose(text, names::RANGES, names::range)
}

/// One of the five bit rates, in bit/s.
pub fn baud(text: &str) -> Result<BaudRate, String> {
    choose(text, BaudRate::ALL, BaudRate::bits_per_second)
}

/// An address that can be given to a device.
pub fn new_address(text: &str) -> Result<Address, String> {
    within(text, 1..=MAX_NEW_ADDRESS)
        .and_then(|address| Address::new(address).ok_or_else(|| format!("{address} is not an address")))
}

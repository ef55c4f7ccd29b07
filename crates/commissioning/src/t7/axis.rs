//! Whether a device has the axis that an operation is about.
//!
//! A single-axis T7 answers zero for axes 0 and 1, whose zero would pass for a setting that is as wished. So an operation on
//! one of them asks first what the device is. Source: T7 guide sections 1, 2.7.1.

use clino_codec::t7::{Axis, Request, Response};

use super::Cause;

/// Asked first about an axis that not every T7 has. Its answer is too long for a [single device](super::Device::single).
pub(super) const QUESTION: Request = Request::GetDeviceInformation;

/// Whether that has to be asked: every T7 has axis 2.
pub(super) const fn is_in_question(axis: Axis) -> bool {
    !matches!(axis, Axis::Two)
}

/// The answer, if it answers that.
pub(super) fn answered(axis: Axis, response: &Response) -> Option<Result<(), Cause>> {
    let Response::GetDeviceInformation(information) = response else { return None };
    Some(if information.has_axis(axis) { Ok(()) } else { Err(Cause::NoSuchAxis { axis }) })
}

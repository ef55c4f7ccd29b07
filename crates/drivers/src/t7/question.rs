//! What is wanted of each answer.

use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{
    Address, Axis, DecodeError, DeviceInformation, Direction, Field, Millidegrees, Response, Status,
};

use super::{AllAngles, AllData, Error};
use crate::Suspect;

pub(crate) fn angle<E>(address: Address, response: Response) -> Result<Angle, Error<E>> {
    match response {
        Response::GetAngle { angle, .. } => in_range(Field::Angle, angle),
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn all_angles<E>(address: Address, response: Response) -> Result<AllAngles, Error<E>> {
    match response {
        Response::GetAllAngles { angles, temperature } => {
            Ok(AllAngles { angles: triple(Field::Angle, angles)?, temperature })
        }
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn all_data<E>(address: Address, response: Response) -> Result<AllData, Error<E>> {
    match response {
        Response::GetAllData { angles, temperature, accelerations, serial } => {
            Ok(AllData { angles: triple(Field::Angle, angles)?, temperature, accelerations, serial })
        }
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn information<E>(address: Address, response: Response) -> Result<DeviceInformation, Error<E>> {
    match response {
        Response::GetDeviceInformation(information) => Ok(information),
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn offsets<E>(address: Address, response: Response) -> Result<[Angle; 3], Error<E>> {
    match response {
        Response::GetAllAngleOffsets { offsets } => triple(Field::Offset, offsets),
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn directions<E>(address: Address, response: Response) -> Result<[Direction; 3], Error<E>> {
    match response {
        Response::GetAllDirections { directions } => Ok(directions),
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn damping_ms<E>(address: Address, response: Response) -> Result<u16, Error<E>> {
    match response {
        Response::GetDamping { damping_ms } => Ok(damping_ms),
        other => Err(Error::foreign(address, &other)),
    }
}

pub(crate) fn range<E>(address: Address, response: Response) -> Result<Range, Error<E>> {
    match response {
        Response::GetAngleOutputRange(range) => Ok(range),
        other => Err(Error::foreign(address, &other)),
    }
}

/// Tells what the device refused from answers.
pub(crate) fn accepted<E>(response: Response) -> Result<Response, Error<E>> {
    match response.status() {
        Some(Status::Success) | None => Ok(response),
        Some(status) => Err(Error::Refused(status)),
    }
}

/// Whether an angle may be the zero of an axis that is not there.
pub(crate) fn is_doubtful(axis: Axis, angle: Angle) -> bool {
    axis != Axis::Two && angle == Angle::ZERO
}

/// That a device has this axis.
pub(crate) fn has_axis<E>(axis: Axis, information: &DeviceInformation) -> Result<(), Error<E>> {
    if information.has_axis(axis) { Ok(()) } else { Err(Error::NoSuchAxis(axis)) }
}

/// The one device that an operation is about.
#[cfg(feature = "commissioning")]
pub(crate) fn device(address: Address, single: bool) -> Option<clino_commissioning::t7::Device> {
    use clino_commissioning::{SingleDevice, t7::Device};
    match Device::at(address) {
        Ok(device) => Some(device),
        Err(_) => single.then(|| Device::single(SingleDevice::i_have_attached_one_sensor_only())),
    }
}

fn triple<E>(field: Field, [zero, one, two]: [Millidegrees; 3]) -> Result<[Angle; 3], Error<E>> {
    Ok([in_range(field, zero)?, in_range(field, one)?, in_range(field, two)?])
}

/// The decoder lets only the documented range pass, which an angle can hold.
fn in_range<E>(field: Field, angle: Millidegrees) -> Result<Angle, Error<E>> {
    let error = DecodeError::Value { field, value: angle.0 };
    angle.angle().ok_or(Error::Bad { error, suspect: Suspect::Noise })
}

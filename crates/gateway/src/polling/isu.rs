//! Polling an ISU: the angle in its RAM.

use clino_bus::Isu;
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Answer, DecodeError, Request, Response};

use super::Poll;
use crate::{Bus, Source, Status};

impl Poll for Isu {
    const BUS: Bus = Bus::Isu;

    fn request(source: &Source) -> Option<(Address, Request)> {
        match *source {
            Source::Isu { address } => Some((address, Request::READ_ANGLE)),
            _ => None,
        }
    }

    fn angle(answer: &Answer) -> Result<Angle, Status> {
        match answer.response {
            Response::Error(_) => Err(Status::DeviceError),
            _ => answer.angle().ok_or(Status::BadAnswer),
        }
    }

    fn refused(_: &DecodeError) -> Status {
        // The angle uses all 65 536 codes: there is no value out of range.
        Status::BadAnswer
    }
}

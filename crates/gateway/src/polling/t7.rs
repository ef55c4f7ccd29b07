//! Polling a T7: one axis by Get Angle.

use clino_bus::T7;
use clino_codec::angle::Angle;
use clino_codec::t7::{Address, Answer, DecodeError, Field, Request, Response};

use super::Poll;
use crate::{Bus, Source, Status};

impl Poll for T7 {
    const BUS: Bus = Bus::T7;

    fn request(source: &Source) -> Option<(Address, Request)> {
        match *source {
            Source::T7 { address, axis } => Some((address, Request::GetAngle(axis))),
            _ => None,
        }
    }

    fn angle(answer: &Answer) -> Result<Angle, Status> {
        match answer.response {
            Response::GetAngle { angle, .. } => angle.angle().ok_or(Status::OutOfRange),
            // The decoder lets no other answer through.
            _ => Err(Status::BadAnswer),
        }
    }

    fn refused(error: &DecodeError) -> Status {
        match error {
            DecodeError::Value { field: Field::Angle, .. } => Status::OutOfRange,
            _ => Status::BadAnswer,
        }
    }
}

//! What is wanted of each answer.

use clino_codec::angle::Angle;
use clino_codec::isu::{Data, Response, Words};

use super::Error;

/// Tells the module's own errors from answers.
pub(crate) fn accepted<E>(response: Response) -> Result<Response, Error<E>> {
    match response {
        Response::Error(error) => Err(Error::Refused(error)),
        answer => Ok(answer),
    }
}

pub(crate) fn angle<E>(response: Response) -> Result<Angle, Error<E>> {
    response.angle_word().map(Angle::from_turn16).ok_or(Error::Other { function: response.function() })
}

pub(crate) fn ram<E>(response: Response) -> Result<Data, Error<E>> {
    match response {
        Response::ReadRam { data, .. } => Ok(data),
        other => Err(Error::Other { function: other.function() }),
    }
}

pub(crate) fn eeprom<E>(response: Response) -> Result<Words, Error<E>> {
    match response {
        Response::ReadEeprom { words, .. } => Ok(words),
        other => Err(Error::Other { function: other.function() }),
    }
}

/// That the command was carried out: the decoder has seen to it that this answers it.
pub(crate) fn done<E>(response: Response) -> Result<(), Error<E>> {
    accepted(response).map(|_| ())
}

/// The one module that an operation is about.
#[cfg(feature = "commissioning")]
pub(crate) fn module(
    address: clino_codec::isu::Address,
    single: bool,
) -> Option<clino_commissioning::isu::Module> {
    use clino_commissioning::{SingleDevice, isu::Module};
    match Module::at(address) {
        Ok(module) => Some(module),
        Err(_) => single.then(|| Module::single(SingleDevice::i_have_attached_one_sensor_only())),
    }
}

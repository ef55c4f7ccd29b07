//! STT ISU, binary mode, as a [`Protocol`].

use clino_codec::Progress;
use clino_codec::character::Character;
use clino_codec::isu::{Address, Answer, AnswerDecoder, DecodeError, EncodeError, Frame, Request};
use clino_codec::layers::Layers;

use crate::{Micros, Protocol, Timing};

/// STT ISU, binary mode. An error answer names no module and is taken for the one that was asked.
#[derive(Debug)]
pub struct Isu;

impl Protocol for Isu {
    type Address = Address;
    type Request = Request;
    type Answer = Answer;
    type EncodeError = EncodeError;
    type DecodeError = DecodeError;
    type Frame = Frame;
    type Decoder = AnswerDecoder;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode(address)
    }

    fn decoder(address: Address, request: &Request) -> AnswerDecoder {
        AnswerDecoder::new(request.expected(address), Layers::ALL)
    }

    fn push(decoder: &mut AnswerDecoder, character: Character) -> Progress<Answer, DecodeError> {
        decoder.push(character)
    }

    fn idle(decoder: &mut AnswerDecoder) -> Progress<Answer, DecodeError> {
        decoder.idle()
    }

    fn junk(decoder: &AnswerDecoder) -> u32 {
        decoder.junk()
    }

    fn latency(request: &Request, timing: &Timing) -> Micros {
        match request {
            Request::WriteEeprom { .. } | Request::ResetNullPosition => timing.set_latency,
            _ => timing.get_latency,
        }
    }
}

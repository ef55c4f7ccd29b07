//! US Digital T7 as a [`Protocol`].

use clino_codec::Progress;
use clino_codec::character::Character;
use clino_codec::layers::Layers;
use clino_codec::t7::{Address, Answer, AnswerDecoder, DecodeError, EncodeError, Frame, Request};

use crate::{Micros, Protocol, Timing};

/// US Digital T7.
#[derive(Debug)]
pub struct T7;

impl Protocol for T7 {
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
        match request.opcode().is_set() {
            true => timing.set_latency,
            false => timing.get_latency,
        }
    }
}

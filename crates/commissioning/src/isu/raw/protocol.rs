//! The ISU's protocol without the refusal of writes to undocumented memory.

use clino_bus::{Duration, Isu, Protocol, Timing};
use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::isu::{Address, Answer, AnswerDecoder, DecodeError, EncodeError, Expected, Frame, Request};

use crate::Commissionable;

/// [`Isu`] without the refusal of writes to undocumented memory. Everything else is the same.
#[derive(Debug)]
pub struct UnprotectedIsu;

impl Protocol for UnprotectedIsu {
    type Address = Address;
    type Request = Request;
    type Answer = Answer;
    type EncodeError = EncodeError;
    type DecodeError = DecodeError;
    type Frame = Frame;
    type Expected = Expected;
    type Decoder = AnswerDecoder;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode_even_if_it_bricks_the_module(address)
    }

    fn node(expected: &Expected) -> u8 {
        Isu::node(expected)
    }

    fn expected(address: Address, request: &Request) -> Expected {
        Isu::expected(address, request)
    }

    fn size(expected: &Expected) -> usize {
        Isu::size(expected)
    }

    fn latency(request: &Request, timing: &Timing) -> Duration {
        Isu::latency(request, timing)
    }

    fn writes(request: &Request) -> bool {
        Isu::writes(request)
    }

    fn decoder(expected: Expected) -> AnswerDecoder {
        Isu::decoder(expected)
    }

    fn restart(decoder: &mut AnswerDecoder, expected: Expected) {
        Isu::restart(decoder, expected);
    }

    fn push(decoder: &mut AnswerDecoder, character: Character) -> DecodeProgress<Answer, DecodeError> {
        Isu::push(decoder, character)
    }

    fn idle(decoder: &mut AnswerDecoder) -> DecodeProgress<Answer, DecodeError> {
        Isu::idle(decoder)
    }

    fn discarded(decoder: &AnswerDecoder) -> u32 {
        Isu::discarded(decoder)
    }

    fn answers(answer: &Answer, earlier: &Expected) -> bool {
        Isu::answers(answer, earlier)
    }

    fn answers_refused(error: &DecodeError, earlier: &Expected) -> bool {
        Isu::answers_refused(error, earlier)
    }

    fn confusable(later: &Expected, earlier: &Expected) -> bool {
        Isu::confusable(later, earlier)
    }
}

impl Commissionable for UnprotectedIsu {
    fn heard_damaged(answer: &Answer) -> bool {
        Isu::heard_damaged(answer)
    }
}

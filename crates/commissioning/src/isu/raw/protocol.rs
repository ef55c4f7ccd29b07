//! The ISU's protocol without the refusal of writes to undocumented memory.

use clino_bus::{ExpectedReply, Isu, Protocol, ReplyHeader};
use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::isu::{Address, Answer, DecodeError, EncodeError, Expected, Frame, Request};

use crate::Commissionable;

type Decoder = <Isu as Protocol>::Decoder;

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
    type Decoder = Decoder;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode_even_if_it_bricks_the_module(address)
    }

    fn expected(address: Address, request: &Request) -> Expected {
        Isu::expected(address, request)
    }

    fn reply(expected: &Expected) -> ExpectedReply {
        Isu::reply(expected)
    }

    fn writes(request: &Request) -> bool {
        Isu::writes(request)
    }

    fn decoder() -> Decoder {
        Isu::decoder()
    }

    fn restart(decoder: &mut Decoder, expected: Expected) {
        Isu::restart(decoder, expected);
    }

    fn forget(decoder: &mut Decoder) {
        Isu::forget(decoder);
    }

    fn push(decoder: &mut Decoder, character: Character) -> DecodeProgress<Answer, DecodeError> {
        Isu::push(decoder, character)
    }

    fn idle(decoder: &mut Decoder) -> DecodeProgress<Answer, DecodeError> {
        Isu::idle(decoder)
    }

    fn discarded(decoder: &Decoder) -> u32 {
        Isu::discarded(decoder)
    }

    fn header(answer: &Answer) -> ReplyHeader {
        Isu::header(answer)
    }

    fn refused_header(error: &DecodeError) -> Option<ReplyHeader> {
        Isu::refused_header(error)
    }
}

impl Commissionable for UnprotectedIsu {
    fn heard_damaged(answer: &Answer) -> bool {
        Isu::heard_damaged(answer)
    }
}

//! STT ISU, binary mode, as a [`Protocol`].

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::{AllChecks, Check};
use clino_codec::isu::{
    Address, Answer, AnswerDecoder, DecodeError, EncodeError, Expected, Frame, Function, Request,
};

use crate::{ExpectedReply, FailedCheck, Protocol, ReplyHeader};

/// STT ISU, binary mode. An error answer names no module and counts as one of the module that was asked.
#[derive(Debug)]
pub struct Isu;

impl Protocol for Isu {
    type Address = Address;
    type Request = Request;
    type Answer = Answer;
    type EncodeError = EncodeError;
    type DecodeError = DecodeError;
    type Frame = Frame;
    type Expected = Expected;
    type Decoder = AnswerDecoder<AllChecks>;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode(address)
    }

    fn expected(address: Address, request: &Request) -> Expected {
        request.expected(address)
    }

    fn reply(expected: &Expected) -> ExpectedReply {
        ExpectedReply {
            node: expected.address().get(),
            from_any: expected.address().is_any(),
            command: expected.function() as u8,
            characters: expected.size() as u16,
        }
    }

    fn writes(request: &Request) -> bool {
        matches!(request, Request::WriteEeprom { .. } | Request::ResetNullPosition)
    }

    fn decoder() -> AnswerDecoder<AllChecks> {
        AnswerDecoder::new(Expected::angle(), AllChecks)
    }

    fn restart(decoder: &mut AnswerDecoder<AllChecks>, expected: Expected) {
        decoder.restart(expected);
    }

    fn forget(decoder: &mut AnswerDecoder<AllChecks>) {
        decoder.forget();
    }

    fn push(
        decoder: &mut AnswerDecoder<AllChecks>,
        character: Character,
    ) -> DecodeProgress<Answer, DecodeError> {
        decoder.push(character)
    }

    fn idle(decoder: &mut AnswerDecoder<AllChecks>) -> DecodeProgress<Answer, DecodeError> {
        decoder.idle()
    }

    fn discarded(decoder: &AnswerDecoder<AllChecks>) -> u32 {
        decoder.discarded()
    }

    /// An error answer names no module: it may come from any.
    fn header(answer: &Answer) -> ReplyHeader {
        let function = answer.response.function();
        function.map_or(ReplyHeader::Unnamed, |function| named(answer.address, function))
    }

    fn refused_header(error: &DecodeError) -> Option<ReplyHeader> {
        match *error {
            DecodeError::Foreign { address, function, .. } => Some(named(address, function)),
            // The module that is being asked now, about what it was asked before.
            DecodeError::Memory { .. } => Some(ReplyHeader::Unnamed),
            _ => None,
        }
    }
}

fn named(address: Address, function: Function) -> ReplyHeader {
    ReplyHeader::Named { node: address.get(), command: function as u8 }
}

impl FailedCheck for DecodeError {
    fn failed_check(&self) -> Check {
        self.failed_check()
    }
}

//! US Digital T7 as a [`Protocol`].

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::{Check, Checks};
use clino_codec::t7::{
    Address, Answer, AnswerDecoder, CommandFrame, DecodeError, EncodeError, Expected, Opcode, Request,
};

use crate::{ExpectedReply, FailedCheck, Protocol, ReplyHeader};

/// US Digital T7.
#[derive(Debug)]
pub struct T7;

impl Protocol for T7 {
    type Address = Address;
    type Request = Request;
    type Answer = Answer;
    type EncodeError = EncodeError;
    type DecodeError = DecodeError;
    type Frame = CommandFrame;
    type Expected = Expected;
    type Decoder = AnswerDecoder;

    fn encode(address: Address, request: &Request) -> Result<CommandFrame, EncodeError> {
        request.encode(address)
    }

    fn expected(address: Address, request: &Request) -> Expected {
        request.expected(address)
    }

    fn reply(&Expected { address, opcode }: &Expected) -> ExpectedReply {
        ExpectedReply {
            node: address.get(),
            from_any: address.is_all(),
            command: opcode.get(),
            characters: Expected { address, opcode }.size() as u16,
        }
    }

    fn writes(request: &Request) -> bool {
        request.opcode().is_set()
    }

    fn decoder() -> AnswerDecoder {
        let expected = Expected { address: Address::FACTORY, opcode: Opcode::GetAngle2 };
        AnswerDecoder::new(expected, Checks::ALL)
    }

    fn restart(decoder: &mut AnswerDecoder, expected: Expected) {
        decoder.restart(expected);
    }

    fn forget(decoder: &mut AnswerDecoder) {
        decoder.forget();
    }

    fn push(decoder: &mut AnswerDecoder, character: Character) -> DecodeProgress<Answer, DecodeError> {
        decoder.push(character)
    }

    fn idle(decoder: &mut AnswerDecoder) -> DecodeProgress<Answer, DecodeError> {
        decoder.idle()
    }

    fn discarded(decoder: &AnswerDecoder) -> u32 {
        decoder.discarded()
    }

    fn header(answer: &Answer) -> ReplyHeader {
        named(answer.address, answer.response.opcode())
    }

    fn refused_header(error: &DecodeError) -> Option<ReplyHeader> {
        match *error {
            DecodeError::Foreign { address, opcode, .. } => Some(named(address, opcode)),
            _ => None,
        }
    }
}

fn named(address: Address, opcode: Opcode) -> ReplyHeader {
    ReplyHeader::Named { node: address.get(), command: opcode.get() }
}

impl FailedCheck for DecodeError {
    fn failed_check(&self) -> Check {
        self.failed_check()
    }
}

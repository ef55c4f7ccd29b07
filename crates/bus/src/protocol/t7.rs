//! US Digital T7 as a [`Protocol`].

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::Check;
use clino_codec::t7::{
    Address, Answer, AnswerDecoder, AsAsked, Axis, CommandFrame, DecodeError, EncodeError, Expected, Opcode,
    Request,
};

use crate::{ExpectedReply, FailedCheck, Protocol, ReplyHeader};

/// US Digital T7.
#[derive(Debug)]
pub struct T7;

/// The answer that a request calls for, and how it is read.
#[derive(Clone, Copy, Debug)]
pub struct Awaited {
    expected: Expected,
    reader: AsAsked,
}

impl Protocol for T7 {
    type Address = Address;
    type Request = Request;
    type Answer = Answer;
    type EncodeError = EncodeError;
    type DecodeError = DecodeError;
    type Frame = CommandFrame;
    type Expected = Awaited;
    type Decoder = AnswerDecoder<AsAsked>;

    fn encode(address: Address, request: &Request) -> Result<CommandFrame, EncodeError> {
        request.encode(address)
    }

    fn expected(address: Address, request: &Request) -> Awaited {
        Awaited { expected: request.expected(address), reader: request.reader() }
    }

    fn reply(awaited: &Awaited) -> ExpectedReply {
        let Expected { address, opcode } = awaited.expected;
        ExpectedReply {
            node: address.get(),
            from_any: address.is_all(),
            command: opcode.get(),
            characters: Expected { address, opcode }.size() as u16,
        }
    }

    fn writes(request: &Request) -> bool {
        request.is_set()
    }

    fn decoder() -> AnswerDecoder<AsAsked> {
        let request = Request::GetAngle(Axis::Two);
        AnswerDecoder::new(request.expected(Address::FACTORY), request.reader())
    }

    fn restart(decoder: &mut AnswerDecoder<AsAsked>, awaited: Awaited) {
        decoder.restart_with(awaited.expected, awaited.reader);
    }

    fn forget(decoder: &mut AnswerDecoder<AsAsked>) {
        decoder.forget();
    }

    fn push(
        decoder: &mut AnswerDecoder<AsAsked>,
        character: Character,
    ) -> DecodeProgress<Answer, DecodeError> {
        decoder.push(character)
    }

    fn idle(decoder: &mut AnswerDecoder<AsAsked>) -> DecodeProgress<Answer, DecodeError> {
        decoder.idle()
    }

    fn discarded(decoder: &AnswerDecoder<AsAsked>) -> u32 {
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

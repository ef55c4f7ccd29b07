//! US Digital T7 as a [`Protocol`].

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::{Check, Checks};
use clino_codec::t7::{Address, Answer, AnswerDecoder, DecodeError, EncodeError, Expected, Frame, Request};

use crate::{Duration, FailedCheck, Protocol, Timing};

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
    type Expected = Expected;
    type Decoder = AnswerDecoder;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode(address)
    }

    fn node(expected: &Expected) -> u8 {
        expected.address.get()
    }

    fn expected(address: Address, request: &Request) -> Expected {
        request.expected(address)
    }

    fn size(expected: &Expected) -> usize {
        expected.size()
    }

    fn latency(request: &Request, timing: &Timing) -> Duration {
        if Self::writes(request) { timing.set_latency } else { timing.get_latency }
    }

    fn writes(request: &Request) -> bool {
        request.opcode().is_set()
    }

    fn decoder(expected: Expected) -> AnswerDecoder {
        AnswerDecoder::new(expected, Checks::ALL)
    }

    fn restart(decoder: &mut AnswerDecoder, expected: Expected) {
        decoder.restart(expected);
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

    fn answers(answer: &Answer, earlier: &Expected) -> bool {
        answer.response.opcode() == earlier.opcode && may_be(answer.address, earlier.address)
    }

    fn answers_refused(error: &DecodeError, earlier: &Expected) -> bool {
        matches!(error, &DecodeError::Foreign { address, opcode, .. }
            if opcode == earlier.opcode && may_be(address, earlier.address))
    }

    fn confusable(later: &Expected, earlier: &Expected) -> bool {
        later.opcode == earlier.opcode && (may_be(later.address, earlier.address) || later.address.is_all())
    }
}

/// Whether the device at `address` was asked when `asked` was.
fn may_be(address: Address, asked: Address) -> bool {
    asked.is_all() || asked == address
}

impl FailedCheck for DecodeError {
    fn failed_check(&self) -> Check {
        self.failed_check()
    }
}

//! STT ISU, binary mode, as a [`Protocol`].

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::{Check, Checks};
use clino_codec::isu::{Address, Answer, AnswerDecoder, DecodeError, EncodeError, Expected, Frame, Request};

use crate::{Duration, FailedCheck, Protocol, Timing};

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
    type Decoder = AnswerDecoder;

    fn encode(address: Address, request: &Request) -> Result<Frame, EncodeError> {
        request.encode(address)
    }

    fn node(expected: &Expected) -> u8 {
        expected.address().get()
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
        matches!(request, Request::WriteEeprom { .. } | Request::ResetNullPosition)
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

    /// An error answer names no module: it may come from any.
    fn answers(answer: &Answer, earlier: &Expected) -> bool {
        answer.response.function().is_none_or(|function| {
            function == earlier.function() && may_be(answer.address, earlier.address())
        })
    }

    fn answers_refused(error: &DecodeError, earlier: &Expected) -> bool {
        match *error {
            DecodeError::Foreign { address, function, .. } => {
                function == earlier.function() && may_be(address, earlier.address())
            }
            // The module that is being asked now, about what it was asked before.
            DecodeError::Memory { .. } => true,
            _ => false,
        }
    }

    fn confusable(later: &Expected, earlier: &Expected) -> bool {
        later.function() == earlier.function()
            && (may_be(later.address(), earlier.address()) || later.address().is_any())
    }
}

/// Whether the module at `address` was asked when `asked` was.
fn may_be(address: Address, asked: Address) -> bool {
    asked.is_any() || asked == address
}

impl FailedCheck for DecodeError {
    fn failed_check(&self) -> Check {
        self.failed_check()
    }
}

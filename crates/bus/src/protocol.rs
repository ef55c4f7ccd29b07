//! A vendor's protocol, as the [`Master`](crate::Master) needs it.

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::Check;

mod isu;
mod reply;
mod t7;

pub use isu::Isu;
pub use reply::{ExpectedReply, ReplyHeader};
pub use t7::T7;

/// A request/response protocol with one master.
pub trait Protocol {
    /// Address of the node that is asked.
    type Address: Copy;
    /// What is asked.
    type Request;
    /// What comes back.
    type Answer;
    /// The request cannot be put into a frame.
    type EncodeError;
    /// What came back is not the answer.
    type DecodeError: Clone + FailedCheck;
    /// A request as bytes.
    type Frame: AsRef<[u8]>;
    /// What the answer to a request has to be.
    type Expected: Copy;
    /// Turns characters into the answer.
    type Decoder;

    /// The frame to send.
    fn encode(address: Self::Address, request: &Self::Request) -> Result<Self::Frame, Self::EncodeError>;

    /// What the answer has to be.
    fn expected(address: Self::Address, request: &Self::Request) -> Self::Expected;

    /// The same, as far as it tells one answer from another.
    fn reply(expected: &Self::Expected) -> ExpectedReply;

    /// Whether the request changes the sensor's non-volatile memory.
    fn writes(request: &Self::Request) -> bool;

    /// A decoder before its first [`restart`](Self::restart): until then it is handed nothing.
    fn decoder() -> Self::Decoder;

    /// Makes a decoder wait for that answer and nothing else; what it holds is forgotten.
    fn restart(decoder: &mut Self::Decoder, expected: Self::Expected);

    /// Makes a decoder forget what it holds, and wait for the same.
    fn forget(decoder: &mut Self::Decoder);

    /// Feeds the decoder.
    fn push(
        decoder: &mut Self::Decoder,
        character: Character,
    ) -> DecodeProgress<Self::Answer, Self::DecodeError>;

    /// The answer's time is over: settles what the decoder still holds back. To be called until it says `More`.
    fn idle(decoder: &mut Self::Decoder) -> DecodeProgress<Self::Answer, Self::DecodeError>;

    /// Characters the decoder passed over because they belong to no frame, since it was made.
    fn discarded(decoder: &Self::Decoder) -> u32;

    /// Which request this answers.
    fn header(answer: &Self::Answer) -> ReplyHeader;

    /// Which request that answers which was refused, if it is intact.
    fn refused_header(error: &Self::DecodeError) -> Option<ReplyHeader>;
}

/// Why a frame was refused, for any protocol.
pub trait FailedCheck {
    /// The check that refused it.
    fn failed_check(&self) -> Check;
}

impl FailedCheck for Check {
    fn failed_check(&self) -> Check {
        *self
    }
}

//! A vendor's protocol, as the [`Master`](crate::Master) needs it.

use clino_codec::DecodeProgress;
use clino_codec::character::Character;
use clino_codec::checks::Check;

use crate::{Duration, Timing};

mod isu;
mod t7;

pub use isu::Isu;
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

    /// A different number for every node, below 128.
    fn node(expected: &Self::Expected) -> u8;

    /// What the answer has to be.
    fn expected(address: Self::Address, request: &Self::Request) -> Self::Expected;

    /// Characters of that answer.
    fn size(expected: &Self::Expected) -> usize;

    /// Longest time from our last stop bit to the answer's first start bit.
    fn latency(request: &Self::Request, timing: &Timing) -> Duration;

    /// Whether the request changes the sensor's non-volatile memory.
    fn writes(request: &Self::Request) -> bool;

    /// A decoder that waits for that answer and nothing else.
    fn decoder(expected: Self::Expected) -> Self::Decoder;

    /// Makes a decoder wait for that answer; what it holds is forgotten.
    fn restart(decoder: &mut Self::Decoder, expected: Self::Expected);

    /// Feeds the decoder.
    fn push(
        decoder: &mut Self::Decoder,
        character: Character,
    ) -> DecodeProgress<Self::Answer, Self::DecodeError>;

    /// The answer's time is over: settles what the decoder still holds back. To be called until it says `More`.
    fn idle(decoder: &mut Self::Decoder) -> DecodeProgress<Self::Answer, Self::DecodeError>;

    /// Characters the decoder passed over because they belong to no frame, since it was made.
    fn discarded(decoder: &Self::Decoder) -> u32;

    /// Whether this answer may be the one that `earlier` called for.
    fn answers(answer: &Self::Answer, earlier: &Self::Expected) -> bool;

    /// Whether what was refused is intact and may be the answer that `earlier` called for.
    fn answers_refused(error: &Self::DecodeError, earlier: &Self::Expected) -> bool;

    /// Whether a node's answer that `earlier` called for would pass for the one that `later` calls for.
    fn confusable(later: &Self::Expected, earlier: &Self::Expected) -> bool;
}

/// Why a frame was refused, for any protocol.
pub trait FailedCheck {
    /// The check that refused it.
    fn failed_check(&self) -> Check;
}
